// The tables in the side files.
#include <fmt/format.h>

#include <algorithm>

#include "io/side_files.h"

namespace lahar {

namespace {

constexpr std::string_view axis_names[] = {"x", "y", "z"};

template <int Dim>
bool read_point(RowReader& rows, Vec<Dim>& x) {
  for (int d = 0; d < Dim; ++d)
    if (!rows.real(x[d], axis_names[d])) return false;
  return rows.end_of_row(Dim == 2 ? 1 : 0);  // published 2D files may carry a z column
}

// Whether there is room for `count` rows of at least two bytes: a wild count must not allocate.
bool plausible(const SideFile& file, Index count) {
  return count <= static_cast<Index>(file.text.size() / 2 + 1);
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

}  // namespace

template <int Dim>
std::optional<MeshTables<Dim>> read_mesh_file(const SideFile& file, ProblemList& problems) {
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
  if (plausible(file, n_cells)) mesh.cells.reserve(static_cast<std::size_t>(n_cells));
  for (Index i = 0; i < n_cells; ++i) {
    if (!rows.next()) {
      too_few(rows, "cells", i, n_cells);
      return std::nullopt;
    }
    auto& cell = mesh.cells.emplace_back();
    mesh.cell_lines.push_back(rows.line());
    bool ok = true;
    for (Index& node : cell) ok = ok && rows.integer(node, "a node id", 0, n_nodes - 1);
    if (ok) rows.end_of_row();
  }
  no_more_rows(rows, "cells", n_cells);
  if (rows.failed()) return std::nullopt;
  return mesh;
}

namespace {

// The first row of a file of particles says how many there are; false if it does not (reported).
bool read_count(RowReader& rows, Index& count) {
  if (!rows.next()) {
    rows.complain_file("the file holds no data", "the first row is the number of particles");
    return false;
  }
  return rows.integer(count, "the number of particles", 1) && rows.end_of_row();
}

}  // namespace

template <int Dim>
std::optional<std::vector<Vec<Dim>>> read_particle_file(const SideFile& file,
                                                        ProblemList& problems) {
  RowReader rows(file, problems);
  Index count = 0;
  if (!read_count(rows, count)) return std::nullopt;
  std::vector<Vec<Dim>> points;
  if (plausible(file, count)) points.reserve(static_cast<std::size_t>(count));
  for (Index i = 0; i < count; ++i) {
    if (!rows.next()) {
      too_few(rows, "particles", i, count);
      return std::nullopt;
    }
    read_point<Dim>(rows, points.emplace_back());
  }
  no_more_rows(rows, "particles", count);
  if (rows.failed()) return std::nullopt;
  return points;
}

std::optional<std::vector<Voigt>> read_stress_file(const SideFile& file, Index n_particles,
                                                   ProblemList& problems) {
  constexpr std::string_view names[] = {"xx", "yy", "zz", "xy", "yz", "xz"};
  RowReader rows(file, problems);
  Index count = 0;
  if (!read_count(rows, count)) return std::nullopt;
  if (n_particles >= 0 && count != n_particles)
    rows.complain(
        fmt::format("the file has stresses of {} particles, but there are {}", count, n_particles));
  std::vector<Voigt> stresses;
  for (Index i = 0; i < count; ++i) {
    if (!rows.next()) {
      too_few(rows, "rows of stresses", i, count);
      return std::nullopt;
    }
    bool ok = true;
    auto& stress = stresses.emplace_back();
    for (std::size_t c = 0; c < 6; ++c) ok = ok && rows.real(stress[c], names[c]);
    if (ok) rows.end_of_row();
  }
  no_more_rows(rows, "rows of stresses", count);
  if (rows.failed()) return std::nullopt;
  return stresses;
}

namespace {

// Highest id allowed where n entities exist; any where their number is unknown (-1).
Index last_id(Index n) {
  return n < 0 ? std::numeric_limits<Index>::max() : n - 1;
}

// Complains where `id` was seen before.
class Once {
 public:
  bool operator()(RowReader& rows, Index id, std::string_view what) {
    if (static_cast<std::size_t>(id) >= line_.size())
      line_.resize(static_cast<std::size_t>(id) + 1);
    int& line = line_[static_cast<std::size_t>(id)];
    if (line == 0) {
      line = rows.line();
      return true;
    }
    rows.complain(fmt::format("{} {} occurs twice; first on line {}", what, id, line));
    return false;
  }

 private:
  std::vector<int> line_;
};

}  // namespace

std::optional<std::vector<std::pair<Index, double>>> read_volume_file(const SideFile& file,
                                                                      Index n_particles,
                                                                      ProblemList& problems) {
  RowReader rows(file, problems);
  std::vector<std::pair<Index, double>> volumes;
  Once once;
  while (rows.next()) {
    Index id = 0;
    double volume = 0;
    if (!rows.integer(id, "a particle id", 0, last_id(n_particles))) continue;
    if (n_particles >= 0 && !once(rows, id, "particle")) continue;
    if (!rows.real(volume, "the volume")) continue;
    if (volume <= 0) {
      rows.complain(fmt::format("the volume must be greater than 0, found {}", volume));
      continue;
    }
    if (rows.end_of_row()) volumes.emplace_back(id, volume);
  }
  if (rows.failed()) return std::nullopt;
  return volumes;
}

std::optional<std::vector<std::pair<Index, Index>>> read_particle_cell_file(const SideFile& file,
                                                                            Index n_particles,
                                                                            Index n_cells,
                                                                            ProblemList& problems) {
  RowReader rows(file, problems);
  std::vector<std::pair<Index, Index>> cells;
  Once once;
  while (rows.next()) {
    Index id = 0, cell = 0;
    if (!rows.integer(id, "a particle id", 0, last_id(n_particles))) continue;
    if (n_particles >= 0 && !once(rows, id, "particle")) continue;
    if (rows.integer(cell, "a cell id", 0, last_id(n_cells)) && rows.end_of_row())
      cells.emplace_back(id, cell);
  }
  if (rows.failed()) return std::nullopt;
  return cells;
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

void check_friction_file(const SideFile& file, Index n_nodes, int dim, ProblemList& problems) {
  RowReader rows(file, problems);
  while (rows.next()) {
    Index node = 0, dir = 0, sign = 0;
    double friction = 0;
    if (rows.integer(node, "a node id", 0, last_id(n_nodes)) &&
        rows.integer(dir, "the direction", 0, dim - 1) && rows.integer(sign, "sign_n", -1, 1) &&
        rows.real(friction, "the friction coefficient"))
      rows.end_of_row();
  }
}

void check_angle_file(const SideFile& file, Index n_nodes, int dim, ProblemList& problems) {
  RowReader rows(file, problems);
  while (rows.next()) {
    Index node = 0;
    double angle = 0;
    if (rows.integer(node, "a node id", 0, last_id(n_nodes)) && rows.real(angle, "alpha") &&
        rows.real(angle, "beta") && (dim == 2 || rows.real(angle, "gamma")))
      rows.end_of_row();
  }
}

template std::optional<MeshTables<2>> read_mesh_file<2>(const SideFile&, ProblemList&);
template std::optional<MeshTables<3>> read_mesh_file<3>(const SideFile&, ProblemList&);
template std::optional<std::vector<Vec<2>>> read_particle_file<2>(const SideFile&, ProblemList&);
template std::optional<std::vector<Vec<3>>> read_particle_file<3>(const SideFile&, ProblemList&);

}  // namespace lahar
