// Sides of the mesh that hold free rigid bodies: those all of whose nodes hold material.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"

namespace lahar {

namespace {

/// How many nodes of a side hold material, and how they rub.
struct HeldSide {
  std::vector<Index> nodes, rubbing;                          // of this member; ascending
  double friction = std::numeric_limits<double>::infinity();  // the least of `rubbing`
};

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::find_sides() {
  if (!model_.analysis.free_bodies || !mesh_ || !mesh_->is_structured()) return;
  std::vector<Index> turned;  // nodes that have axes of their own
  for (const auto& frame : model_.node_frames) turned.push_back(frame.node);
  sort_unique(turned);
  const auto counts = mesh_->counts();
  Index nodes = 1, stride = 1;  // stride: of nodes along the axis
  for (const Index cells : counts) nodes *= cells + 1;
  for (int d = 0; d < Dim; ++d) {
    const Index cells = counts[static_cast<std::size_t>(d)];
    for (const bool last : {false, true}) {
      const auto is_here = [&](Index node) {
        return node / stride % (cells + 1) == (last ? cells : 0) &&
               !std::binary_search(turned.begin(), turned.end(), node);
      };
      HeldSide side;
      for (const NodeVelocity& v : entries_of<NodeVelocity>(model_))
        if (v.dir == d && v.velocity == 0 && is_here(v.node)) side.nodes.push_back(v.node);
      for (const NodeFriction& wall : entries_of<NodeFriction>(model_)) {
        if (wall.normal != d || wall.outward != (last ? 1 : -1) || !is_here(wall.node)) continue;
        side.nodes.push_back(wall.node);
        side.rubbing.push_back(wall.node);
        side.friction = std::min(side.friction, wall.friction);
      }
      sort_unique(side.nodes);
      sort_unique(side.rubbing);
      const Index all = nodes / (cells + 1);
      if (team_.sum(static_cast<Index>(side.nodes.size())) != all) continue;
      const bool rubs = team_.sum(static_cast<Index>(side.rubbing.size())) == all;
      const double friction = -team_.most({-side.friction}).front();
      RigidBody<Dim> wall;
      const Vec<Dim> corner = mesh_->node(last ? nodes - 1 : 0);
      wall.name = fmt::format("{} = {:g}", "xyz"[d], corner[d]);
      const Vec<Dim> inwards = (last ? -1 : 1) * Vec<Dim>::Unit(d);
      wall.solid = half_space<Dim>(corner, inwards);
      wall.friction = rubs ? friction : 0;
      model_.sides.push_back(std::move(wall));
    }
    stride *= cells + 1;
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
