// A mesh with named sets from Gmsh or VTU: one process reads the file, all get their shares.
#include <fmt/format.h>

#include <algorithm>

#include "io/base/text.h"
#include "io/mesh/element_file.h"
#include "io/mesh/mesh_file.h"
#include "io/mesh/mesh_ring.h"
#include "io/scenario/scenario_builder.h"
#include "physics/base/directory_rank.h"

namespace lahar {

namespace {

/// Rows that are on their way at a time.
constexpr Index rows_at_a_time = 1 << 15;

/// Values that the first member has, `width` per row, in equal parts of rows (Team::part()), some
/// rows at a time. Collective.
template <class To, class T>
std::vector<To> spread_rows(std::vector<T> all, Index rows, Index width, const Team& team) {
  std::vector<To> own;
  for (Index row = 0; row < rows; row += rows_at_a_time) {
    std::vector<std::vector<To>> to(static_cast<std::size_t>(team.size()));
    if (team.index() == 0)
      for (Index r = row; r < std::min(rows, row + rows_at_a_time); ++r)
        for (Index k = 0; k < width; ++k)
          to[static_cast<std::size_t>(team.member(r, rows))].push_back(
              static_cast<To>(all[static_cast<std::size_t>(r * width + k)]));
    for (const auto& part : team.exchange(std::move(to)))
      own.insert(own.end(), part.begin(), part.end());
  }
  return own;
}

/// Members of a set that the first member has, each to the one that keeps it. Collective.
std::vector<Index> spread_members(const std::vector<Index>& all, bool nodes, const Team& team) {
  std::vector<std::vector<Index>> to(static_cast<std::size_t>(team.size()));
  const auto n = static_cast<Index>(all.size());
  for (Index i = 0; i < n; ++i) {
    const Index id = all[static_cast<std::size_t>(i)];
    const int keeper = nodes ? directory_rank(id, team.size()) : team.member(i, n);
    to[static_cast<std::size_t>(keeper)].push_back(id);
  }
  return joined(team.exchange(std::move(to)));
}

std::string text_of_bytes(const std::vector<char>& text) {
  return {text.begin(), text.end()};
}

/// What is wrong with cells, which have no lines of their own.
void report(const InputError& error, const std::string& file, ProblemList& problems) {
  for (Problem problem : error.problems()) {
    problem.file = file;
    problems.error(std::move(problem));
  }
}

}  // namespace

/// Of a file whose size is that of all members. Collective.
template <int Dim>
void ScenarioBuilder<Dim>::build_element_mesh(const JsonValue& mesh, const SideFile& file) {
  phase(fmt::format("'{}'", file.name));
  ElementMesh<Dim> read;
  const std::size_t before = in_.problems.count();
  double bytes = 0;
  by_the_first(team_, in_.problems, [&](ProblemList& problems) {
    try {
      bytes = bytes_to_read(file);
    } catch (const InputError& error) {
      report(error, file.name, problems);
    }
  });
  if (in_.problems.count() != before) return;
  bytes = team_.most({bytes}).front();
  need_memory(*mesh.find("mesh"), bytes, fmt::format("reading '{}'", file.name));
  memory_ -= bytes;
  by_the_first(team_, in_.problems, [&](ProblemList& problems) {
    try {
      read = mesh_of<Dim>(read_element_file(file), file.name, problems);
    } catch (const InputError& error) {
      report(error, file.name, problems);
    }
  });
  if (in_.problems.count() != before) return;
  read.element = static_cast<Element>(team_.each(static_cast<Index>(read.element)).front());
  const TableMeshKeys keys = element_mesh_keys(mesh, read.element);
  const Index n_nodes = team_.max(static_cast<Index>(read.nodes.size()));
  const Index per_cell = info(read.element).nodes;
  const Index n_cells = team_.max(static_cast<Index>(read.cells.size())) / per_cell;
  need_memory_of_elements(mesh, read.element, n_nodes, n_cells);
  take_element_sets(read);
  if (in_.problems.count() != before) return;
  try {
    if (team_.alone())
      model_.mesh = std::make_shared<const Mesh<Dim>>(
          Mesh<Dim>::from_tables(read.nodes, read.element, read.cells, keys.isoparametric));
    else
      share_element_mesh(read, n_nodes, n_cells, keys.isoparametric);
  } catch (const InputError&) {
    // Ids of cells in it are those of a share.
    by_the_first(team_, in_.problems, [&](ProblemList& problems) {
      try {
        ProblemList known;
        const auto again = mesh_of<Dim>(read_element_file(file), file.name, known);
        Mesh<Dim>::from_tables(again.nodes, again.element, again.cells, keys.isoparametric);
      } catch (const InputError& error) {
        report(error, file.name, problems);
      }
    });
    return;
  }
  if (keys.check_duplicates) warn_of_coincident(file, read.nodes);
}

template <int Dim>
void ScenarioBuilder<Dim>::share_element_mesh(ElementMesh<Dim>& read, Index n_nodes, Index n_cells,
                                              bool isoparametric) {
  MeshRows<Dim> rows{n_nodes, n_cells, {}, {}};
  std::vector<double> x;
  if (!read.nodes.empty()) x.assign(read.nodes[0].data(), read.nodes[0].data() + n_nodes * Dim);
  read.nodes = {};
  const auto own = spread_rows<double>(std::move(x), n_nodes, Dim, team_);
  for (std::size_t i = 0; i < own.size(); i += Dim) rows.nodes.emplace_back(own.data() + i);
  rows.cell_nodes =
      spread_rows<Local>(std::move(read.cells), n_cells, info(read.element).nodes, team_);
  auto share =
      std::make_shared<const Mesh<Dim>>(make_share(rows, read.element, isoparametric, team_));
  search_.emplace(*share, team_);
  model_.mesh = std::move(share);
  own_nodes_ = std::move(rows.nodes);
}

/// The element is the file's; `cell_type` may say the same.
template <int Dim>
TableMeshKeys ScenarioBuilder<Dim>::element_mesh_keys(const JsonValue& mesh, Element element) {
  TableMeshKeys keys = table_mesh_keys(mesh);
  const JsonValue* type = mesh.find("cell_type");
  if (type && type->defaulted) {
    set(*root_.find("mesh"), "cell_type", std::string(info(element).name));
  } else if (type && (keys.has_ring || keys.element != element)) {
    in_.error(*type, fmt::format("the cells of the mesh file are {}", info(element).name),
              "leave 'cell_type' out: the file says of which element cells are");
  }
  keys.element = element;
  return keys;
}

template <int Dim>
void ScenarioBuilder<Dim>::need_memory_of_elements(const JsonValue& at, Element element,
                                                   Index nodes, Index cells) {
  constexpr double copies = 3;
  const double bytes = static_cast<double>(nodes) * sizeof(Vec<Dim>) +
                       static_cast<double>(cells) * sizeof(Index) * info(element).nodes;
  need_memory(
      *at.find("mesh"), copies * bytes,
      fmt::format("a mesh of {} nodes and {} cells", format_count(nodes), format_count(cells)));
}

/// Groups of the file, until build_sets(). Collective.
template <int Dim>
void ScenarioBuilder<Dim>::take_element_sets(const ElementMesh<Dim>& read) {
  for (const bool nodes : {true, false}) {
    const auto& sets = nodes ? read.node_sets : read.cell_sets;
    const Index n = team_.max(static_cast<Index>(sets.size()));
    for (Index s = 0; s < n; ++s) {
      const bool first = team_.index() == 0;
      const auto at = static_cast<std::size_t>(s);
      const std::string own_name = first ? sets[at].name : "";
      const auto name =
          text_of_bytes(team_.gather(std::vector<char>(own_name.begin(), own_name.end())).front());
      const Index id = team_.each(first ? sets[at].id : -1).front();
      auto members = spread_members(first ? sets[at].members : std::vector<Index>{}, nodes, team_);
      element_sets_.push_back({nodes, name, id, std::move(members)});
    }
  }
}

/// Adds them to those of mesh.entity_sets.
template <int Dim>
void ScenarioBuilder<Dim>::add_element_sets() {
  for (ElementSet& of : element_sets_) {
    EntitySets& to = of.nodes ? sets_.nodes : sets_.cells;
    const bool is_new = of.name.empty() ? to.by_id.emplace(of.id, std::move(of.members)).second
                                        : to.by_name.emplace(of.name, std::move(of.members)).second;
    if (is_new) continue;
    in_.error(*section("mesh").find("mesh"),
              fmt::format("the {} set {} is both a group of the mesh file and in 'entity_sets'",
                          to.kind, of.id),
              "give the group a name");
  }
  element_sets_.clear();
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
