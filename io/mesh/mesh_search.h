/// \file Which cells hold points, in a mesh that a team has together.
#pragma once

#include <vector>

#include "io/mesh/shared_mesh.h"

namespace lahar {

/// Bins of the mesh (Mesh::bin_of()) are spread over the members, consecutive ones with about as
/// many cells for each, who has all cells that touch its bins.
template <int Dim>
class MeshSearch {
 public:
  /// Throws InputError where more than two cells share a face. Collective.
  MeshSearch(const Mesh<Dim>& share, const Team& team);

  /// As place() in particles_generator.h: the suggested cell (-1 = none) of each point if that
  /// contains it, else Mesh::locate() of the whole mesh. Collective.
  std::vector<Index> locate(const std::vector<Vec<Dim>>& x,
                            const std::vector<Index>& suggested) const;

 private:
  Index block(Index bin) const { return bin * n_blocks_ / n_bins_; }
  int holder(Index bin) const { return holder_[static_cast<std::size_t>(block(bin))]; }
  void share_out_bins(const Mesh<Dim>& share);
  std::vector<std::vector<std::byte>> fetch_own(const Mesh<Dim>& share) const;

  const Team& team_;
  Index n_bins_, n_blocks_;
  std::vector<int> holder_;  ///< of each block of bins
  Mesh<Dim> part_;
};

extern template class MeshSearch<2>;
extern template class MeshSearch<3>;

}  // namespace lahar
