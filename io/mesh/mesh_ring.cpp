#include "io/mesh/mesh_ring.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <span>

#include "physics/base/directory_rank.h"
#include "physics/base/sort_unique.h"

namespace lahar {

namespace {

/// Nodes may be this far from the places of the grid [lengths of the cell]; that cells are equal
/// boxes is checked elsewhere.
constexpr double place_tolerance = 1e-3;

template <int Dim>
inline constexpr int grid_nodes = Dim == 2 ? 16 : 64;

/// Places around and at a cell where there may be one.
template <int Dim>
inline constexpr int places = Dim == 2 ? 9 : 27;

/// The nodes of and around a cell, the first axis fastest; -1 = none there. `x(node)` is where a
/// node is [m].
template <int Dim, class Id>
std::array<Index, grid_nodes<Dim>> grid_of(std::span<const Id> corner, std::span<const Id> ring,
                                           auto&& x) {
  Vec<Dim> low = x(corner[0]), high = low;
  for (const Id node : corner) {
    low = low.cwiseMin(x(node));
    high = high.cwiseMax(x(node));
  }
  std::array<Index, grid_nodes<Dim>> grid;
  grid.fill(-1);
  const auto put = [&](Id node) {
    int at = 0;
    for (int d = Dim - 1; d >= 0; --d) {
      const double place = (x(node)[d] - low[d]) / (high[d] - low[d]) + 1;
      const double nearest = std::round(place);
      if (!(std::abs(place - nearest) < place_tolerance) || nearest < 0 || nearest > 3) return;
      at = 4 * at + static_cast<int>(nearest);
    }
    grid[static_cast<std::size_t>(at)] = node;
  };
  for (const Id node : corner) put(node);
  for (const Id node : ring) put(node);
  return grid;
}

template <std::size_t n>
bool complete(const std::array<Index, n>& grid) {
  return std::find(grid.begin(), grid.end(), -1) == grid.end();
}

/// Corners in file order of the box at a place of the grid, 0 to 2 along each axis.
template <int Dim>
std::array<Index, corners<Dim>> box_at(const std::array<Index, grid_nodes<Dim>>& grid, int place) {
  const int i = place % 3, j = place / 3 % 3, k = place / 9;
  const auto node = [&](int x, int y, int z) {
    return grid[static_cast<std::size_t>((z * 4 + y) * 4 + x)];
  };
  std::array<Index, corners<Dim>> corner;
  for (int z = 0; z < Dim - 1; ++z) {
    const auto at = static_cast<std::size_t>(4 * z);
    corner[at] = node(i, j, k + z);
    corner[at + 1] = node(i + 1, j, k + z);
    corner[at + 2] = node(i + 1, j + 1, k + z);
    corner[at + 3] = node(i, j + 1, k + z);
  }
  return corner;
}

template <class Corners>
Corners sorted(Corners corner) {
  std::sort(corner.begin(), corner.end());
  return corner;
}

}  // namespace

template <int Dim>
std::string add_ring_cells(MeshTables<Dim>& mesh) {
  using Corners = std::array<Index, corners<Dim>>;
  std::set<Corners> known;
  const std::size_t listed = mesh.cells.size() / corners<Dim>;
  const auto corners_of = [&](std::size_t cell) {
    return std::span<const Index>(mesh.cells).subspan(cell * corners<Dim>, corners<Dim>);
  };
  for (std::size_t c = 0; c < listed; ++c) {
    Corners corner;
    std::ranges::copy(corners_of(c), corner.begin());
    known.insert(sorted(corner));
  }
  for (std::size_t c = 0; c < listed; ++c) {
    const auto ring = std::span<const Index>(mesh.ring).subspan(
        c * static_cast<std::size_t>(ring_nodes<Dim>), static_cast<std::size_t>(ring_nodes<Dim>));
    const auto grid = grid_of<Dim>(corners_of(c), ring, [&](Index node) -> const Vec<Dim>& {
      return mesh.nodes[static_cast<std::size_t>(node)];
    });
    if (!complete(grid))
      return fmt::format("cell {} and the nodes around it are no grid of {} nodes", c,
                         grid_nodes<Dim>);
    for (int place = 0; place < places<Dim>; ++place) {
      const Corners corner = box_at<Dim>(grid, place);
      if (known.insert(sorted(corner)).second)
        mesh.cells.insert(mesh.cells.end(), corner.begin(), corner.end());
    }
  }
  return "";
}

namespace {

/// A cell that the nodes around a listed one form.
template <int Dim>
struct RingCell {
  Index found;  ///< by which cell and at which of its places: in this order cells are numbered
  std::array<Local, corners<Dim>> corner;
};

template <int Dim>
std::array<Local, corners<Dim>> corners_at(const std::vector<Local>& cell_nodes,
                                           std::size_t first) {
  std::array<Local, corners<Dim>> corner;
  std::copy_n(cell_nodes.begin() + static_cast<std::ptrdiff_t>(first), corners<Dim>,
              corner.begin());
  return corner;
}

/// What the listed cells of a member find around them that is none of these; nothing if the nodes
/// around a cell are no grid. Collective.
template <int Dim>
std::optional<std::vector<RingCell<Dim>>> find_ring_cells(const MeshRows<Dim>& rows,
                                                          const Team& team) {
  constexpr std::size_t per_cell = static_cast<std::size_t>(corners<Dim> + ring_nodes<Dim>);
  std::vector<Local> nodes = rows.cell_nodes;
  sort_unique(nodes);
  const std::vector<Vec<Dim>> x = find_nodes(rows, nodes, team);
  const auto x_of = [&](Local node) -> const Vec<Dim>& {
    return x[static_cast<std::size_t>(std::lower_bound(nodes.begin(), nodes.end(), node) -
                                      nodes.begin())];
  };
  const std::span<const Local> all(rows.cell_nodes);
  std::set<std::array<Local, corners<Dim>>> known;
  for (std::size_t at = 0; at < all.size(); at += per_cell)
    known.insert(sorted(corners_at<Dim>(rows.cell_nodes, at)));
  std::vector<RingCell<Dim>> found;
  Index cell = team.part(rows.n_cells, team.index());
  for (std::size_t at = 0; at < all.size(); at += per_cell, ++cell) {
    const auto grid = grid_of<Dim>(all.subspan(at, corners<Dim>),
                                   all.subspan(at + corners<Dim>, ring_nodes<Dim>), x_of);
    if (!complete(grid)) return std::nullopt;
    for (int place = 0; place < places<Dim>; ++place) {
      RingCell<Dim> of_ring{cell * places<Dim> + place, {}};
      std::ranges::copy(box_at<Dim>(grid, place), of_ring.corner.begin());
      if (known.insert(sorted(of_ring.corner)).second) found.push_back(of_ring);
    }
  }
  return found;
}

/// Keep each cell that members have found once, by the first cell that finds it, and none that is
/// listed. Collective.
template <int Dim>
void keep_first(std::vector<RingCell<Dim>>& found, const MeshRows<Dim>& rows, const Team& team) {
  constexpr std::size_t per_cell = static_cast<std::size_t>(corners<Dim> + ring_nodes<Dim>);
  constexpr Index listed = -1;  // before all others
  const auto size = static_cast<std::size_t>(team.size());
  std::vector<std::vector<RingCell<Dim>>> to(size);
  const auto send = [&](const RingCell<Dim>& cell) {
    const int home = directory_rank(*std::ranges::min_element(cell.corner), team.size());
    to[static_cast<std::size_t>(home)].push_back(cell);
  };
  for (std::size_t at = 0; at < rows.cell_nodes.size(); at += per_cell)
    send({listed, corners_at<Dim>(rows.cell_nodes, at)});
  for (const RingCell<Dim>& cell : found) send(cell);
  std::map<std::array<Local, corners<Dim>>, Index> first;
  for (const auto& part : team.exchange(std::move(to)))
    for (const RingCell<Dim>& cell : part) {
      const auto at = first.emplace(sorted(cell.corner), cell.found).first;
      at->second = std::min(at->second, cell.found);
    }
  std::vector<std::vector<Index>> kept(size);
  for (const auto& [corner, by] : first)
    if (by != listed)
      kept[static_cast<std::size_t>(team.member(by / places<Dim>, rows.n_cells))].push_back(by);
  std::vector<Index> own = joined(team.exchange(std::move(kept)));
  std::sort(own.begin(), own.end());
  std::erase_if(found, [&](const RingCell<Dim>& cell) {
    return !std::binary_search(own.begin(), own.end(), cell.found);
  });
}

}  // namespace

template <int Dim>
bool add_ring_cells(MeshRows<Dim>& rows, const Team& team) {
  constexpr std::size_t per_cell = static_cast<std::size_t>(corners<Dim> + ring_nodes<Dim>);
  auto found = find_ring_cells(rows, team);
  if (team.any(!found)) return false;
  keep_first(*found, rows, team);
  // The listed cells, then the others; each to who has its part of all.
  const std::vector<Index> others = team.each(static_cast<Index>(found->size()));
  const Index listed = rows.n_cells;
  rows.n_cells += std::accumulate(others.begin(), others.end(), Index{0});
  std::vector<std::vector<RingCell<Dim>>> to(static_cast<std::size_t>(team.size()));
  const auto send = [&](Index id, const std::array<Local, corners<Dim>>& corner) {
    to[static_cast<std::size_t>(team.member(id, rows.n_cells))].push_back({id, corner});
  };
  Index id = team.part(listed, team.index());
  for (std::size_t at = 0; at < rows.cell_nodes.size(); at += per_cell)
    send(id++, corners_at<Dim>(rows.cell_nodes, at));
  id = std::accumulate(others.begin(), others.begin() + team.index(), listed);
  for (const RingCell<Dim>& cell : *found) send(id++, cell.corner);
  const Index first = team.part(rows.n_cells, team.index());
  const Index own = team.part(rows.n_cells, team.index() + 1) - first;
  rows.cell_nodes.assign(static_cast<std::size_t>(own * corners<Dim>), 0);
  for (const auto& part : team.exchange(std::move(to)))
    for (const RingCell<Dim>& cell : part)
      std::ranges::copy(cell.corner, rows.cell_nodes.begin() + (cell.found - first) * corners<Dim>);
  return true;
}

template std::string add_ring_cells<2>(MeshTables<2>&);
template std::string add_ring_cells<3>(MeshTables<3>&);
template bool add_ring_cells<2>(MeshRows<2>&, const Team&);
template bool add_ring_cells<3>(MeshRows<3>&, const Team&);

}  // namespace lahar
