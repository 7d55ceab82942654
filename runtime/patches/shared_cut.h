/// \file The cut into patches of a mesh that ranks have shares of.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "io/mesh/shared_mesh.h"
#include "physics/mesh/partition.h"

namespace lahar {

/// The same patches as Partition makes of the whole mesh: each rank knows the patch of each cell of
/// its share. All functions but n_patches() are collective.
template <int Dim>
class SharedCut {
 public:
  SharedCut(const Mesh<Dim>& share, Index target_cells, const Team& team);

  Index n_patches() const { return n_patches_; }
  /// As Partition::split().
  void split(std::span<const PatchSplit> splits);
  std::vector<Index> patches_of(const std::vector<Index>& cells) const;

  /// What a rank needs with some patches (surrounding_cells(), surrounding_patches()): its part of
  /// the mesh, and of the partition.
  struct Around {
    std::shared_ptr<const Mesh<Dim>> mesh;
    Partition<Dim> partition;
  };
  Around around(const std::vector<Index>& patches, int rings) const;

 private:
  /// All ascending.
  struct Surroundings {
    std::vector<Index> own, ring;            ///< cells of the patches, and with a layer around
    std::vector<Index> patches, of_patches;  ///< around, and their cells
    std::vector<Index> cells;                ///< that are needed
  };
  Surroundings find_surroundings(const std::vector<Index>& patches, int rings) const;
  std::vector<Index> cells_near(const Surroundings& found) const;

  const Mesh<Dim>& share_;
  const Team& team_;
  Index n_patches_;
  Index first_;               ///< cell of the share
  std::vector<Local> patch_;  ///< of each cell of the share
};

extern template class SharedCut<2>;
extern template class SharedCut<3>;

}  // namespace lahar
