#include "runtime/patches/patch_constraints.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace lahar {

namespace {

void sort_by_node(auto& entries) {
  std::stable_sort(entries.begin(), entries.end(),
                   [](const auto& a, const auto& b) { return a.node < b.node; });
}

template <int Dim>
using TimedList = typename Patch<Dim>::TimedVelocity::List;

template <int Dim>
void note_function(Patch<Dim>& patch, TimedList<Dim> list, std::size_t entry,
                   const NodeVelocity& v) {
  if (v.function >= 0) patch.timed.push_back({list, entry, v.dir, v.velocity, v.function});
}

template <int Dim>
void fix(Patch<Dim>& patch, TimedList<Dim> list, Local local, const NodeVelocity& v) {
  auto& entries = list == TimedList<Dim>::fixed ? patch.fixed : patch.fixed_liquid;
  note_function(patch, list, entries.size(), v);
  entries.push_back({local, v.dir, v.velocity});
}

/// The first of several velocities for a node and direction counts, and the last friction.
template <int Dim>
void constrain(Patch<Dim>& patch, Local local, Index node, const NodeConditions<Dim>& conditions) {
  const auto velocities = entries_at(entries_of<NodeVelocity>(conditions), node);
  const auto frames = entries_at(conditions.node_frames, node);
  const auto frictions = entries_at(entries_of<NodeFriction>(conditions), node);
  const auto accelerations = entries_at(entries_of<NodeAcceleration>(conditions), node);
  if (frictions.empty() && accelerations.empty() && (frames.empty() || velocities.empty())) {
    bool taken[Dim] = {};
    for (const NodeVelocity& v : velocities)
      if (!std::exchange(taken[v.dir], true)) fix(patch, TimedList<Dim>::fixed, local, v);
    return;
  }
  ConstrainedNode<Dim>& wall = patch.walls.emplace_back();
  wall.node = local;
  if (!frames.empty()) wall.axes = frames.front().axes;
  for (const NodeVelocity& v : velocities)
    if (const auto d = static_cast<std::size_t>(v.dir); !std::exchange(wall.fixed[d], true)) {
      wall.velocity[d] = v.velocity;
      note_function(patch, TimedList<Dim>::walls, patch.walls.size() - 1, v);
    }
  for (const NodeAcceleration& a : accelerations) {
    const auto d = static_cast<std::size_t>(a.dir);
    wall.accelerated[d] = true;
    wall.acceleration[d] = a.acceleration;
    wall.function[d] = a.function;
  }
  for (const NodeFriction& friction : frictions) {
    if (!friction.two_sided) {
      const auto d = static_cast<std::size_t>(friction.normal);
      wall.fixed[d] = false;
      wall.pushes[d] = friction.outward;
      wall.rubs[d] = friction.friction;
      continue;
    }
    wall.normal = friction.normal;
    wall.outward = friction.outward;
    wall.friction = friction.friction;
  }
}

/// The first of several displacements for a node and direction counts.
template <int Dim>
void fix_displacements(Patch<Dim>& patch, Local local, std::span<const NodeDisplacement> entries) {
  for (int d = 0; d < Dim; ++d) {
    const auto first = std::find_if(entries.begin(), entries.end(),
                                    [&](const NodeDisplacement& u) { return u.dir == d; });
    if (first != entries.end())
      patch.fixed_displacement.push_back({local, d, first->displacement, first->function});
  }
}

/// Mark the cells that have functions at nodes whose conditions take means of particles.
template <int Dim>
void mark_cells_of_means(Patch<Dim>& patch) {
  std::vector<char> takes(patch.topology.nodes.size(), 0);
  for_each_acting_list(patch.acting, [&]<class T>(const std::vector<ActingNode<Dim, T>>& list) {
    if (takes_means<T>)
      for (const auto& at : list) takes[static_cast<std::size_t>(at.node)] = 1;
  });
  if (std::find(takes.begin(), takes.end(), 1) == takes.end()) return;
  const auto any = [&](std::span<const Local> nodes) {
    return std::any_of(nodes.begin(), nodes.end(),
                       [&](Local i) { return takes[static_cast<std::size_t>(i)] != 0; });
  };
  const std::size_t cells = patch.topology.cells.size();
  patch.cells_of_means.assign(cells, 0);
  for (std::size_t c = 0; c < cells; ++c)
    patch.cells_of_means[c] =
        (!patch.topology.corner_nodes.empty() && any(patch.topology.corner_nodes[c])) ||
        any(patch.topology.support(c));
}

}  // namespace

template <int Dim>
void sort_constraints(NodeConditions<Dim>& conditions) {
  for_each_list(conditions, [](auto& list) { sort_by_node(list); });
}

template <int Dim>
void set_bodies(Patch<Dim>& patch, const Model<Dim>& model) {
  const int bodies = model.analysis.contact.bodies;
  if (bodies == 1) return;
  patch.body_nodes = patch.n_nodes() / bodies;
  const auto cells = static_cast<Local>(patch.topology.cells.size()) / bodies;
  for (const Material& material : model.materials) patch.body_cell.push_back(material.body * cells);
}

template <int Dim>
void set_constraints(Patch<Dim>& patch, const NodeConditions<Dim>& conditions, Index n_nodes) {
  const auto& nodes = patch.topology.nodes;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto local = static_cast<Local>(i);
    const Index node = nodes[i] % n_nodes;  // the same for every body
    constrain(patch, local, node, conditions);
    fix_displacements(patch, local, entries_at(entries_of<NodeDisplacement>(conditions), node));
    bool taken[Dim] = {};  // the first counts
    for (const NodeVelocity& v : entries_at(conditions.liquid_velocities, node))
      if (!std::exchange(taken[v.dir], true)) fix(patch, TimedList<Dim>::fixed_liquid, local, v);
    if (const auto given = entries_at(entries_of<NodePressure>(conditions), node); !given.empty()) {
      const NodePressure& first = given.front();
      patch.fixed_pressure.push_back({local, first.pressure, first.function, first.inside});
    }
    for (const NodeForce& f : entries_at(entries_of<NodeForce>(conditions), node))
      patch.forces.push_back({local, f.dir, f.force, f.function});
    for_each_acting_list(patch.acting, [&]<class T>(std::vector<ActingNode<Dim, T>>& list) {
      for (const T& entry : entries_at(entries_of<T>(conditions), node))
        list.push_back({.node = local, .condition = entry});
    });
  }
  mark_cells_of_means(patch);
}

template void sort_constraints(NodeConditions<2>&);
template void sort_constraints(NodeConditions<3>&);
template void set_bodies(Patch<2>&, const Model<2>&);
template void set_bodies(Patch<3>&, const Model<3>&);
template void set_constraints(Patch<2>&, const NodeConditions<2>&, Index);
template void set_constraints(Patch<3>&, const NodeConditions<3>&, Index);

}  // namespace lahar
