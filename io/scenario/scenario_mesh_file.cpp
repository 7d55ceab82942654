// A mesh from a file: as a whole by one process, in shares by a team.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>

#include "io/base/file_part.h"
#include "io/mesh/mesh_file.h"
#include "io/mesh/mesh_ring.h"
#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"
#include "physics/mesh/element_grid.h"

namespace lahar {

namespace {

// Nodes at one place; -1 = none.
using Pair = std::pair<Index, Index>;

void warn_of_coincident_nodes(const SideFile& file, const Pair& pair, ProblemList& problems) {
  const auto [a, b] = pair;
  if (a >= 0)
    problems.warning(file.at_line(file.line_of_row(b + 1),
                                  fmt::format("nodes {} and {} are at the same place", a, b),
                                  "cells that should be neighbours may not be connected"));
}

// What is wrong with the mesh, with the lines of cells in its file: "cell 12 is inverted".
void report_mesh(const SideFile& file, Index n_nodes, Index n_cells, const InputError& error,
                 ProblemList& problems) {
  for (const Problem& p : error.problems()) {
    Index cell = n_cells;
    constexpr std::string_view word = "cell ";
    if (p.message.compare(0, word.size(), word) == 0)
      std::from_chars(p.message.data() + word.size(), p.message.data() + p.message.size(), cell);
    const int line = cell < n_cells ? file.line_of_row(n_nodes + cell + 1) : 0;
    problems.error(file.at_line(line, p.message, p.hint));
  }
}

}  // namespace

template <int Dim>
TableMeshKeys ScenarioBuilder<Dim>::table_mesh_keys(const JsonValue& mesh) const {
  const std::string type = get_text(mesh, "cell_type").value_or("");
  const auto named = element_named(type);
  TableMeshKeys keys;
  keys.element = named && info(*named).dim == Dim ? *named : multilinear<Dim>;
  keys.has_ring = type.ends_with("G");
  keys.isoparametric =
      !keys.has_ring && !type.ends_with("P2B") && get_bool(mesh, "isoparametric").value_or(true);
  keys.check_duplicates = get_bool(mesh, "check_duplicates").value_or(true);
  return keys;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_table_mesh(const JsonValue& mesh) {
  const auto file = in_.open(mesh, "mesh");
  if (!file) return;
  if (is_element_file(*file)) return build_element_mesh(mesh, *file);
  const TableMeshKeys keys = table_mesh_keys(mesh);
  if (team_.alone()) {
    if (auto whole = read_whole_mesh(*file, keys, in_.problems))
      model_.mesh = std::make_shared<const Mesh<Dim>>(std::move(*whole));
  } else if (!read_shares(*file, keys)) {
    explain(*file, team_, in_.problems,
            [&](ProblemList& problems) { read_whole_mesh(*file, keys, problems); });
  }
}

/// All of a mesh, by this process.
template <int Dim>
std::optional<Mesh<Dim>> ScenarioBuilder<Dim>::read_whole_mesh(const SideFile& file,
                                                               const TableMeshKeys& keys,
                                                               ProblemList& problems) {
  const int per_cell = info(keys.element).nodes;
  auto tables = read_mesh_file<Dim>(file, per_cell, problems, keys.has_ring ? ring_nodes<Dim> : 0);
  if (!tables) return std::nullopt;
  if (keys.check_duplicates)
    warn_of_coincident_nodes(file, find_coincident<Dim>(tables->nodes), problems);
  const auto n_nodes = static_cast<Index>(tables->nodes.size());
  const auto n_cells = static_cast<Index>(tables->cells.size()) / per_cell;
  if (keys.has_ring) {
    listed_cells_ = n_cells;
    const std::string wrong = add_ring_cells(*tables);
    if (!wrong.empty()) {
      problems.error(in_.document.at(
          *section("mesh").find("cell_type"), wrong,
          "the nodes of a GIMP cell are its corners and all around it, one cell away"));
      return std::nullopt;
    }
  }
  try {
    return Mesh<Dim>::from_tables(std::move(tables->nodes), keys.element, tables->cells,
                                  keys.isoparametric);
  } catch (const InputError& error) {
    report_mesh(file, n_nodes, n_cells, error, problems);
    return std::nullopt;
  }
}

/// A grid of another element than Q4 and H8. Throws InputError.
template <int Dim>
void ScenarioBuilder<Dim>::make_grid(Element element, const Vec<Dim>& origin, const Vec<Dim>& cell,
                                     const std::array<Index, Dim>& counts) {
  const ElementGrid<Dim> grid(element, counts);
  constexpr Index most = std::numeric_limits<Local>::max();
  if (grid.n_nodes > most || grid.n_cells > most)
    throw InputError(fmt::format("{} nodes and {} cells: at most {} of each can come from a table",
                                 grid.n_nodes, grid.n_cells, most));
  if (team_.alone()) {
    const auto tables = element_grid<Dim>(element, origin, cell, counts);
    model_.mesh = std::make_shared<const Mesh<Dim>>(
        Mesh<Dim>::from_tables(tables.nodes, element, tables.cells, true));
    return;
  }
  auto tables =
      element_grid_part<Dim>(element, origin, cell, counts, own_cells(grid.n_nodes, team_),
                             own_cells(grid.n_cells, team_));
  MeshRows<Dim> rows{grid.n_nodes, grid.n_cells, std::move(tables.nodes), {}};
  rows.cell_nodes.assign(tables.cells.begin(), tables.cells.end());
  model_.mesh = std::make_shared<const Mesh<Dim>>(make_share(rows, element, true, team_));
  own_nodes_ = std::move(rows.nodes);
}

/// Shares of a mesh; false, on all members, if anything is wrong with it.
template <int Dim>
bool ScenarioBuilder<Dim>::read_shares(const SideFile& file, const TableMeshKeys& keys) {
  auto rows = read_mesh_rows<Dim>(
      file, info(keys.element).nodes + (keys.has_ring ? ring_nodes<Dim> : 0), team_, in_.problems);
  if (!rows) return false;
  if (keys.has_ring) {
    listed_cells_ = rows->n_cells;
    if (!add_ring_cells(*rows, team_)) return false;
  }
  try {
    auto share = std::make_shared<const Mesh<Dim>>(
        make_share(*rows, keys.element, keys.isoparametric, team_));
    search_.emplace(*share, team_);
    model_.mesh = std::move(share);
  } catch (const InputError&) {
    return false;  // ids of cells in it are not those of the file
  }
  own_nodes_ = std::move(rows->nodes);
  if (keys.check_duplicates) {
    RowShares shares;
    shares.append(static_cast<Index>(own_nodes_.size()), team_);
    warn_of_coincident_nodes(file, find_coincident<Dim>(own_nodes_, shares, team_), in_.problems);
  }
  return true;
}

/// Of a mesh whose nodes have no lines. `nodes`: all of them, if this member is alone.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_coincident(const SideFile& file,
                                              const std::vector<Vec<Dim>>& nodes) {
  Pair pair{-1, -1};
  if (team_.alone()) {
    pair = find_coincident<Dim>(nodes);
  } else {
    RowShares shares;
    shares.append(static_cast<Index>(own_nodes_.size()), team_);
    pair = find_coincident<Dim>(own_nodes_, shares, team_);
  }
  if (pair.first >= 0)
    in_.problems.warning(
        {.file = file.name,
         .message = fmt::format("nodes {} and {} are at the same place", pair.first, pair.second),
         .hint = "cells that should be neighbours may not be connected"});
}

/// A mesh that has these cells, which other members may have. Collective.
template <int Dim>
std::shared_ptr<const Mesh<Dim>> ScenarioBuilder<Dim>::mesh_with(std::vector<Index> cells) const {
  const auto missing = [&](Index cell) { return !mesh_->holds(cell); };
  if (!mesh_->is_share() || !team_.any(std::any_of(cells.begin(), cells.end(), missing)))
    return mesh_;
  sort_unique(cells);
  return std::make_shared<const Mesh<Dim>>(mesh_->share({}, fetch_cells(*mesh_, cells, team_)));
}

/// Find the cells of particles (place()) in all of the mesh. Collective.
template <int Dim>
std::vector<Index> ScenarioBuilder<Dim>::find_cells(const std::vector<Index>& suggested) {
  std::vector<Index> strays;
  const auto& x = model_.particles.x;
  auto& cell = model_.particles.cell;
  if (!mesh_->is_share()) {
    all_or_none(team_, [&] { strays = place<Dim>(*mesh_, suggested, model_.particles); });
    return strays;
  }
  std::vector<std::size_t> rows;
  for (std::size_t p = 0; p < x.size(); ++p)
    if (cell[p] < 0) rows.push_back(p);
  if (!team_.any(!rows.empty())) return strays;
  if (!search_) search_.emplace(*mesh_, team_);
  std::vector<Vec<Dim>> points;
  std::vector<Index> first_tried;
  for (const std::size_t p : rows) {
    points.push_back(x[p]);
    if (!suggested.empty()) first_tried.push_back(suggested[p]);
  }
  const auto found = search_->locate(points, first_tried);
  search_.reset();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    cell[rows[i]] = found[i];
    if (found[i] < 0) strays.push_back(static_cast<Index>(rows[i]));
  }
  return strays;
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
