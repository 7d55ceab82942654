// Meshes in the side files.
#include <fmt/format.h>

#include "io/base/file_part.h"
#include "io/base/side_files.h"

namespace lahar {

template <int Dim>
bool read_point(RowReader& rows, Vec<Dim>& x) {
  constexpr std::string_view axis_names[] = {"x", "y", "z"};
  for (int d = 0; d < Dim; ++d)
    if (!rows.real(x[d], axis_names[d])) return false;
  return rows.end_of_row(Dim == 2 ? 1 : 0);  // published 2D files may carry a z column
}

bool plausible(const SideFile& file, Index count) {
  return count <= file.size / 2 + 1;
}

void too_few(RowReader& rows, std::string_view what, Index found, Index promised) {
  rows.complain_file(fmt::format("the file ends after {} of {} {}", found, promised, what));
}

bool no_more_rows(RowReader& rows, std::string_view what, Index promised) {
  if (!rows.next()) return true;
  rows.complain(fmt::format("unexpected row after {} {}", promised, what),
                "the count in the first row is too small, or there are rows too many");
  return false;
}

template <int Dim>
std::optional<MeshTables<Dim>> read_mesh_file(const SideFile& file, int nodes_per_cell,
                                              ProblemList& problems, int further_nodes) {
  RowReader rows(file, problems);
  Index n_nodes = 0, n_cells = 0;
  if (!rows.next()) {
    rows.complain_file("the file holds no data", "the first row is: nnodes ncells");
    return std::nullopt;
  }
  if (!rows.integer(n_nodes, "the number of nodes", 1) ||
      !rows.integer(n_cells, "the number of cells", 1) || !rows.end_of_row())
    return std::nullopt;
  if (file.as_cbgeo)
    n_cells =
        rows_to_read(file, "cells", 1 + n_nodes, n_cells,
                     count_rows(file, FilePart(file, rows.offset(), Team())) - n_nodes, problems);
  MeshTables<Dim> mesh;
  if (plausible(file, n_nodes)) mesh.nodes.reserve(static_cast<std::size_t>(n_nodes));
  for (Index i = 0; i < n_nodes; ++i) {
    if (!rows.next()) {
      too_few(rows, "nodes", i, n_nodes);
      return std::nullopt;
    }
    read_point<Dim>(rows, mesh.nodes.emplace_back());
  }
  if (plausible(file, n_cells))
    mesh.cells.reserve(static_cast<std::size_t>(n_cells) *
                       static_cast<std::size_t>(nodes_per_cell));
  for (Index i = 0; i < n_cells; ++i) {
    if (!rows.next()) {
      too_few(rows, "cells", i, n_cells);
      return std::nullopt;
    }
    bool ok = true;
    for (int k = 0; k < nodes_per_cell; ++k)
      ok = ok && rows.integer(mesh.cells.emplace_back(), "a node id", 0, n_nodes - 1);
    for (int k = 0; k < further_nodes; ++k)
      ok = ok && rows.integer(mesh.ring.emplace_back(), "a node id", 0, n_nodes - 1);
    if (ok) rows.end_of_row();
  }
  no_more_rows(rows, "cells", n_cells);
  if (rows.failed()) return std::nullopt;
  return mesh;
}

template std::optional<MeshTables<2>> read_mesh_file<2>(const SideFile&, int, ProblemList&, int);
template std::optional<MeshTables<3>> read_mesh_file<3>(const SideFile&, int, ProblemList&, int);
template bool read_point<2>(RowReader&, Vec<2>&);
template bool read_point<3>(RowReader&, Vec<3>&);

}  // namespace lahar
