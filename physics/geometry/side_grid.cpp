#include "physics/geometry/side_grid.h"

#include <algorithm>
#include <cmath>

namespace lahar {

namespace {

/// As many boxes as this for each triangle, within these numbers.
constexpr double boxes_per_triangle = 16, fewest = 1 << 12, most = 1 << 22;
/// What is so near to a box [-, of its edge] crosses it: more than rounding.
constexpr double touch = 1e-6;

double edge_for(const Vec<3>& size, std::size_t triangles) {
  const double wanted =
      std::clamp(boxes_per_triangle * static_cast<double>(triangles), fewest, most);
  // Flat boxes have a layer at least.
  const Vec<3> thick = size.cwiseMax(size.maxCoeff() / std::sqrt(wanted));
  return std::cbrt(thick.prod() / wanted);
}

}  // namespace

SideGrid::SideGrid(const Triangles& triangles, const Vec<3>& low, const Vec<3>& high,
                   const std::function<bool(const Vec<3>&)>& is_inside)
    : low_(low), high_(high), edge_(edge_for(high - low, triangles.corners.size())) {
  Index n = 1;
  for (int d = 0; d < 3; ++d) {
    const auto count = static_cast<Index>(std::floor((high[d] - low[d]) / edge_)) + 1;
    counts_[static_cast<std::size_t>(d)] = count;
    n *= count;
  }
  sides_.assign(static_cast<std::size_t>(n), Side::unknown);
  mark_crossed(triangles);
  for (Index box = 0; box < n; ++box)
    if (sides_[static_cast<std::size_t>(box)] == Side::unknown)
      flood(box, is_inside(centre_of(box)) ? Side::inside : Side::outside);
}

std::array<Index, 3> SideGrid::place_of(Index box) const {
  return {box % counts_[0], box / counts_[0] % counts_[1], box / counts_[0] / counts_[1]};
}

Vec<3> SideGrid::centre_of(Index box) const {
  const auto [i, j, k] = place_of(box);
  return low_ +
         edge_ * (Vec<3>(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)) +
                  Vec<3>::Constant(0.5));
}

/// Boxes that a triangle may cross: those around it which its plane meets.
void SideGrid::mark_crossed(const Triangles& triangles) {
  for (Index t = 0; t < static_cast<Index>(triangles.corners.size()); ++t) {
    std::array<Index, 3> first, last;
    Vec<3> below = triangles.point(t, 0), above = below;
    for (int corner = 1; corner < 3; ++corner) {
      below = below.cwiseMin(triangles.point(t, corner));
      above = above.cwiseMax(triangles.point(t, corner));
    }
    for (int d = 0; d < 3; ++d) {
      const auto axis = static_cast<std::size_t>(d);
      const auto place = [&](double x, double off) {
        return std::clamp(static_cast<Index>(std::floor((x - low_[d]) / edge_ + off)), Index{0},
                          counts_[axis] - 1);
      };
      first[axis] = place(below[d], -touch);
      last[axis] = place(above[d], touch);
    }
    const Vec<3> normal = triangles.area_vector(t).normalized();
    const double reach = (0.5 + touch) * edge_ * normal.cwiseAbs().sum();
    for (Index k = first[2]; k <= last[2]; ++k)
      for (Index j = first[1]; j <= last[1]; ++j)
        for (Index i = first[0]; i <= last[0]; ++i) {
          const Index box = i + counts_[0] * (j + counts_[1] * k);
          if (std::abs(normal.dot(centre_of(box) - triangles.point(t, 0))) <= reach)
            sides_[static_cast<std::size_t>(box)] = Side::on_surface;
        }
  }
}

/// All boxes that hang together with this one by their faces.
void SideGrid::flood(Index from, Side side) {
  std::vector<Index> front{from};
  sides_[static_cast<std::size_t>(from)] = side;
  while (!front.empty()) {
    const Index box = front.back();
    front.pop_back();
    const auto place = place_of(box);
    Index stride = 1;
    for (std::size_t d = 0; d < 3; stride *= counts_[d++])
      for (const Index step : {-1, 1}) {
        if (place[d] + step < 0 || place[d] + step >= counts_[d]) continue;
        Side& next = sides_[static_cast<std::size_t>(box + step * stride)];
        if (next != Side::unknown) continue;
        next = side;
        front.push_back(box + step * stride);
      }
  }
}

Side SideGrid::at(const Vec<3>& x) const {
  std::array<Index, 3> place;
  for (int d = 0; d < 3; ++d) {
    if (!(x[d] >= low_[d] && x[d] <= high_[d])) return Side::outside;
    const auto axis = static_cast<std::size_t>(d);
    place[axis] = std::min(static_cast<Index>((x[d] - low_[d]) / edge_), counts_[axis] - 1);
  }
  return sides_[static_cast<std::size_t>(place[0] +
                                         counts_[0] * (place[1] + counts_[1] * place[2]))];
}

}  // namespace lahar
