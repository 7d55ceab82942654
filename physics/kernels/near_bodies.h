/// \file Rigid bodies as the kernels of contact see them, and which cells they are near.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "physics/particles/patch.h"

namespace lahar {

/// Cells whose middle is nearer to a body than so many radii of the ball around them have particles
/// that may touch it: they are up to one away from the middle, and move less than half of one.
inline constexpr double near_radii = 1.75;

/// Bodies as a step has them.
template <int Dim>
class Bodies {
 public:
  Bodies(const Patch<Dim>& patch, const StepContext<Dim>& step)
      : Bodies(*step.model, patch.placements) {}
  /// `at`: where they are; it must live as long as this.
  Bodies(const Model<Dim>& model, const std::vector<Placement<Dim>>& at)
      : bodies_(model.rigid_bodies), at_(at), analysis_(model.analysis) {}
  std::size_t size() const { return bodies_.size(); }
  const RigidBody<Dim>& operator[](std::size_t k) const { return bodies_[k]; }
  bool any_moves() const {
    return std::any_of(bodies_.begin(), bodies_.end(), [](const RigidBody<Dim>& body) {
      return body.motion != RigidBody<Dim>::Motion::fixed;
    });
  }
  const Placement<Dim>& at(std::size_t k) const { return at_[k]; }
  typename Solid<Dim>::Nearest nearest(std::size_t k, const Vec<Dim>& x) const {
    const RigidBody<Dim>& body = bodies_[k];
    if (body.stays()) return body.solid->nearest(x);
    auto found = body.solid->nearest(in_body(k, x));
    found.normal = at_[k].axes * found.normal;
    return found;
  }
  /// Mass of a free body over the largest area by which it can be touched [kg/m^2].
  double mass_over_area(std::size_t k) const {
    const auto [low, high] = bodies_[k].solid->bounds();
    Vec<Dim> extent = high - low;
    std::sort(extent.data(), extent.data() + Dim);
    const double area = depth_at(analysis_, high[0]) * extent.template tail<Dim - 1>().prod();
    return bodies_[k].mass / area;
  }
  /// Whether x is certainly outside of body k by `distance` [m] or more.
  bool is_beyond(std::size_t k, const Vec<Dim>& x, double distance) const {
    const RigidBody<Dim>& body = bodies_[k];
    return body.solid->is_beyond(body.stays() ? x : in_body(k, x), distance);
  }

 private:
  Vec<Dim> in_body(std::size_t k, const Vec<Dim>& x) const {
    return bodies_[k].centre + at_[k].axes.transpose() * (x - at_[k].origin);
  }

  const std::vector<RigidBody<Dim>>& bodies_;
  const std::vector<Placement<Dim>>& at_;
  const Analysis& analysis_;
};

/// The middle of a local cell, and the radius of a ball around it [m].
template <int Dim>
std::pair<Vec<Dim>, double> ball_around(const Patch<Dim>& patch, Local cell) {
  const auto c = static_cast<std::size_t>(cell);
  Vec<Dim> middle = Vec<Dim>::Zero(), half;
  if (patch.cartesian) {
    for (std::size_t d = 0; d < Dim; ++d) {
      middle[static_cast<int>(d)] = patch.box[c][d];
      half[static_cast<int>(d)] = 1.0 / patch.box[c][Dim + d];
    }
    return {middle, half.norm()};
  }
  const std::span<const Local> nodes = patch.topology.element_nodes(c);
  const auto place = [&](Local node) {
    return Vec<Dim>(Eigen::Map<const Vec<Dim>>(patch.node_position.data() +
                                               static_cast<std::ptrdiff_t>(node) * node_width));
  };
  for (const Local node : nodes) middle += place(node) / static_cast<double>(nodes.size());
  double radius = 0;
  for (const Local node : nodes) radius = std::max(radius, (place(node) - middle).norm());
  return {middle, radius};
}

/// Whether any body may touch particles of a cell in this step or the next.
template <int Dim>
bool is_near(const Patch<Dim>& patch, Local cell, const Bodies<Dim>& bodies) {
  const auto [middle, radius] = ball_around(patch, cell);
  for (std::size_t k = 0; k < bodies.size(); ++k)
    if (bodies.nearest(k, middle).distance < near_radii * radius) return true;
  return false;
}

/// The same of a bin; found once for its cell.
template <int Dim>
bool is_near(Patch<Dim>& patch, const ParticleBin& bin, const Bodies<Dim>& bodies) {
  using Near = typename Patch<Dim>::Near;
  Near& near = patch.near_bodies[static_cast<std::size_t>(bin.cell)];
  if (near == Near::unknown) near = is_near(patch, bin.cell, bodies) ? Near::yes : Near::no;
  return near == Near::yes;
}

}  // namespace lahar
