/// \file The coarse nodes of all patches of all ranks: a multigrid cycle below the patches' own
/// nodes.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "runtime/patches/patch_set.h"
#include "runtime/solve/coarse_levels.h"

namespace lahar {

/// Every rank has the matrix of the coarse nodes, which are few, and does the same with it. What it
/// needs of patches are sums of residuals: of integers, so that their bits depend neither on ranks
/// nor on an order. They are as exact as a preconditioner has to be.
template <int Dim>
class CoarseGrid {
 public:
  CoarseGrid(PatchSet<Dim>& patches, const Communicator& ranks, int threads)
      : patches_(patches), ranks_(ranks), threads_(threads) {}

  /// From Patch::system, whose SolverVectors::inverse is known; all patches have as many unknowns
  /// per node. NodalSystem::rough_blocks are set, too. False, on all ranks, where this is not the
  /// way: cells of very different sizes, or more coarse nodes than every rank can have. Collective,
  /// between rounds.
  bool set_up(bool is_scalar);
  /// For SolverOrder::of_coarse_nodes.
  const double* solution() const { return levels_->solution().data(); }

  /// This rank's sums of CoarseNodes::sums, as multiples of scale / 2^46; as many on all ranks.
  std::span<const Index> give(double scale);
  /// A cycle for the sums of all ranks: solution().
  void take(std::span<const Index> sums, double scale);

 private:
  Lattice<Dim> lattice() const;
  Vec<Dim> spacing() const;

  PatchSet<Dim>& patches_;
  Communicator ranks_;
  int threads_;
  int width_ = Dim;
  std::unique_ptr<CoarseLevels<Dim>> levels_;
  std::vector<Index> sums_;
};

extern template class CoarseGrid<2>;
extern template class CoarseGrid<3>;

}  // namespace lahar
