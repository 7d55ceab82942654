/// \file The cut of a mesh into patches, and the local view that one patch has of the mesh.
#pragma once

#include <vector>

#include "physics/mesh.h"

namespace lahar {

/// The cut of a mesh into compact groups of about `target_cells` cells: bricks of nearly equal size
/// on a structured mesh (implicit, nothing stored per cell), recursive coordinate bisection of cell
/// centres otherwise. Depends on mesh and target alone. Patch ids run along a space-filling curve.
template <int Dim>
class Partition {
 public:
  Partition(const Mesh<Dim>& mesh, Index target_cells);

  Index n_patches() const;
  Index patch_of(Index cell) const;
  std::vector<Index> cells(Index patch) const;  ///< ascending
  /// Patches whose node sets, each widened by `rings` layers of cells, intersect this one's;
  /// ascending, without itself. Symmetric.
  std::vector<Index> neighbours(Index patch, int rings = 0) const;
  /// Smallest number of cells that a patch has along an axis; a bound on the steps that a particle
  /// needs to cross it. Unstructured meshes: 1.
  Index min_width() const;

 private:
  const Mesh<Dim>* mesh_;
  // Structured: bricks along each axis, and the curve order of bricks.
  std::array<Index, Dim> bricks_{};
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
/// neighbours that are not in the list contribute nothing and are dropped. O(total nodes).
template <int Dim>
void connect(std::vector<PatchTopology<Dim>*>& patches);

extern template class Partition<2>;
extern template class Partition<3>;

}  // namespace lahar
