/// \file The cut of a mesh into patches, and the local view that one patch has of the mesh.
#pragma once

#include <vector>

#include "physics/mesh.h"

namespace lahar {

/// The cut of a mesh into compact groups of about `target_cells` cells: bricks of nearly equal size
/// on a structured mesh (implicit, nothing stored per cell), recursive coordinate bisection of cell
/// centres otherwise (O(n log patches)). Holds a pointer to the mesh. Depends on mesh and target
/// alone. Patch ids run along a space-filling curve.
template <int Dim>
class Partition {
 public:
  /// Throws InputError unless target_cells > 0.
  Partition(const Mesh<Dim>& mesh, Index target_cells);

  Index n_patches() const;
  Index patch_of(Index cell) const;
  std::vector<Index> cells(Index patch) const;  ///< ascending
  /// Patches whose node sets, each widened by `rings` layers of cells, intersect this one's;
  /// ascending, without itself. Symmetric. Proportional to the patch.
  std::vector<Index> neighbours(Index patch, int rings = 0) const;
  /// Structured meshes only: the cells low[d] <= position along d < high[d] of a patch.
  struct Brick {
    std::array<Index, Dim> low, high;
  };
  Brick brick(Index patch) const;
  std::vector<Index> cells_in(const Brick& brick) const;  ///< ascending
  /// Structured meshes only: patches with cells that are no more than `distance` cells away, along
  /// every axis, from some of a brick; ascending.
  std::vector<Index> patches_near(const Brick& cells, Index distance) const;

 private:
  void cut_bricks(Index target_cells);
  void cut_cells(Index target_cells);
  std::array<Index, Dim> brick_position(Index brick) const;
  std::vector<Index> near_patches(Index patch, int rings) const;

  const Mesh<Dim>* mesh_;
  // Structured: cells and bricks along each axis, and the curve order of bricks.
  std::array<Index, Dim> counts_{}, bricks_{};
  std::vector<Index> brick_to_patch_, patch_to_brick_;
  // Tables: patch of each cell and the cells of each patch (compressed rows).
  std::vector<Local> patch_of_cell_;
  std::vector<Index> first_cell_, cells_;
};

/// One patch's own numbering of cells and nodes. Local nodes are those of its cells plus `rings`
/// layers of cells around them, ascending by global id; so are local cells (own cells only).
template <int Dim>
struct PatchTopology {
  Index patch = -1;
  std::vector<Index> cells;  ///< global id of each local cell, ascending
  std::vector<Index> nodes;  ///< global id of each local node, ascending
  std::vector<std::array<Local, corners<Dim>>> corner_nodes;  ///< per local cell, tensor order
  std::vector<Index> neighbours;                              ///< patch ids, ascending

  /// Shared nodes: for local node shared_node[s], the contributions to sum, in ascending patch id
  /// and *including this patch itself*, are entries first[s] .. first[s+1].
  std::vector<Local> shared_node;
  std::vector<Local> first;
  struct Share {
    Local neighbour;  ///< position in `neighbours`; -1 = this patch
    Local node;       ///< local node there
  };
  std::vector<Share> shares;

  /// True for nodes counted by this patch in global sums: the lowest patch id that holds the node.
  std::vector<char> owned;
};

/// Build the local view of `patch` as far as it needs no other patch (everything but the shares).
template <int Dim>
PatchTopology<Dim> make_topology(const Mesh<Dim>& mesh, const Partition<Dim>& partition,
                                 Index patch, int rings = 0);

/// Fill shared_node, first, shares and owned of every patch in `patches` (ascending patch id);
/// neighbours that are not in the list contribute nothing and are dropped. O(total nodes). All
/// topologies must have been made with the same number of rings.
template <int Dim>
void connect(std::vector<PatchTopology<Dim>*>& patches);

extern template class Partition<2>;
extern template class Partition<3>;
extern template PatchTopology<2> make_topology(const Mesh<2>&, const Partition<2>&, Index, int);
extern template PatchTopology<3> make_topology(const Mesh<3>&, const Partition<3>&, Index, int);
extern template void connect(std::vector<PatchTopology<2>*>&);
extern template void connect(std::vector<PatchTopology<3>*>&);

}  // namespace lahar
