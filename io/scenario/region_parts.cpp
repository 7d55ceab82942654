#include "io/scenario/region_parts.h"

#include <algorithm>
#include <limits>

namespace lahar {

namespace {

/// A part with less of its volume inside gives it away [-].
constexpr double least_share = 0.1;

/// Samples of a part that is cut: a lattice (Korobov), which has as many different coordinates
/// along each axis, so that layers parallel to an axis are right to one in this number.
template <int Dim>
constexpr std::size_t lattice_size = Dim == 2 ? 233 : 251;
template <int Dim>
constexpr std::size_t lattice_generator = Dim == 2 ? 144 : 81;

template <int Dim>
std::vector<Vec<Dim>> lattice() {
  constexpr std::size_t n = lattice_size<Dim>;
  std::vector<Vec<Dim>> points(n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t d = 0, k = i; d < Dim; ++d, k = k * lattice_generator<Dim> % n)
      points[i][static_cast<int>(d)] =
          (2.0 * static_cast<double>(k) + 1) / static_cast<double>(n) - 1;
  return points;
}

/// The box around a part of a cell.
template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> box_of_part(const CellMap<Dim>& map, const Vec<Dim>& xi,
                                          double half) {
  Vec<Dim> low = Vec<Dim>::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (unsigned k = 0; k < corners<Dim>; ++k) {
    Vec<Dim> at = xi;
    for (int d = 0; d < Dim; ++d) at[d] += (k >> d & 1u) ? half : -half;
    const Vec<Dim> x = map.point(at);
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  return {low, high};
}

}  // namespace

template <int Dim>
std::vector<Vec<Dim>> part_centres(int n) {
  std::size_t total = 1;
  for (int d = 0; d < Dim; ++d) total *= static_cast<std::size_t>(n);
  std::vector<Vec<Dim>> points(total);
  for (std::size_t p = 0; p < total; ++p)
    for (std::size_t d = 0, rest = p; d < Dim; ++d, rest /= static_cast<std::size_t>(n))
      points[p][static_cast<int>(d)] =
          -1 + (2.0 * static_cast<int>(rest % static_cast<std::size_t>(n)) + 1) / n;
  return points;
}

template <int Dim>
CutParts<Dim>::CutParts(const Mesh<Dim>& mesh, const Region<Dim>& region, int n)
    : mesh_(mesh),
      region_(region),
      n_(n),
      half_(1.0 / n),
      share_(std::pow(1.0 / n, Dim)),
      points_(part_centres<Dim>(n)),
      samples_(lattice<Dim>()) {}

template <int Dim>
std::vector<typename CutParts<Dim>::Part> CutParts<Dim>::parts_of(Index cell) const {
  const auto geometry = mesh_.geometry(cell);
  const CellMap<Dim> map{geometry.corner};
  const auto [low, high] = box_of_part<Dim>(map, Vec<Dim>::Zero(), 1.0);
  const Coverage of_cell = region_.coverage(low, high);
  if (of_cell == Coverage::none) return {};
  const Vec<Dim> half_edges = 0.5 * half_ * geometry.length;
  std::vector<Part> parts(points_.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Vec<Dim>& xi = points_[p];
    Vec<Dim> x = geometry.centre;
    if (geometry.cartesian)
      x += 0.5 * geometry.length.cwiseProduct(xi);
    else
      x = map.point(xi);
    const double whole =
        geometry.cartesian ? geometry.length.prod() * share_ : map.volume(xi, half_);
    parts[p] = {x, whole, 1};
    if (of_cell == Coverage::all) continue;
    const Box box =
        geometry.cartesian ? Box(x - half_edges, x + half_edges) : box_of_part<Dim>(map, xi, half_);
    const Coverage of_part = region_.coverage(box.first, box.second);
    if (of_part == Coverage::none) parts[p] = {};
    if (of_part == Coverage::part)
      sample(map, xi, geometry.cartesian ? &half_edges : nullptr, box, parts[p]);
  }
  if (of_cell == Coverage::part) merge_slivers(parts);
  return parts;
}

/// What of a whole part lies inside, by samples. `edges`: half of its edges, if it is a box [m].
template <int Dim>
void CutParts<Dim>::sample(const CellMap<Dim>& map, const Vec<Dim>& xi, const Vec<Dim>* edges,
                           const Box& box, Part& part) const {
  const auto contains = region_.contains_within(box.first, box.second);
  const Vec<Dim> centre = part.x;
  const auto place = [&](const Vec<Dim>& s) {
    return edges ? Vec<Dim>(centre + s.cwiseProduct(*edges)) : map.point(xi + half_ * s);
  };
  double inside = 0, all = 0;
  Vec<Dim> sum = Vec<Dim>::Zero();
  for (const Vec<Dim>& s : samples_) {
    const Vec<Dim> x = place(s);
    const double weight = edges ? 1 : map.jacobian(xi + half_ * s);
    all += weight;
    if (!contains(x)) continue;
    inside += weight;
    sum += weight * x;
  }
  if (inside == all) return;  // the boundary touches it
  const double whole = part.volume;
  part = {};
  if (inside == 0) return;
  part = {sum / inside, whole * (inside / all), inside / all};
  if (contains(part.x)) return;
  // What lies inside is not convex: the nearest sample in it.
  const Vec<Dim> centroid = part.x;
  double least = std::numeric_limits<double>::infinity();
  for (const Vec<Dim>& s : samples_) {
    const Vec<Dim> x = place(s);
    const double distance = (x - centroid).squaredNorm();
    if (distance >= least || !contains(x)) continue;
    least = distance;
    part.x = x;
  }
}

template <int Dim>
void CutParts<Dim>::merge_slivers(std::vector<Part>& parts) const {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    Part& part = parts[p];
    if (part.volume == 0 || part.share >= least_share) continue;
    Part* best = nullptr;
    for (std::size_t d = 0, stride = 1; d < Dim; ++d, stride *= static_cast<std::size_t>(n_)) {
      const std::size_t at = p / stride % static_cast<std::size_t>(n_);
      const auto look = [&](std::size_t q) {
        if (parts[q].share >= least_share && (!best || parts[q].share > best->share))
          best = &parts[q];
      };
      if (at > 0) look(p - stride);
      if (at + 1 < static_cast<std::size_t>(n_)) look(p + stride);
    }
    if (!best) continue;
    const double volume = best->volume + part.volume;
    const Vec<Dim> centroid = (best->volume * best->x + part.volume * part.x) / volume;
    best->volume = volume;
    if (region_.contains(centroid)) best->x = centroid;
    part = {};
  }
}

template std::vector<Vec<2>> part_centres<2>(int);
template std::vector<Vec<3>> part_centres<3>(int);
template class CutParts<2>;
template class CutParts<3>;

}  // namespace lahar
