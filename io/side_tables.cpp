// Meshes and values of nodes in the side files.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <unordered_set>

#include "io/side_files.h"

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

std::optional<std::vector<NodeValue>> read_node_values(const SideFile& file, std::string_view what,
                                                       Index n_nodes, int dim,
                                                       ProblemList& problems) {
  RowReader rows(file, problems);
  std::vector<NodeValue> values;
  while (rows.next()) {
    Index node = 0, dir = 0;
    double value = 0;
    if (rows.integer(node, "a node id", 0, last_id(n_nodes)) &&
        rows.integer(dir, "the direction", 0, dim - 1) && rows.real(value, what) &&
        rows.end_of_row())
      values.push_back({node, static_cast<int>(dir), value});
  }
  if (rows.failed()) return std::nullopt;
  return values;
}

std::optional<std::vector<NodeFriction>> read_friction_file(const SideFile& file, Index n_nodes,
                                                            int dim, ProblemList& problems) {
  RowReader rows(file, problems);
  std::vector<NodeFriction> values;
  while (rows.next()) {
    Index node = 0, dir = 0, sign = 0;
    double friction = 0;
    if (!rows.integer(node, "a node id", 0, last_id(n_nodes)) ||
        !rows.integer(dir, "the direction", 0, dim - 1) || !rows.integer(sign, "sign_n", -1, 1))
      continue;
    if (sign == 0)
      rows.complain("sign_n must be 1 or -1, found 0", sign_hint);
    else if (rows.real(friction, "the friction coefficient")) {
      if (friction < 0)
        rows.complain(
            fmt::format("the friction coefficient must be at least 0, found {}", friction));
      else if (rows.end_of_row())
        values.push_back({node, static_cast<int>(dir), static_cast<int>(sign), friction});
    }
  }
  if (rows.failed()) return std::nullopt;
  return values;
}

namespace {

template <int Dim>
Eigen::Matrix<double, Dim, Dim> euler_axes(double alpha, double beta, double gamma) {
  if constexpr (Dim == 2)
    return Eigen::Rotation2D<double>(alpha + beta).toRotationMatrix();
  else {
    using Turn = Eigen::AngleAxis<double>;
    return Turn(alpha, Vec<3>::UnitZ()).toRotationMatrix() *
           Turn(gamma, Vec<3>::UnitX()).toRotationMatrix() *
           Turn(beta, Vec<3>::UnitZ()).toRotationMatrix();
  }
}

}  // namespace

template <int Dim>
std::optional<std::vector<NodeFrame<Dim>>> read_angle_file(const SideFile& file, Index n_nodes,
                                                           ProblemList& problems) {
  RowReader rows(file, problems);
  std::vector<NodeFrame<Dim>> frames;
  std::unordered_set<Index> seen;
  while (rows.next()) {
    Index node = 0;
    double alpha = 0, beta = 0, gamma = 0;
    if (!rows.integer(node, "a node id", 0, last_id(n_nodes))) continue;
    if (!seen.insert(node).second) {
      rows.complain(fmt::format("node {} occurs more than once", node));
      continue;
    }
    if (rows.real(alpha, "alpha") && rows.real(beta, "beta") &&
        (Dim == 2 || rows.real(gamma, "gamma")) && rows.end_of_row(Dim == 2 ? 1 : 0))
      frames.push_back({node, euler_axes<Dim>(alpha, beta, gamma)});
  }
  if (rows.failed()) return std::nullopt;
  return frames;
}

template std::optional<MeshTables<2>> read_mesh_file<2>(const SideFile&, int, ProblemList&, int);
template std::optional<MeshTables<3>> read_mesh_file<3>(const SideFile&, int, ProblemList&, int);
template std::optional<std::vector<NodeFrame<2>>> read_angle_file<2>(const SideFile&, Index,
                                                                     ProblemList&);
template std::optional<std::vector<NodeFrame<3>>> read_angle_file<3>(const SideFile&, Index,
                                                                     ProblemList&);
template bool read_point<2>(RowReader&, Vec<2>&);
template bool read_point<3>(RowReader&, Vec<3>&);

}  // namespace lahar
