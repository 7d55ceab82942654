#include "physics/geometry/outlines.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lahar {

namespace {

/// Edges belong to bands that they only touch, too, to this share of the whole [-]: more than the
/// tolerance of any question.
constexpr double band_margin = 1e-7;

constexpr std::size_t edges_per_band = 4, most_bands = std::size_t{1} << 16;

}  // namespace

Outlines::Outlines(const std::vector<Polygon>& polygons) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  bounds_ = {Vec<2>::Constant(inf), Vec<2>::Constant(-inf)};
  std::uint32_t number = 0;
  for (const Polygon& polygon : polygons) {
    for (const Ring& ring : polygon)
      for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
        edge_.push_back({ring[j], ring[i], number});
        bounds_.first = bounds_.first.cwiseMin(ring[i]);
        bounds_.second = bounds_.second.cwiseMax(ring[i]);
      }
    ++number;
  }
  if (edge_.empty()) return;
  margin_ = band_margin * (bounds_.second - bounds_.first).maxCoeff();
  // Long edges lie in many bands: then there are fewer.
  std::size_t bands = std::clamp<std::size_t>(edge_.size() / edges_per_band, 1, most_bands);
  while (!fill_bands(bands, 16 * edge_.size()) && bands > 1) bands /= 2;
}

std::size_t Outlines::band_of(double y) const {
  const auto last = static_cast<double>(first_.size() - 2);
  return static_cast<std::size_t>(
      std::clamp(std::floor((y - bounds_.first.y()) / per_band_), 0.0, last));
}

bool Outlines::fill_bands(std::size_t bands, std::size_t most) {
  const double height = bounds_.second.y() - bounds_.first.y();
  per_band_ = height > 0 ? height / static_cast<double>(bands) : 1;
  first_.assign(bands + 1, 0);
  const auto each = [&](auto&& visit) {
    for (std::size_t e = 0; e < edge_.size(); ++e) {
      const auto [low, high] = std::minmax(edge_[e].from.y(), edge_[e].to.y());
      const std::size_t end = band_of(high + margin_);
      for (std::size_t b = band_of(low - margin_); b <= end; ++b) visit(e, b);
    }
  };
  each([&](std::size_t, std::size_t b) { ++first_[b + 1]; });
  for (std::size_t b = 0; b < bands; ++b) first_[b + 1] += first_[b];
  if (first_.back() > most && bands > 1) return false;
  in_band_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  each([&](std::size_t e, std::size_t b) { in_band_[next[b]++] = static_cast<std::uint32_t>(e); });
  return true;
}

bool Outlines::contains(const Vec<2>& x, double tolerance) const {
  const auto& [low, high] = bounds_;
  if (!((x - low).minCoeff() >= -tolerance && (high - x).minCoeff() >= -tolerance)) return false;
  const std::size_t band = band_of(x.y());
  bool inside = false;
  std::uint32_t polygon = 0;
  for (std::size_t k = first_[band]; k < first_[band + 1]; ++k) {
    const Edge& e = edge_[in_band_[k]];
    if (e.polygon != polygon) {
      if (inside) return true;
      polygon = e.polygon;
    }
    const Vec<2> edge = e.to - e.from, to = x - e.from;
    const double squared = edge.squaredNorm();
    const double t = squared > 0 ? std::clamp(to.dot(edge) / squared, 0.0, 1.0) : 0.0;
    if ((to - t * edge).squaredNorm() <= tolerance * tolerance) return true;
    if ((e.from.y() > x.y()) != (e.to.y() > x.y()) && to.x() < edge.x() * to.y() / edge.y())
      inside = !inside;
  }
  return inside;
}

Vec<2> Outlines::from_edge(const Vec<2>& x) const {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Vec<2> nearest = Vec<2>::Constant(inf);
  double least = inf;
  const auto look_in = [&](std::size_t band) {
    for (std::size_t k = first_[band]; k < first_[band + 1]; ++k) {
      const Edge& e = edge_[in_band_[k]];
      const Vec<2> edge = e.to - e.from, to = x - e.from;
      const double squared = edge.squaredNorm();
      const double t = squared > 0 ? std::clamp(to.dot(edge) / squared, 0.0, 1.0) : 0.0;
      const Vec<2> from = to - t * edge;
      if (from.squaredNorm() >= least) continue;
      least = from.squaredNorm();
      nearest = from;
    }
  };
  const std::size_t bands = first_.size() - 1, middle = band_of(x.y());
  const auto border = [&](std::size_t band) {  // the lower one
    return bounds_.first.y() + static_cast<double>(band) * per_band_;
  };
  for (std::size_t band = middle + 1; band-- > 0;) {
    const double gap = x.y() - border(band + 1);
    if (band < middle && gap > 0 && gap * gap >= least) break;
    look_in(band);
  }
  for (std::size_t band = middle + 1; band < bands; ++band) {
    const double gap = border(band) - x.y();
    if (gap > 0 && gap * gap >= least) break;
    look_in(band);
  }
  return nearest;
}

bool Outlines::crosses(const Vec<2>& low, const Vec<2>& high) const {
  if (edge_.empty() || !((high - bounds_.first).minCoeff() >= -margin_ &&
                         (bounds_.second - low).minCoeff() >= -margin_))
    return false;
  const Vec<2> centre = 0.5 * (low + high), half = 0.5 * (high - low).array() + margin_;
  const std::size_t end = band_of(high.y());
  for (std::size_t k = first_[band_of(low.y())]; k < first_[end + 1]; ++k) {
    const Edge& e = edge_[in_band_[k]];
    const Vec<2> mid = 0.5 * (e.from + e.to) - centre, reach = 0.5 * (e.to - e.from);
    if (std::abs(mid.x()) > half.x() + std::abs(reach.x()) ||
        std::abs(mid.y()) > half.y() + std::abs(reach.y()))
      continue;
    if (std::abs(mid.x() * reach.y() - mid.y() * reach.x()) <=
        half.x() * std::abs(reach.y()) + half.y() * std::abs(reach.x()))
      return true;
  }
  return false;
}

}  // namespace lahar
