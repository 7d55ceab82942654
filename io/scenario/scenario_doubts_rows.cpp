// Warnings of single rows of nodes within the material that do not do what they are meant for:
// supports that smooth functions reach past.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>

#include "io/scenario/scenario_builder.h"
#include "physics/base/directory_rank.h"
#include "physics/base/sort_unique.h"

namespace lahar {

namespace {

/// Whether entries that combine() has sorted have one of this node and direction.
template <class T>
bool has_place(const std::vector<T>& entries, std::pair<Index, int> place) {
  const auto at =
      std::lower_bound(entries.begin(), entries.end(), place,
                       [](const T& entry, const auto& key) { return place_of(entry) < key; });
  return at != entries.end() && place_of(*at) == place;
}

}  // namespace

// Places are node * Dim + axis.
template <int Dim>
std::vector<Index> ScenarioBuilder<Dim>::thin_rows(
    const std::vector<Index>& places, const std::function<bool(Index)>& is_in_row) const {
  const auto counts = mesh_->counts();
  const auto keeper = [&](Index place) { return directory_rank(place / Dim, team_.size()); };
  std::vector<Index> inside, neighbours;
  for (const Index place : places) {
    Index stride = 1;  // of nodes along the axis
    const auto axis = static_cast<std::size_t>(place % Dim);
    for (std::size_t d = 0; d < axis; ++d) stride *= counts[d] + 1;
    const Index at = place / Dim / stride % (counts[axis] + 1);
    if (at == 0 || at == counts[axis]) continue;
    const std::array<Index, 2> beside{place - stride * Dim, place + stride * Dim};
    if (std::any_of(beside.begin(), beside.end(), [&](Index other) {
          return keeper(other) == team_.index() && is_in_row(other);
        }))
      continue;
    inside.push_back(place);
    neighbours.insert(neighbours.end(), beside.begin(), beside.end());
  }
  const auto known = ask<char>(team_, neighbours, keeper,
                               [&](Index place) { return static_cast<char>(is_in_row(place)); });
  std::vector<Index> thin;
  for (std::size_t i = 0; i < inside.size(); ++i)
    if (!known[2 * i] && !known[2 * i + 1]) thin.push_back(inside[i]);
  return thin;
}

template <int Dim>
std::vector<Index> ScenarioBuilder<Dim>::rows_in_material(const std::vector<Index>& thin) const {
  std::vector<Index> nodes = joined(team_.gather(thin));
  for (Index& place : nodes) place /= Dim;
  sort_unique(nodes);
  if (nodes.empty()) return {};
  std::vector<unsigned> around(nodes.size(), 0);  // a bit for each cell that has particles
  Index last = -1;
  for (const Index cell : model_.particles.cell) {
    if (cell < 0 || cell == last) continue;
    last = cell;
    const auto corners = mesh_->cell_nodes(cell);
    for (std::size_t a = 0; a < corners.size(); ++a) {
      const auto at = std::lower_bound(nodes.begin(), nodes.end(), corners[a]);
      if (at != nodes.end() && *at == corners[a])
        around[static_cast<std::size_t>(at - nodes.begin())] |= 1u << a;
    }
  }
  for (const auto& part : team_.gather(around))
    for (std::size_t k = 0; k < around.size(); ++k) around[k] |= part[k];
  std::vector<Index> found;
  for (const Index place : thin) {
    const auto at = std::lower_bound(nodes.begin(), nodes.end(), place / Dim);
    if (around[static_cast<std::size_t>(at - nodes.begin())] != 0) found.push_back(place);
  }
  std::sort(found.begin(), found.end());
  return found;
}

// A row of nodes that are held does not bound material with smooth functions: those of the nodes
// behind the row are not zero in front of it.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_thin_supports() {
  constexpr double least = 0.02;  // of the nodes of an entry; less are the tips of terrain
  const ShapeFunctions functions = model_.analysis.functions;
  if (in_.cbgeo_defaults || !mesh_->is_structured() || !mesh_->is_multilinear() ||
      (functions != ShapeFunctions::quadratic_spline && functions != ShapeFunctions::cubic_spline))
    return;
  if (team_.any(!model_.node_frames.empty())) return;
  std::vector<Index> walls, places;
  const auto add = [](const auto& entries, std::vector<Index>& to) {
    for (const auto& entry : entries) to.push_back(entry.node * Dim + place_of(entry).second);
  };
  add(entries_of<NodeFriction>(model_), walls);
  sort_unique(walls);
  places = walls;
  add(entries_of<NodeVelocity>(model_), places);
  add(entries_of<NodeAcceleration>(model_), places);
  add(entries_of<NodeDisplacement>(model_), places);
  sort_unique(places);
  const auto thin = rows_in_material(thin_rows(places, [&](Index place) {
    const std::pair at(place / Dim, static_cast<int>(place % Dim));
    return has_place(entries_of<NodeVelocity>(model_), at) ||
           has_place(entries_of<NodeAcceleration>(model_), at) ||
           has_place(entries_of<NodeDisplacement>(model_), at) ||
           std::binary_search(walls.begin(), walls.end(), place);
  }));
  if (!team_.any(!thin.empty())) return;
  const auto warn = [&](const JsonValue& entry, int axis, const std::vector<Index>& nodes) {
    Index count = 0;
    double low = infinity, high = -infinity;
    for (const Index node : nodes) {
      if (!std::binary_search(thin.begin(), thin.end(), node * Dim + axis)) continue;
      const double at = mesh_->node(node)[axis];
      low = std::min(low, at);
      high = std::max(high, at);
      ++count;
    }
    count = team_.sum(count);
    const auto all = static_cast<double>(team_.sum(static_cast<Index>(nodes.size())));
    const auto ends = team_.most({-low, high});
    if (count == 0 || static_cast<double>(count) < least * all) return;
    const std::string to = -ends[0] < ends[1] ? fmt::format(" to {:g}", ends[1]) : "";
    in_.warning(entry,
                fmt::format("{} nodes, at {} = {:g}{}, do not hold material along {}: they are one "
                            "row inside of the mesh, and functions of the free nodes behind it "
                            "reach the material, too",
                            count, "xyz"[axis], 0.0 - ends[0], to, "xyz"[axis]),
                "hold all nodes behind it as well (a half space or a box in place of a plane), let "
                "the mesh end there, or take \"shape_functions\": \"element\"");
  };
  for (const std::string_view key :
       {NodeVelocity::key, NodeAcceleration::key, NodeDisplacement::key})
    for (const JsonValue* entry : get_list(boundary(), key)) {
      const auto dir = get_direction(*entry, "dir");
      const JsonValue* set = in_.either(*entry, "nset_id", "nset");
      if (!dir || *dir >= Dim || !set || get_text(*entry, "phase") == "liquid") continue;
      if (set->is_number() && set->number() == -1) continue;  // all nodes are no row
      if (const auto* nodes = sets_.nodes.find(*set, in_)) warn(*entry, *dir, *nodes);
    }
  for (const FrictionEntry& e : friction_entries_) {
    std::array<std::vector<Index>, static_cast<std::size_t>(Dim)> nodes;
    for (std::size_t i = e.first; i < e.end; ++i) {
      const NodeFriction& wall = entries_of<NodeFriction>(model_)[i];
      nodes[static_cast<std::size_t>(wall.normal)].push_back(wall.node);
    }
    for (int axis = 0; axis < Dim; ++axis)
      warn(*e.entry, axis, nodes[static_cast<std::size_t>(axis)]);
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
