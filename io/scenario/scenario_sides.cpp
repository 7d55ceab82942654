// Sides of the mesh that hold free rigid bodies: those all of whose nodes hold material.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"

namespace lahar {

namespace {

/// Which nodes of a side hold material, and how they rub.
struct HeldSide {
  std::vector<Index> nodes, rubbing;                          // of this member; ascending
  double friction = std::numeric_limits<double>::infinity();  // the least of `rubbing`
  bool moves = false;  // some of its nodes do, along any axis
};

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::find_sides() {
  if (!model_.analysis.free_bodies || !mesh_ || !mesh_->is_structured()) return;
  std::vector<Index> turned;  // nodes that have axes of their own
  for (const auto& frame : model_.node_frames) turned.push_back(frame.node);
  sort_unique(turned);
  const bool has_axis = get_text(section("analysis"), "plane") == "axisymmetric";
  const auto counts = mesh_->counts();
  Index nodes = 1, stride = 1;  // stride: of nodes along the axis
  for (const Index cells : counts) nodes *= cells + 1;
  for (int d = 0; d < Dim; ++d) {
    const Index cells = counts[static_cast<std::size_t>(d)];
    for (const bool last : {false, true}) {
      if (has_axis && d == 0 && !last) continue;  // the axis is no side
      const auto is_here = [&](Index node) {
        return node / stride % (cells + 1) == (last ? cells : 0) &&
               !std::binary_search(turned.begin(), turned.end(), node);
      };
      HeldSide side;
      for (const NodeVelocity& v : entries_of<NodeVelocity>(model_)) {
        if (!is_here(v.node)) continue;
        if (v.velocity != 0)
          side.moves = true;
        else if (v.dir == d)
          side.nodes.push_back(v.node);
      }
      for (const NodeAcceleration& a : entries_of<NodeAcceleration>(model_))
        if (a.acceleration != 0 && is_here(a.node)) {
          side.moves = true;
          if (a.dir == d) side.nodes.push_back(a.node);
        }
      for (const NodeFriction& wall : entries_of<NodeFriction>(model_)) {
        if (wall.normal != d || wall.outward != (last ? 1 : -1) || !is_here(wall.node)) continue;
        if (!wall.two_sided) side.nodes.push_back(wall.node);  // else constraints hold
        side.rubbing.push_back(wall.node);
        side.friction = std::min(side.friction, wall.friction);
      }
      sort_unique(side.nodes);
      sort_unique(side.rubbing);
      const Index all = nodes / (cells + 1);
      if (team_.sum(static_cast<Index>(side.nodes.size())) != all) continue;
      const bool rubs = team_.sum(static_cast<Index>(side.rubbing.size())) == all;
      const double friction = -team_.most({-side.friction}).front();
      const bool moves = team_.any(side.moves);
      RigidBody<Dim> wall;
      const Vec<Dim> corner = mesh_->node(last ? nodes - 1 : 0);
      wall.name = fmt::format("{} = {:g}", "xyz"[d], corner[d]);
      const Vec<Dim> inwards = (last ? -1 : 1) * Vec<Dim>::Unit(d);
      wall.solid = half_space<Dim>(corner, inwards);
      if (moves) {
        warn_of_moving_side(wall);
        continue;
      }
      warn_of_bodies_behind(wall);
      wall.friction = rubs ? friction : 0;
      model_.sides.push_back(std::move(wall));
    }
    stride *= cells + 1;
  }
}

/// What holds material and moves holds no free bodies, as it is not known how it moves them.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_moving_side(const RigidBody<Dim>& side) {
  const auto entries = get_list(root_, "rigid_bodies");
  const auto& bodies = model_.rigid_bodies;
  for (std::size_t k = 0; k < std::min(entries.size(), bodies.size()); ++k)
    if (bodies[k].motion == RigidBody<Dim>::Motion::free) {
      in_.warning(*entries[k],
                  fmt::format("the side {} moves as its nodes do, and does not hold the free rigid "
                              "body '{}'",
                              side.name, bodies[k].name),
                  "what carries it has to be a rigid body with that velocity");
      return;
    }
}

/// A body holds on to sides that it lies in front of.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_bodies_behind(const RigidBody<Dim>& side) {
  constexpr double share_of_size = 0.05;  // as bodies may be in each other
  if (!in_.stage.empty()) return;         // they are where the stage before brought them
  const auto entries = get_list(root_, "rigid_bodies");
  const auto& bodies = model_.rigid_bodies;
  for (std::size_t k = 0; k < std::min(entries.size(), bodies.size()); ++k) {
    if (bodies[k].motion != RigidBody<Dim>::Motion::free) continue;
    const auto [low, high] = bodies[k].solid->bounds();
    double behind = 0, before = 0;  // [m] of the corners of its box
    for (const Vec<Dim>& corner : {low, high}) {
      const double distance = side.solid->nearest(corner).distance;
      behind = std::max(behind, -distance);
      before = std::max(before, distance);
    }
    if (before > 0 && behind > share_of_size * (high - low).maxCoeff())
      in_.warning(*entries[k],
                  fmt::format("the rigid body '{}' begins {:.3g} m behind the side {} of the mesh, "
                              "which therefore does not hold it",
                              bodies[k].name, behind, side.name),
                  "let it begin in front of this side");
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
