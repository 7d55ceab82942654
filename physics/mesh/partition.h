/// \file The cut of a mesh into patches, and the local view that one patch has of the mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "physics/base/id_map.h"
#include "physics/mesh/mesh.h"

namespace lahar {

/// A cut of one patch in two: of its cells those before `at` along an axis stay patch `patch`, the
/// others become patch + 1, and larger ids grow by one. So ids go on without gaps along the curve,
/// parts of a patch lie where the patch was, and two patches that were not split keep their order:
/// sums over patches in ascending id, chunks of the curve and tables by id need to know nothing of
/// splits. (Ids that never change would need either gaps, whose size bounds how often a patch can
/// be split, or an order beside the ids.) What is kept by id is renumbered when patches are split.
struct PatchSplit {
  Index patch = 0;
  Index axis = 0;
  /// Structured: the position along the axis of the first layer of cells of patch + 1. Tables: its
  /// first cell, by the position of centres and, where they are level, by id.
  Index at = 0;
  bool operator==(const PatchSplit&) const = default;
};

/// The cut of a mesh into compact groups of about `target_cells` cells: bricks of nearly equal size
/// on a structured mesh (implicit, nothing stored per cell), recursive coordinate bisection of cell
/// centres otherwise (O(n log patches)). Holds a pointer to the mesh. Depends on mesh and target
/// alone, until patches are split. Patch ids run along a space-filling curve.
///
/// A partition of a mesh from tables may be a *part*: it knows the cells of some patches only.
/// Patch ids and n_patches() are the whole partition's; asking for the cells or neighbours of a
/// patch that it does not hold is a mistake of the caller's (an assertion).
template <int Dim>
class Partition {
 public:
  /// Throws InputError unless target_cells > 0.
  Partition(const Mesh<Dim>& mesh, Index target_cells);
  /// Cells of a patch, ascending.
  using Row = std::pair<Index, std::span<const Local>>;
  /// A part of a cut of a mesh from tables that someone else made: these patches (ascending) of
  /// n_patches.
  Partition(const Mesh<Dim>& mesh, Index n_patches, std::span<const Row> rows);

  /// These patches (ascending, held here) and those in pieces that pack() made of other parts of
  /// the same partition, over a mesh that holds their cells. The result depends on the patches
  /// alone. On a structured mesh: the whole partition. Throws std::invalid_argument where a piece
  /// is damaged or of another partition.
  Partition part(const Mesh<Dim>& mesh, std::span<const Index> patches,
                 std::span<const std::vector<std::byte>> pieces = {}) const;
  /// Patches held here (ascending), for another process of the same run. Nothing on a structured
  /// mesh.
  std::vector<std::byte> pack(std::span<const Index> patches) const;
  bool holds(Index patch) const;
  std::size_t bytes() const;  ///< of memory that the arrays take
  /// Split patches, one after the other; all parts of a partition are to be split alike. Throws
  /// std::invalid_argument for what does not leave cells on both sides, before anything is changed.
  void split(std::span<const PatchSplit> splits);

  Index n_patches() const;
  Index patch_of(Index cell) const;             ///< -1 if this part does not hold it
  std::vector<Index> cells(Index patch) const;  ///< ascending
  /// Patches whose node sets, each widened by `rings` layers of cells, intersect this one's;
  /// ascending, without itself. Symmetric. Proportional to the patch. In a part: all for a patch
  /// whose neighbours it holds, else those that it holds.
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
  Partition(const Mesh<Dim>& mesh, const Partition& whole);
  void cut_bricks(Index target_cells);
  void cut_cells(Index target_cells);
  std::array<Index, Dim> brick_position(Index brick) const;
  Brick whole_brick(Index brick) const;
  void split_bricks(std::span<const PatchSplit> splits);
  void split_rows(std::span<const PatchSplit> splits);
  std::vector<Index> near_patches(Index patch, int rings) const;
  std::span<const Local> row_of(Index patch) const;
  void note_patches();
  void hold(std::span<const Row> patches);

  const Mesh<Dim>* mesh_;
  // Structured: cells and bricks along each axis, and the curve order of bricks. A brick that was
  // split is several patches, of which brick_to_patch_ has the first.
  std::array<Index, Dim> counts_{}, bricks_{};
  std::vector<Index> brick_to_patch_, patch_to_brick_;
  std::unordered_map<Index, std::vector<Brick>> parts_;  ///< of bricks that were split, by id
  // Tables: the patches held and the cells of each (compressed rows), and the patch of each cell.
  Index n_patches_ = 0;
  IdMap patch_ids_, cell_ids_;
  std::vector<Index> first_cell_;
  std::vector<Local> cells_;
  std::vector<Local> patch_of_cell_;
};

/// The patches that a process with these patches has to do with: themselves and all neighbours;
/// ascending.
template <int Dim>
std::vector<Index> surrounding_patches(const Partition<Dim>& partition,
                                       std::span<const Index> patches, int rings = 0);

/// The cells that a process with these patches needs, ascending: those of surrounding_patches(),
/// what lies around these (as many layers as nodes of patches are widened by, at least one), and
/// Mesh::cells_near() the patches' own cells. A part of the mesh with these cells, and of the
/// partition with those patches, has for the patches the topology of the whole, and for their
/// neighbours the cells and nodes; it finds particles that leave the patches' cells as the whole
/// mesh does; and it gives the same answer as the whole to this question, also for some of the
/// patches. The union of these answers for single patches is the answer for all. Nothing if the
/// mesh is structured.
template <int Dim>
std::vector<Index> surrounding_cells(const Mesh<Dim>& mesh, const Partition<Dim>& partition,
                                     std::span<const Index> patches, int rings = 0);

/// One patch's own numbering of cells and nodes. Local nodes are those of its cells plus `rings`
/// layers of cells around them, ascending by global id; so are local cells (own cells only).
template <int Dim>
struct PatchTopology {
  Index patch = -1;
  std::vector<Index> cells;  ///< global id of each local cell, ascending
  std::vector<Index> nodes;  ///< global id of each local node, ascending
  /// Per local cell, tensor order; of multilinear meshes.
  std::vector<std::array<Local, corners<Dim>>> corner_nodes;
  std::vector<Index> neighbours;  ///< patch ids, ascending

  /// Nodes whose functions may not be zero in a cell, support_size per local cell in the order of
  /// the basis (basis.h); none for linear functions, whose nodes are corner_nodes. Nodes beyond the
  /// mesh are stood in for by others: their functions are zero.
  std::vector<Local> support_nodes;
  int support_size = 0;
  /// Bases of more than the cell's nodes, by local cell: bit 2 d (2 d + 1) = first (last) along
  /// axis d.
  std::vector<std::uint8_t> support_border;
  /// Tensor bases in 3D, by local cell: its nodes are those of the local cell before, moved by one
  /// along the first axis.
  std::vector<std::uint8_t> support_follows;
  std::span<const Local> support(std::size_t cell) const {
    const auto size = static_cast<std::size_t>(support_size);
    return std::span(support_nodes).subspan(cell * size, size);
  }
  /// The nodes of the mesh that a local cell has.
  std::span<const Local> element_nodes(std::size_t cell) const {
    if (corner_nodes.empty()) return support(cell);
    return corner_nodes[cell];
  }

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
/// The same for those whose `fill` is not 0 alone; the others must have all neighbours of them.
template <int Dim>
void connect(std::vector<PatchTopology<Dim>*>& patches, const std::vector<char>& fill);

extern template class Partition<2>;
extern template class Partition<3>;
#define LAHAR_EXTERN(Dim)                                                                       \
  extern template std::vector<Index> surrounding_patches(const Partition<Dim>&,                 \
                                                         std::span<const Index>, int);          \
  extern template std::vector<Index> surrounding_cells(const Mesh<Dim>&, const Partition<Dim>&, \
                                                       std::span<const Index>, int);
LAHAR_EXTERN(2)
LAHAR_EXTERN(3)
#undef LAHAR_EXTERN
extern template PatchTopology<2> make_topology(const Mesh<2>&, const Partition<2>&, Index, int);
extern template PatchTopology<3> make_topology(const Mesh<3>&, const Partition<3>&, Index, int);
extern template void connect(std::vector<PatchTopology<2>*>&);
extern template void connect(std::vector<PatchTopology<3>*>&);

}  // namespace lahar
