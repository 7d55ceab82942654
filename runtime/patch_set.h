/// \file The patches that exist: those with particles, and empty ones where
/// particles may soon be.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "graph/stage.h"
#include "physics/patch.h"
#include "runtime/initial_particles.h"
#include "runtime/rank_partition.h"

namespace lahar {

template <int Dim>
class PatchSet {
 public:
  /// Cut the mesh, place the model's particles in their patches (and release the model's table), on
  /// up to `threads` threads (0 = all).
  PatchSet(Model<Dim>& model, int support_rings, NodeSumCopies copies, int threads = 1);
  /// The same where the census is that of the particles of all ranks.
  PatchSet(Model<Dim>& model, const ParticleCensus& census, int support_rings, NodeSumCopies copies,
           int threads);

  const Partition<Dim>& partition() const { return partition_; }
  int size() const { return static_cast<int>(patches_.size()); }
  Patch<Dim>& operator[](int i) { return *patches_[static_cast<std::size_t>(i)]; }
  const Patch<Dim>& operator[](int i) const { return *patches_[static_cast<std::size_t>(i)]; }

  /// Positions of the patches that each patch exchanges with, ascending.
  std::vector<std::vector<int>> neighbours() const;
  /// Drop patches far from particles, create those that are near; to be called before max_lead
  /// steps after Patch::needs_surroundings. No particle may be on its way. Patches whose work
  /// no history row has yet stay, so that rows do not depend on when this is called.
  void rebuild();

  /// Patches, particles and shared nodes as a partition over ranks sees them.
  PatchGraph graph() const;
  Index particles() const;
  std::size_t bytes() const;
  /// Cells per patch that the partition aims at.
  Index target_cells() const { return target_cells_; }

 private:
  using Patches = std::vector<std::unique_ptr<Patch<Dim>>>;
  using Brick = typename Partition<Dim>::Brick;
  std::unique_ptr<Patch<Dim>> make_patch(Index id) const;
  void distribute(Model<Dim>& model, int threads);
  std::vector<Index> needed(std::span<const Brick> filled) const;
  std::vector<char> watched_cells(const Patch<Dim>& patch, std::span<const Index> existing) const;
  void link();

  const Model<Dim>* model_;
  Index target_cells_;
  Partition<Dim> partition_;
  int rings_;
  NodeSumCopies copies_;
  ColumnLayout<Dim> layout_;
  double least_mass_ = 0;  ///< Patch::least_mass
  Patches patches_;        ///< ascending patch id
};

extern template class PatchSet<2>;
extern template class PatchSet<3>;

}  // namespace lahar
