/// \file Connectivity and geometry of a mesh from tables, all built in O(cells).
#include "physics/mesh/mesh_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "physics/base/error.h"
#include "physics/mesh/inverse_mapping.h"

namespace lahar {

template <int Dim>
std::array<int, corners<Dim>> box_orientation(const std::array<Vec<Dim>, corners<Dim>>& corner) {
  Vec<Dim> low = corner[0], high = corner[0];
  for (const auto& X : corner) low = low.cwiseMin(X), high = high.cwiseMax(X);
  const Vec<Dim> middle = 0.5 * (low + high);
  std::array<int, corners<Dim>> tensor{};
  for (int k = 0; k < corners<Dim>; ++k)
    for (int d = 0; d < Dim; ++d) tensor[k] |= (corner[k][d] > middle[d]) << d;
  return tensor;
}

template <int Dim>
CellTable<Dim>::CellTable(std::vector<Point> nodes, Element element, std::span<const Index> ids,
                          bool isoparametric)
    : nodes_(std::move(nodes)) {
  const CellList cells{element, ids};
  check_tables<Dim>(nodes_, cells, isoparametric);
  whole_.n_nodes = static_cast<Index>(nodes_.size());
  whole_.n_cells = cells.size();
  whole_.element = element;
  whole_.cartesian = is_multilinear() && !isoparametric;
  cell_ids_ = IdMap::all(whole_.n_cells);
  node_ids_ = IdMap::all(whole_.n_nodes);
  cells_.assign(ids.begin(), ids.end());
  build_bounds();
  CellSums<Dim> sums;
  add_to(sums);
  complete(sums);
  build_connectivity();
  grid_.bins = IdMap::all(n_bins());
  fill_bins();
}

template <int Dim>
Index CellTable<Dim>::cell_row(Index cell) const {
  const Index row = cell_ids_.row(cell);
  assert(row >= 0 && "the cell is in another part of the mesh");
  return row;
}

template <int Dim>
Index CellTable<Dim>::node_row(Index node) const {
  const Index row = node_ids_.row(node);
  assert(row >= 0 && "the node is in another part of the mesh");
  return row;
}

template <int Dim>
CellNodes<Dim> CellTable<Dim>::element_nodes(Index cell) const {
  const auto file = nodes_of(cell_row(cell));
  CellNodes<Dim> nodes{{}, static_cast<int>(file.size())};
  for (std::size_t k = 0; k < file.size(); ++k) nodes.id[k] = node_ids_.id(file[k]);
  return nodes;
}

template <int Dim>
std::array<Index, corners<Dim>> CellTable<Dim>::cell_nodes(Index cell) const {
  assert(is_multilinear());
  const auto file = nodes_of(cell_row(cell));
  Corners nodes;
  for (int k = 0; k < corners<Dim>; ++k) nodes[k] = node_ids_.id(file[k]);
  return nodes;
}

template <int Dim>
std::array<Index, corners<Dim>> CellTable<Dim>::cell_nodes_tensor(Index cell) const {
  const Rows tensor = corners_tensor(cell_row(cell));
  Corners nodes;
  for (int a = 0; a < corners<Dim>; ++a) nodes[a] = node_ids_.id(tensor[a]);
  return nodes;
}

template <int Dim>
std::array<Local, corners<Dim>> CellTable<Dim>::corners_tensor(Index row) const {
  assert(is_multilinear());
  const auto file = nodes_of(row);
  Rows nodes;
  if (is_cartesian()) {
    std::array<Point, corners<Dim>> corner;
    for (int k = 0; k < corners<Dim>; ++k) corner[k] = nodes_[file[k]];
    const auto tensor = box_orientation<Dim>(corner);
    for (int k = 0; k < corners<Dim>; ++k) nodes[tensor[k]] = file[k];
  } else {
    for (int k = 0; k < corners<Dim>; ++k) nodes[tensor_corner(k)] = file[k];
  }
  return nodes;
}

/// Centre: the corners added in file order, then divided. Length of axis d: the norm of the edge
/// (0,1), (1,3), (1,5) in tensor order for x, y, z. Both to the last bit as in the reference code,
/// because they decide which of two cells owns a particle on their common face.
template <int Dim>
CellGeometry<Dim> CellTable<Dim>::geometry_of(Index row) const {
  CellGeometry<Dim> g;
  g.cartesian = is_cartesian();
  const auto file = nodes_of(row);
  Point sum = nodes_[file[0]];
  for (int k = 1; k < corners<Dim>; ++k) sum += nodes_[file[k]];
  g.centre = sum / corners<Dim>;
  const Rows nodes = corners_tensor(row);
  for (int a = 0; a < corners<Dim>; ++a) g.corner[a] = nodes_[nodes[a]];
  constexpr int edge[3][2] = {{0, 1}, {1, 3}, {1, 5}};
  for (int d = 0; d < Dim; ++d)
    g.length[d] = g.cartesian ? (g.corner[edge[d][0]] - g.corner[edge[d][1]]).norm() : 0.0;
  return g;
}

template <int Dim>
ElementGeometry<Dim> CellTable<Dim>::element_geometry_of(Index row) const {
  ElementGeometry<Dim> geometry{element(), {}};
  const auto file = nodes_of(row);
  for (std::size_t a = 0; a < file.size(); ++a) geometry.X[a] = nodes_[file[a]];
  return geometry;
}

template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> CellTable<Dim>::cell_bounds(Index row) const {
  if (!curved_bounds_.empty()) return curved_bounds_[row];
  const auto file = nodes_of(row);
  Point low = nodes_[file[0]], high = low;
  for (Local node : file.subspan(1)) {
    low = low.cwiseMin(nodes_[node]);
    high = high.cwiseMax(nodes_[node]);
  }
  return {low, high};
}

template <int Dim>
void CellTable<Dim>::build_bounds() {
  if (info(element()).order == 1) return;
  curved_bounds_.reserve(static_cast<std::size_t>(cell_ids_.size()));
  for (Index c = 0; c < cell_ids_.size(); ++c)
    curved_bounds_.push_back(element_geometry_of(c).bounds());
}

/// What follows from the nodes and cells held, but for bins.
template <int Dim>
void CellTable<Dim>::build_connectivity() {
  padded_bounds_.reserve(static_cast<std::size_t>(cell_ids_.size()));
  for (Index c = 0; c < cell_ids_.size(); ++c) padded_bounds_.push_back(padded(cell_bounds(c)));
  build_node_cells();
  build_face_neighbours();
}

template <int Dim>
void CellTable<Dim>::build_node_cells() {
  auto& first = node_cells_.first;
  first.assign(nodes_.size() + 1, 0);
  for (Local node : cells_) ++first[node + 1];
  for (std::size_t n = 0; n < nodes_.size(); ++n) first[n + 1] += first[n];
  node_cells_.item.resize(first.back());
  std::vector<Index> next(first.begin(), first.end() - 1);
  for (Index c = 0; c < cell_ids_.size(); ++c)
    for (Local node : nodes_of(c)) node_cells_.item[next[node]++] = static_cast<Local>(c);
}

/// The corners of each face, sorted: its identity. Behind them, -1.
template <int Dim>
std::array<std::array<Local, most_face_corners>, static_cast<std::size_t>(most_faces<Dim>)>
CellTable<Dim>::faces_of(Index row) const {
  std::array<Face, static_cast<std::size_t>(most_faces<Dim>)> faces;
  for (Face& face : faces) face.fill(-1);
  if (is_multilinear()) {
    const Rows tensor = corners_tensor(row);
    for (int face = 0; face < most_faces<Dim>; ++face) {
      int n = 0;
      for (int a = 0; a < corners<Dim>; ++a)
        if (((a >> (face / 2)) & 1) == face % 2) faces[face][n++] = tensor[a];
    }
  } else {
    const auto file = nodes_of(row);
    for (int face = 0; face < info(element()).faces; ++face)
      for (int k = 0; k < most_face_corners; ++k)
        if (const int corner = info(element()).face[face][k]; corner >= 0)
          faces[face][k] = file[corner];
  }
  for (Face& face : faces) std::sort(face.begin(), std::find(face.begin(), face.end(), -1));
  return faces;
}

/// Each face is looked at where its lowest node is: there are few faces around a node to compare.
template <int Dim>
void CellTable<Dim>::build_face_neighbours() {
  struct Side {
    Face nodes;
    Local cell;
    int face;
  };
  const auto n_cells = static_cast<std::size_t>(cell_ids_.size());
  face_neighbour_.resize(n_cells);
  for (auto& neighbours : face_neighbour_) neighbours.fill(-1);
  std::vector<std::array<Face, static_cast<std::size_t>(most_faces<Dim>)>> faces(n_cells);
  for (std::size_t c = 0; c < n_cells; ++c) faces[c] = faces_of(static_cast<Index>(c));
  std::vector<Side> around;
  for (Local n = 0; n < static_cast<Local>(nodes_.size()); ++n) {
    around.clear();
    for (Local c : node_cells_[n])
      for (int face = 0; face < info(element()).faces; ++face)
        if (faces[c][face][0] == n) around.push_back({faces[c][face], c, face});
    for (std::size_t i = 0; i < around.size(); ++i) {
      for (std::size_t j = i + 1; j < around.size(); ++j) {
        if (around[i].nodes != around[j].nodes) continue;
        Local& of_i = face_neighbour_[around[i].cell][around[i].face];
        Local& of_j = face_neighbour_[around[j].cell][around[j].face];
        if (of_i >= 0 || of_j >= 0) {
          throw InputError(fmt::format(
              "cells {}, {} and {} share one face; two at most can", cell_ids_.id(around[i].cell),
              cell_ids_.id(std::max(of_i, of_j)), cell_ids_.id(around[j].cell)));
        }
        of_i = around[j].cell;
        of_j = around[i].cell;
      }
    }
  }
}

template <int Dim>
std::vector<Local> CellTable<Dim>::ring(Index row) const {
  std::vector<Local> result;
  for (Local node : nodes_of(row))
    for (Local c : node_cells_[node])
      if (c != row) result.push_back(c);
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

template <int Dim>
std::vector<Index> CellTable<Dim>::neighbours(Index cell) const {
  std::vector<Index> result;
  for (Local row : ring(cell_row(cell))) result.push_back(cell_ids_.id(row));
  return result;
}

template <int Dim>
std::vector<Index> CellTable<Dim>::node_cells(Index node) const {
  std::vector<Index> result;
  for (Local row : node_cells_[node_row(node)]) result.push_back(cell_ids_.id(row));
  return result;
}

template std::array<int, 4> box_orientation<2>(const std::array<Vec<2>, 4>&);
template std::array<int, 8> box_orientation<3>(const std::array<Vec<3>, 8>&);

// Members in mesh_table_search.cpp and mesh_table_part.cpp are instantiated there.
template class CellTable<2>;
template class CellTable<3>;

}  // namespace lahar
