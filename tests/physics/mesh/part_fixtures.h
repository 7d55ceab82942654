/// \file Meshes from tables, cut into patches that several ranks own, for the tests of parts.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <memory>

#include "physics/mesh/partition.h"
#include "tests/physics/mesh/mesh_fixtures.h"

namespace lahar::test {

/// Displace the nodes by a smooth map, without folding.
template <int Dim>
Tables<Dim> mapped(Tables<Dim> t, const std::function<Vec<Dim>(const Vec<Dim>&)>& map) {
  for (auto& x : t.nodes) x = map(x);
  return t;
}

/// Without the cells whose centre is in a box.
template <int Dim>
Tables<Dim> with_hole(Tables<Dim> t, const Vec<Dim>& low, const Vec<Dim>& high) {
  std::erase_if(t.cells, [&](const auto& cell) {
    Vec<Dim> centre = Vec<Dim>::Zero();
    for (Index n : cell) centre += t.nodes[n] / corners<Dim>;
    return (centre.array() > low.array()).all() && (centre.array() < high.array()).all();
  });
  return t;
}

/// Meshes in which a cell's neighbourhood looks different: boxes, boxes that overlap and leave gaps
/// as far as six digits allow, random corners, cells of very different size, inclined layers, and a
/// hole.
template <int Dim>
std::vector<Mesh<Dim>> sample_meshes(std::mt19937& random) {
  std::array<Index, Dim> counts;
  counts.fill(Dim == 2 ? 16 : 9);
  counts[0] = Dim == 2 ? 36 : 24;
  const auto grid = shuffled<Dim>(grid_tables<Dim>(counts), random);
  const auto graded = [](const Vec<Dim>& x) -> Vec<Dim> {
    Vec<Dim> y = x;
    y[0] = 0.02 * x[0] * x[0] + 0.05 * x[0];
    return y;
  };
  const auto inclined = [](const Vec<Dim>& x) -> Vec<Dim> {
    Vec<Dim> y = x;
    y[1] += 1.5 * x[0] + std::sin(0.3 * x[0]);
    return y;
  };
  std::vector<Mesh<Dim>> meshes;
  meshes.push_back(grid.mesh(false));
  meshes.push_back(distorted<Dim>(grid, 3e-6, random).mesh(false));
  meshes.push_back(distorted<Dim>(grid, 0.15, random).mesh(true));
  meshes.push_back(mapped<Dim>(grid, graded).mesh(false));
  meshes.push_back(mapped<Dim>(distorted<Dim>(grid, 0.1, random), inclined).mesh(true));
  const Vec<Dim> low = 3.0 * Vec<Dim>::Ones(), high = 6.5 * Vec<Dim>::Ones();
  meshes.push_back(with_hole<Dim>(distorted<Dim>(grid, 0.1, random), low, high).mesh(true));
  return meshes;
}

/// The patches of each rank: consecutive ones but for some that are anywhere.
inline std::vector<std::vector<Index>> random_owners(Index n_patches, int ranks,
                                                     std::mt19937& random) {
  std::vector<std::vector<Index>> own(ranks);
  for (Index p = 0; p < n_patches; ++p) {
    const bool stray = random() % 40 == 0;
    own[stray ? random() % ranks : p * ranks / n_patches].push_back(p);
  }
  return own;
}

using Pieces = std::vector<std::vector<std::byte>>;

/// Parts of mesh and partition, as a rank holds them.
template <int Dim>
struct Part {
  Part(const Mesh<Dim>& from, const Partition<Dim>& cut, const std::vector<Index>& own, int rings,
       const Pieces& cells = {}, const Pieces& patches = {})
      : held(std::make_unique<Mesh<Dim>>(
            from.part(surrounding_cells(from, cut, own, rings), cells))),
        mesh(*held),
        partition(cut.part(mesh, surrounding_patches(cut, own, rings), patches)) {}
  /// After patches moved: what is needed of `old` for the patches kept, and what others packed.
  Part(const Part& old, const std::vector<Index>& kept, const Pieces& cells, const Pieces& patches,
       int rings)
      : Part(old.mesh, old.partition, kept, rings, cells, patches) {}

  std::unique_ptr<Mesh<Dim>> held;
  const Mesh<Dim>& mesh;
  Partition<Dim> partition;
};

template <int Dim>
std::vector<Index> held_cells(const Mesh<Dim>& mesh) {
  std::vector<Index> cells;
  for (Index c = 0; c < mesh.n_cells(); ++c)
    if (mesh.holds(c)) cells.push_back(c);
  return cells;
}

template <int Dim>
std::vector<Index> held_patches(const Partition<Dim>& partition) {
  std::vector<Index> patches;
  for (Index p = 0; p < partition.n_patches(); ++p)
    if (partition.holds(p)) patches.push_back(p);
  return patches;
}

}  // namespace lahar::test
