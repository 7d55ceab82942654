// The mesh and the sets of its nodes and cells.
#include <fmt/format.h>

#include <cmath>

#include "io/base/text.h"
#include "io/scenario/scenario_builder.h"
#include "physics/base/directory_rank.h"
#include "physics/mesh/element_grid.h"

namespace lahar {

namespace {

// Nodes on the boundary of a region are inside: coordinates are sums of a few doubles, so their
// rounding is far below this fraction of a cell, and no cell has a node this close to another [-].
constexpr double region_tolerance = 1e-9;

// A count computed as extent / cell size may miss the whole number by rounding [-].
constexpr double count_tolerance = 1e-6;

// The largest 'counts' (keys_mesh.cpp): positions along an axis stay exact.
constexpr double most_cells_of_axis = 2e9;

// Beyond this, going once through the nodes of a mesh takes minutes.
constexpr double most_grid_nodes = 1e10;

// A mesh that is stored takes some 200 bytes per node.
constexpr double most_stored_nodes = 1e9;

// The element that the mesh names; one of the other dimension has been reported.
template <int Dim>
Element element_of(const JsonValue& mesh) {
  const auto named = element_named(get_text(mesh, "cell_type").value_or(""));
  return named && info(*named).dim == Dim ? *named : multilinear<Dim>;
}

/// What would fit where an extent [m] is not a whole number of cells.
std::string nearest_sizes(double extent, double cell, char axis) {
  const double fewer = std::floor(extent / cell), more = fewer + 1;
  const auto either = [&](double a, double b) {
    return fewer > 0 ? fmt::format("{:.6g} or {:.6g}", a, b) : fmt::format("{:.6g}", b);
  };
  return fmt::format("along {} the extent may be {}, or the cell size {}", axis,
                     either(fewer * cell, more * cell), either(extent / fewer, extent / more));
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_mesh() {
  const JsonValue* mesh = root_.find("mesh");
  if (!mesh) return;
  const JsonValue* structured = mesh->find("structured");
  const JsonValue* file = mesh->find("mesh");
  if (structured && file)
    in_.error(*structured, "'structured' and 'mesh' are two meshes; give one of them");
  else if (structured)
    build_structured_mesh(*mesh, *structured);
  else if (file)
    build_table_mesh(*mesh);
  else if (in_.problems.empty())
    in_.error(*mesh, "there is no mesh",
              "give a mesh file (\"mesh\": \"mesh.txt\") or a grid (\"structured\": {...})");
  if (const JsonValue* nonlocal = mesh->find("nonlocal_mesh_properties"))
    in_.warning(*nonlocal, "'nonlocal_mesh_properties' has no effect",
                "where splines end follows from the mesh");
  mesh_ = model_.mesh;
  if (mesh_) check_second_order(*mesh);
  if (mesh_) region_tolerance_ = region_tolerance * smallest_cell(*mesh_, team_);
}

/// Lagrange's functions of second order are negative in parts; the integral of a corner's function
/// over a cell is zero (T6) or negative (Q8, H20). T6, Q9 and H27 have positive functions in their
/// place, the serendipity elements have none that reproduce linear fields on curved cells.
template <int Dim>
void ScenarioBuilder<Dim>::check_second_order(const JsonValue& mesh) {
  const Element element = mesh_->element();
  if (info(element).order < 2) return;
  const auto name = info(element).name;
  const auto better = element == Element::Q8 ? "ED2Q9" : element == Element::H20 ? "ED3H27" : "";
  model_.analysis.lagrange_functions = in_.cbgeo_defaults;
  if (!in_.cbgeo_defaults) {
    if (*better)
      in_.error(
          *mesh.find("cell_type"),
          fmt::format("cells of {} are for input of CB-Geo MPM only: corner nodes have masses "
                      "below zero, with which bodies that move gain energy",
                      name),
          fmt::format("take {}, quadratic splines on a structured mesh (analysis."
                      "shape_functions), or \"preset\": \"cbgeo\" in analysis",
                      better));
    return;
  }
  const bool corners = *better || element == Element::T6;
  in_.warning(
      *mesh.find("cell_type"),
      corners ? fmt::format("corner nodes of {} have masses of zero or below, with which "
                            "waves in a solid grow instead of passing",
                            name)
              : fmt::format("nodes of {} have masses near zero or below, with which bodies "
                            "that move through cells gain energy",
                            name),
      *better ? fmt::format("{} with \"preset\": \"lahar\" in analysis has no such nodes", better)
              : "with \"preset\": \"lahar\" in analysis there are no such nodes");
}

template <int Dim>
void ScenarioBuilder<Dim>::build_structured_mesh(const JsonValue& mesh, const JsonValue& s) {
  const auto origin = get_vector<Dim>(s, "origin");
  const auto extent = get_vector<Dim>(s, "extent"), counts = get_vector<Dim>(s, "counts");
  auto cell = get_vector<Dim>(s, "cell_size");
  if (const auto same = get_number(s, "cell_size")) cell = Vec<Dim>::Constant(*same);
  const int given = (extent ? 1 : 0) + (counts ? 1 : 0) + (cell ? 1 : 0);
  if (given != 2) {
    // A key that is there but invalid has been reported.
    int written = 0;
    for (const auto& m : s.template as<JsonValue::Object>())
      written += m.key == "extent" || m.key == "counts" || m.key == "cell_size";
    if (written == given)
      in_.error(s, fmt::format("a structured mesh needs two of 'cell_size', 'extent' and "
                               "'counts', found {}",
                               given));
    return;
  }
  std::array<Index, Dim> n{};
  for (int d = 0; d < Dim; ++d) {
    const double exact = counts ? (*counts)[d] : (*extent)[d] / (*cell)[d];
    if (!(exact <= most_cells_of_axis))
      return in_.error(*s.find("extent"),
                       fmt::format("the extent {} is {:.4g} cells of size {} along {}; at most "
                                   "{:.0e} are possible",
                                   (*extent)[d], exact, (*cell)[d], "xyz"[d], most_cells_of_axis),
                       "take larger cells or a smaller extent; both are in metres");
    n[static_cast<std::size_t>(d)] = std::llround(exact);
    if (!counts && (exact < 0.5 || std::abs(exact - std::round(exact)) > count_tolerance * exact))
      return in_.error(*s.find("extent"),
                       fmt::format("the extent {} is not a whole number of cells of size {}",
                                   (*extent)[d], (*cell)[d]),
                       nearest_sizes((*extent)[d], (*cell)[d], "xyz"[d]));
  }
  if (!cell) cell = extent->cwiseQuotient(*counts);
  const Element element = element_of<Dim>(mesh);
  double total = 1;
  for (const Index c : n) total *= static_cast<double>(c) * info(element).order + 1;
  const double most = element == multilinear<Dim> ? most_grid_nodes : most_stored_nodes;
  if (total > most)
    return in_.error(s, fmt::format("a mesh of {:.4g} nodes is too large; at most {:.0e} are "
                                    "possible",
                                    total, most));
  if (!origin) return;
  if (element != multilinear<Dim>) need_memory_of_grid(s, element, n);
  try {
    if (element == multilinear<Dim>) {
      model_.mesh = std::make_shared<const Mesh<Dim>>(Mesh<Dim>::structured(*origin, *cell, n));
    } else {
      make_grid(element, *origin, *cell, n);
    }
  } catch (const InputError& e) {
    in_.error(s, e.what());
  }
}

/// A grid whose cells are stored.
template <int Dim>
void ScenarioBuilder<Dim>::need_memory_of_grid(const JsonValue& at, Element element,
                                               const std::array<Index, Dim>& counts) {
  // Tables as they are made, kept, and turned into what searches and neighbours need, at least.
  constexpr double copies = 3;
  const ElementGrid<Dim> grid(element, counts);
  const auto nodes = static_cast<double>(grid.n_nodes), cells = static_cast<double>(grid.n_cells);
  const double row = sizeof(Index) * static_cast<double>(info(element).nodes);
  const std::string what =
      fmt::format("a mesh of {} nodes and {} cells of {}", format_count(grid.n_nodes),
                  format_count(grid.n_cells), info(element).name);
  phase(what);
  need_memory(at, copies * (nodes * sizeof(Vec<Dim>) + cells * row) / team_.size(), what);
}

/// The nodes of a region that this member keeps (directory_rank()), ascending. Collective.
template <int Dim>
std::vector<Index> ScenarioBuilder<Dim>::nodes_in(const Region<Dim>& region, const JsonValue& at) {
  std::vector<Index> ids;
  if (!mesh_->is_share()) {
    all_or_none(team_, [&] {
      for_nodes_near<Dim>(*mesh_, region, [&](Index i) {
        if (directory_rank(i, team_.size()) == team_.index() && region.contains(mesh_->node(i)))
          add_member(ids, i, at);
      });
    });
    need_memory(at, member_bytes * static_cast<double>(ids.size()), "sets of nodes");
    return ids;
  }
  std::vector<std::vector<Index>> to(static_cast<std::size_t>(team_.size()));
  Index node = team_.part(n_nodes(), team_.index());
  for (const Vec<Dim>& x : own_nodes_) {
    if (region.contains(x))
      to[static_cast<std::size_t>(directory_rank(node, team_.size()))].push_back(node);
    ++node;
  }
  return joined(team_.exchange(std::move(to)));
}

template <int Dim>
void ScenarioBuilder<Dim>::add_member(std::vector<Index>& ids, Index id, const JsonValue& set) {
  constexpr std::size_t often = std::size_t{1} << 20;
  ids.push_back(id);
  if (ids.size() % often != 0) return;
  const auto bytes = member_bytes * static_cast<double>(ids.size());
  if (memory_ + bytes > in_.memory.bytes)
    refuse_memory(set, memory_ + bytes,
                  fmt::format("sets, one with more than {} members",
                              format_count(static_cast<Index>(ids.size()))));
}

template <int Dim>
void ScenarioBuilder<Dim>::build_sets() {
  phase("sets");
  sets_ = read_entity_sets(section("mesh"), n_nodes(), n_cells(), in_);
  add_element_sets();
  const JsonValue& sets = section("sets");
  const auto each = [&](const char* key, EntitySets& out, auto&& members) {
    if (!mesh_) out.all_known = false;
    const JsonValue* regions = sets.find(key);
    if (!regions) return;
    for (const auto& [name, offset, value] : regions->template as<JsonValue::Object>()) {
      const Region<Dim> region = region_of(value);
      if (out.by_name.contains(name))
        in_.error(value, fmt::format("the mesh file has a {} set '{}', too", out.kind, name),
                  "give one of them another name");
      auto& ids = out.by_name[name];
      if (mesh_) ids = members(region, value);
      if (mesh_ && !team_.any(!ids.empty()) && value.valid())
        in_.warning(value, fmt::format("the {} set '{}' is empty", out.kind, name));
    }
  };
  each("nodes", sets_.nodes,
       [&](const Region<Dim>& region, const JsonValue& at) { return nodes_in(region, at); });
  each("cells", sets_.cells, [&](const Region<Dim>& region, const JsonValue& at) {
    std::vector<Index> ids;
    const CellsNear<Dim> near(*mesh_, region);
    all_or_none(team_, [&] {
      near.visit(team_.part(near.size(), team_.index()), team_.part(near.size(), team_.index() + 1),
                 [&](Index i) {
                   if (region.contains(mesh_->cell_centre(i))) add_member(ids, i, at);
                 });
    });
    need_memory(at, member_bytes * static_cast<double>(ids.size()), "sets of cells");
    return spread_evenly(std::move(ids), team_);
  });
  find_axis();
  // Warnings of walls ask where their nodes are, and areas of absorbing boundaries.
  if (!boundary().find("walls") && !boundary().find("friction_constraints") &&
      !boundary().find(NodeAbsorption::key))
    own_nodes_ = {};
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
