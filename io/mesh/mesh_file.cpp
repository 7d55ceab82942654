#include "io/mesh/mesh_file.h"

#include <algorithm>
#include <array>
#include <limits>

#include "io/base/file_part.h"
#include "io/mesh/shared_mesh.h"
#include "physics/base/sort_unique.h"

namespace lahar {

namespace {

// Rows of a member that are on their way at a time.
constexpr int rows_at_a_time = 1 << 15;

template <int Dim>
struct PlacedNode {
  Index node;
  std::array<double, static_cast<std::size_t>(Dim)> x;
};

// The rows of a mesh file as a team sees them before it reads them.
struct MeshLines : TeamRows {  // nodes before cells
  MeshLines(const SideFile& file, const Team& team, ProblemList& problems) {
    see(file, team, [&](RowReader& rows) {
      return rows.next() && rows.integer(n_nodes, "", 1) && rows.integer(n_cells, "", 1) &&
             rows.end_of_row();
    });
    if (part.has_value())
      n_cells = rows_to_read(file, "cells", 1 + n_nodes, n_cells, total - n_nodes, problems);
    constexpr Index most = std::numeric_limits<Local>::max();
    good = part.has_value() && n_nodes <= most && n_cells <= most && total == n_nodes + n_cells;
  }
  Index n_nodes = 0, n_cells = 0;  // promised
  bool good = false;
};

// Reads rows and sends each to the member that keeps it.
template <int Dim>
class RowsOnTheirWay {
 public:
  RowsOnTheirWay(const MeshLines& lines, int nodes_per_cell, const Team& team)
      : lines_(lines),
        per_cell_(static_cast<std::size_t>(nodes_per_cell)),
        team_(team),
        nodes_(static_cast<std::size_t>(team.size())),
        cells_(nodes_.size()) {}

  /// The next row, the i-th of all; false if anything is wrong.
  bool read(RowReader& rows, Index i) {
    if (i < lines_.n_nodes) {
      Vec<Dim> x;
      if (!read_point<Dim>(rows, x)) return false;
      auto& row = nodes_[holder(i, lines_.n_nodes)].emplace_back(PlacedNode<Dim>{i, {}});
      std::copy_n(x.data(), Dim, row.x.begin());
      return true;
    }
    const Index cell = i - lines_.n_nodes;
    auto& to = cells_[holder(cell, lines_.n_cells)];
    to.push_back(static_cast<Local>(cell));
    for (std::size_t k = 0; k < per_cell_; ++k) {
      Index node = 0;
      if (!rows.integer(node, "", 0, lines_.n_nodes - 1)) return false;
      to.push_back(static_cast<Local>(node));
    }
    return rows.end_of_row();
  }

  void exchange(MeshRows<Dim>& own) {
    const Index first_node = team_.part(own.n_nodes, team_.index());
    for (const auto& part : team_.exchange(nodes_))
      for (const PlacedNode<Dim>& row : part)
        own.nodes[static_cast<std::size_t>(row.node - first_node)] = Vec<Dim>(row.x.data());
    const Index first_cell = team_.part(own.n_cells, team_.index());
    for (const auto& part : team_.exchange(cells_))
      for (auto at = part.begin(); at != part.end();
           at += static_cast<std::ptrdiff_t>(per_cell_ + 1))
        std::copy_n(at + 1, per_cell_,
                    own.cell_nodes.begin() + (*at - first_cell) * static_cast<Index>(per_cell_));
    for (auto& to : nodes_) to.clear();
    for (auto& to : cells_) to.clear();
  }

 private:
  std::size_t holder(Index i, Index n) const {
    return static_cast<std::size_t>(team_.member(i, n));
  }

  const MeshLines& lines_;
  std::size_t per_cell_;
  const Team& team_;
  std::vector<std::vector<PlacedNode<Dim>>> nodes_;
  std::vector<std::vector<Local>> cells_;  // id and nodes of each
};

}  // namespace

template <int Dim>
std::optional<MeshRows<Dim>> read_mesh_rows(const SideFile& file, int nodes_per_cell,
                                            const Team& team, ProblemList& problems) {
  const MeshLines lines(file, team, problems);
  if (!lines.good) return std::nullopt;
  const auto own = [&](Index n) {
    return static_cast<std::size_t>(team.part(n, team.index() + 1) - team.part(n, team.index()));
  };
  MeshRows<Dim> mesh{lines.n_nodes, lines.n_cells, {}, {}};
  mesh.nodes.resize(own(mesh.n_nodes));
  mesh.cell_nodes.resize(own(mesh.n_cells) * static_cast<std::size_t>(nodes_per_cell));
  ProblemList none;
  RowReader rows(file, none, lines.part->begin, lines.part->end);
  RowsOnTheirWay<Dim> on_their_way(lines, nodes_per_cell, team);
  Index i = lines.first;
  bool good = true, more = true;
  while (team.any(more) && !team.any(!good)) {
    all_or_none(team, [&] {
      for (int n = 0; more && good && n < rows_at_a_time; ++n) {
        more = rows.next();
        if (more) good = on_their_way.read(rows, i++);
      }
    });
    if (!team.any(!good)) on_their_way.exchange(mesh);
  }
  if (team.any(!good)) return std::nullopt;
  return mesh;
}

template <int Dim>
std::vector<Vec<Dim>> find_nodes(const MeshRows<Dim>& rows, const std::vector<Local>& nodes,
                                 const Team& team) {
  using Point = std::array<double, static_cast<std::size_t>(Dim)>;
  const Index first_node = team.part(rows.n_nodes, team.index());
  const auto points = ask<Point>(
      team, nodes, [&](Index node) { return team.member(node, rows.n_nodes); },
      [&](Index node) {
        Point x;
        std::copy_n(rows.nodes[static_cast<std::size_t>(node - first_node)].data(), Dim, x.begin());
        return x;
      });
  std::vector<Vec<Dim>> found;
  found.reserve(points.size());
  for (const Point& x : points) found.emplace_back(x.data());
  return found;
}

template <int Dim>
Mesh<Dim> make_share(MeshRows<Dim>& rows, Element element, bool isoparametric, const Team& team) {
  TablePiece<Dim> own;
  const auto [first, end] = own_cells(rows.n_cells, team);
  for (Index cell = first; cell < end; ++cell) own.cells.push_back(cell);
  own.nodes.assign(rows.cell_nodes.begin(), rows.cell_nodes.end());
  sort_unique(own.nodes);
  own.nodes.shrink_to_fit();
  own.x = find_nodes(rows, {own.nodes.begin(), own.nodes.end()}, team);
  own.cell_nodes = std::move(rows.cell_nodes);
  for (Local& node : own.cell_nodes)
    node = static_cast<Local>(std::lower_bound(own.nodes.begin(), own.nodes.end(), node) -
                              own.nodes.begin());
  std::optional<Mesh<Dim>> share;
  all_or_none(team, [&] {
    share.emplace(
        Mesh<Dim>::share(std::move(own), element, rows.n_nodes, rows.n_cells, isoparametric));
  });
  complete_shares(*share, team);
  return std::move(*share);
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template std::optional<MeshRows<Dim>> read_mesh_rows(const SideFile&, int, const Team&,    \
                                                       ProblemList&);                        \
  template std::vector<Vec<Dim>> find_nodes(const MeshRows<Dim>&, const std::vector<Local>&, \
                                            const Team&);                                    \
  template Mesh<Dim> make_share(MeshRows<Dim>&, Element, bool, const Team&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
