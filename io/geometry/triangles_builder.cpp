#include "io/geometry/triangles_builder.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <limits>

namespace lahar {

namespace {

constexpr std::size_t first_slots = 1 << 10;

/// Coordinates are not larger [m].
constexpr double farthest = 1e12;

std::uint64_t hash_of(const Vec<3>& x) {
  std::uint64_t hash = 0;
  for (int d = 0; d < 3; ++d) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(x[d])) * 0x9e3779b97f4a7c15U;
    hash ^= hash >> 32;
  }
  return hash;
}

}  // namespace

TrianglesBuilder::TrianglesBuilder(const TrianglesPlace& place)
    : place_(place), slots_(first_slots, -1) {}

std::size_t TrianglesBuilder::slot_of(const Vec<3>& x) const {
  std::size_t slot = hash_of(x) & (slots_.size() - 1);
  while (slots_[slot] >= 0 && triangles_.points[static_cast<std::size_t>(slots_[slot])] != x)
    slot = (slot + 1) & (slots_.size() - 1);
  return slot;
}

void TrianglesBuilder::grow() {
  slots_.assign(2 * slots_.size(), -1);
  for (std::size_t i = 0; i < triangles_.points.size(); ++i)
    slots_[slot_of(triangles_.points[i])] = static_cast<Local>(i);
}

Local TrianglesBuilder::point(const Vec<3>& x) {
  Vec<3> at = place_.scale * x + place_.offset;
  if (!(at.cwiseAbs().maxCoeff() <= farthest))
    throw InputError({Problem{
        .message = fmt::format("a surface has a corner at ({:g}, {:g}, {:g})", at[0], at[1], at[2]),
        .hint = "coordinates, times 'scale' and with 'offset', are finite numbers of metres"}});
  at.array() += 0.0;  // no -0, which has other bits
  std::size_t slot = slot_of(at);
  if (slots_[slot] >= 0) return slots_[slot];
  if (triangles_.points.size() == std::numeric_limits<Local>::max())
    throw InputError("a surface has too many points");
  const auto id = static_cast<Local>(triangles_.points.size());
  triangles_.points.push_back(at);
  slots_[slot] = id;
  if (2 * triangles_.points.size() > slots_.size()) grow();
  return id;
}

bool TrianglesBuilder::polygon(const std::vector<Local>& corners) {
  const auto first = triangles_.corners.size();
  for (std::size_t k = 2; k < corners.size(); ++k)
    triangle({corners[0], corners[k - 1], corners[k]});
  if (corners.size() == 3) return true;
  const auto last = static_cast<Index>(triangles_.corners.size());
  Vec<3> normal = Vec<3>::Zero();
  for (auto t = static_cast<Index>(first); t < last; ++t) normal += triangles_.area_vector(t);
  for (auto t = static_cast<Index>(first); t < last; ++t)
    if (triangles_.area_vector(t).dot(normal) < 0) return false;
  return true;
}

}  // namespace lahar
