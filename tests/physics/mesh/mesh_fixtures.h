/// \file Small meshes from tables, and random points, for the tests of mesh and partition.
#pragma once

#include <algorithm>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "physics/mesh/mesh.h"

namespace lahar::test {

inline double uniform(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<>(low, high)(random);
}

template <int Dim>
Vec<Dim> random_point(std::mt19937& random, const Vec<Dim>& low, const Vec<Dim>& high) {
  Vec<Dim> x;
  for (int d = 0; d < Dim; ++d) x[d] = uniform(random, low[d], high[d]);
  return x;
}

template <int Dim>
struct Tables {
  std::vector<Vec<Dim>> nodes;
  std::vector<std::array<Index, corners<Dim>>> cells;

  Mesh<Dim> mesh(bool isoparametric) const {
    return Mesh<Dim>::from_tables(nodes, cells, isoparametric);
  }
};

/// The tables of a structured mesh.
template <int Dim>
Tables<Dim> tables_of(const Mesh<Dim>& mesh) {
  Tables<Dim> t;
  for (Index n = 0; n < mesh.n_nodes(); ++n) t.nodes.push_back(mesh.node(n));
  for (Index c = 0; c < mesh.n_cells(); ++c) t.cells.push_back(mesh.cell_nodes(c));
  return t;
}

/// Unit cells along every axis.
template <int Dim>
Tables<Dim> grid_tables(const std::array<Index, Dim>& counts) {
  return tables_of(Mesh<Dim>::structured(Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts));
}

/// Move every node by up to `amount` along each axis.
template <int Dim>
Tables<Dim> distorted(Tables<Dim> t, double amount, std::mt19937& random) {
  for (auto& x : t.nodes)
    x += random_point<Dim>(random, -amount * Vec<Dim>::Ones(), amount * Vec<Dim>::Ones());
  return t;
}

/// Number the cells in random order.
template <int Dim>
Tables<Dim> shuffled(Tables<Dim> t, std::mt19937& random) {
  std::shuffle(t.cells.begin(), t.cells.end(), random);
  return t;
}

/// Start the file order of every cell at another corner of its bottom face.
template <int Dim>
Tables<Dim> rotated_file_order(Tables<Dim> t) {
  for (auto& cell : t.cells)
    for (auto layer = cell.begin(); layer != cell.end(); layer += 4)
      std::rotate(layer, layer + 1, layer + 4);
  return t;
}

/// One cell with corners in file order.
template <int Dim>
Mesh<Dim> one_cell(const std::vector<Vec<Dim>>& corner) {
  Tables<Dim> t{corner, {{}}};
  for (int k = 0; k < corners<Dim>; ++k) t.cells[0][k] = k;
  return t.mesh(true);
}

template <int Dim>
std::set<Index> widened_nodes(const Mesh<Dim>& mesh, const std::vector<Index>& cells, int rings) {
  std::set<Index> nodes;
  for (Index c : cells)
    for (Index n : mesh.cell_nodes(c)) nodes.insert(n);
  for (int r = 0; r < rings; ++r) {
    auto wider = nodes;
    for (Index n : nodes)
      for (Index c : mesh.node_cells(n))
        for (Index m : mesh.cell_nodes(c)) wider.insert(m);
    nodes = std::move(wider);
  }
  return nodes;
}

}  // namespace lahar::test
