#include "io/mesh_ring.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

namespace lahar {

namespace {

/// Nodes may be this far from the places of the grid [lengths of the cell]; that cells are equal
/// boxes is checked elsewhere.
constexpr double place_tolerance = 1e-3;

template <int Dim>
inline constexpr int grid_nodes = Dim == 2 ? 16 : 64;

template <int Dim>
std::span<const Index> corners_of(const MeshTables<Dim>& mesh, std::size_t cell) {
  return std::span(mesh.cells).subspan(cell * corners<Dim>, corners<Dim>);
}

/// The nodes of and around a cell, the first axis fastest; -1 = none there.
template <int Dim>
std::array<Index, grid_nodes<Dim>> grid_of(const MeshTables<Dim>& mesh, std::size_t cell) {
  const std::span<const Index> corner = corners_of(mesh, cell);
  Vec<Dim> low = mesh.nodes[static_cast<std::size_t>(corner[0])], high = low;
  for (const Index node : corner) {
    low = low.cwiseMin(mesh.nodes[static_cast<std::size_t>(node)]);
    high = high.cwiseMax(mesh.nodes[static_cast<std::size_t>(node)]);
  }
  std::array<Index, grid_nodes<Dim>> grid;
  grid.fill(-1);
  const auto put = [&](Index node) {
    int at = 0;
    for (int d = Dim - 1; d >= 0; --d) {
      const double place =
          (mesh.nodes[static_cast<std::size_t>(node)][d] - low[d]) / (high[d] - low[d]) + 1;
      const double nearest = std::round(place);
      if (!(std::abs(place - nearest) < place_tolerance) || nearest < 0 || nearest > 3) return;
      at = 4 * at + static_cast<int>(nearest);
    }
    grid[static_cast<std::size_t>(at)] = node;
  };
  for (const Index node : corner) put(node);
  for (int k = 0; k < ring_nodes<Dim>; ++k)
    put(mesh.ring[cell * static_cast<std::size_t>(ring_nodes<Dim>) + static_cast<std::size_t>(k)]);
  return grid;
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
  for (std::size_t c = 0; c < listed; ++c) {
    Corners corner;
    std::ranges::copy(corners_of(mesh, c), corner.begin());
    known.insert(sorted(corner));
  }
  for (std::size_t c = 0; c < listed; ++c) {
    const auto grid = grid_of(mesh, c);
    if (std::find(grid.begin(), grid.end(), -1) != grid.end())
      return fmt::format("cell {} and the nodes around it are no grid of {} nodes", c,
                         grid_nodes<Dim>);
    for (int place = 0; place < (Dim == 2 ? 9 : 27); ++place) {
      const Corners corner = box_at<Dim>(grid, place);
      if (known.insert(sorted(corner)).second)
        mesh.cells.insert(mesh.cells.end(), corner.begin(), corner.end());
    }
  }
  return "";
}

template std::string add_ring_cells<2>(MeshTables<2>&);
template std::string add_ring_cells<3>(MeshTables<3>&);

}  // namespace lahar
