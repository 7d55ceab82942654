/// \file The patches that exist: those with particles, and empty ones where
/// particles may soon be.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "graph/executor.h"
#include "io/base/memory_limit.h"
#include "physics/particles/patch.h"
#include "runtime/comm/communicator.h"
#include "runtime/patches/changed_particles.h"
#include "runtime/patches/directory_lists.h"
#include "runtime/patches/initial_particles.h"
#include "runtime/patches/patch_filling.h"
#include "runtime/patches/patch_renumbering.h"
#include "runtime/patches/rank_partition.h"
#include "runtime/patches/shared_cut.h"
#include "runtime/patches/simulation_state.h"
#include "runtime/patches/sum_message.h"

namespace lahar {

/// A particle that comes so near to a patch that does not exist is noticed when it has changed its
/// cell. It crosses at most one cell in each of the max_lead steps that may pass before a rebuild.
constexpr Index watch_distance = max_lead + 1;

/// A patch of another rank with which patches of this one exchange: what its messages bring, where
/// the kernels look for it.
template <int Dim>
struct RemotePatch {
  Index patch = -1;
  int rank = -1;
  std::vector<Local> nodes;  ///< of its own that it shares with patches of this rank, ascending
  /// By message and parity of the step: a line for the message's header, then for each array of
  /// the message one for each of these nodes, as in Patch::sums.
  std::array<std::array<NodeArray, 2>, n_node_sums> sums;
  std::array<char, 2> contributes{};
  std::vector<Outbox<Dim>> outbox;  ///< to patches of this rank
  bool filled = false;              ///< some outbox is
  std::vector<Index> outbox_patch;  ///< their ids, ascending
};

/// What an own patch sends to another rank.
struct RemoteNeighbour {
  int rank;
  std::vector<Local> nodes;       ///< shared with patches of that rank, ascending
  std::vector<Local> neighbours;  ///< positions of those patches in PatchTopology::neighbours
};

/// With several ranks each has some of the patches, and functions that change the set are
/// collective.
template <int Dim>
class PatchSet {
 public:
  /// Cut the mesh, place the model's particles in their patches (and release the model's table), on
  /// up to `threads` threads (0 = all). Several ranks: tables with ids are shares, which together
  /// have all particles; if no rank's has, each has the table of all, and takes its share of it. Of
  /// meshes from tables each rank has a share (shared_mesh.h), or all of it. Of what is said of
  /// nodes and cells each rank keeps its part (directory_lists.h).
  PatchSet(Model<Dim>& model, int support_rings, NodeSumCopies copies, int threads = 1,
           Communicator ranks = {}, SumMessages messages = {}, const MemoryLimit& memory = {});
  /// The same cut, with the patches of a state instead of the model's particles, which are
  /// released; of several ranks, each takes a share of them. Throws InputError where the state is
  /// not one of this model.
  PatchSet(Model<Dim>& model, int support_rings, NodeSumCopies copies, const SimulationState& state,
           int threads = 1, Communicator ranks = {}, SumMessages messages = {},
           const MemoryLimit& memory = {});

  const Partition<Dim>& partition() const { return partition_; }
  const Mesh<Dim>& mesh() const { return *model_->mesh; }
  /// Patches of this rank.
  int size() const { return static_cast<int>(patches_.size()); }
  Patch<Dim>& operator[](int i) { return *patches_[static_cast<std::size_t>(i)]; }
  const Patch<Dim>& operator[](int i) const { return *patches_[static_cast<std::size_t>(i)]; }

  /// Positions of the patches that each patch exchanges with, ascending ids. Those of other ranks
  /// count on from size(); they have a list, too, which is empty.
  std::vector<std::vector<int>> neighbours() const;
  /// Patches of other ranks that own ones exchange with, ascending ids.
  std::vector<RemotePatch<Dim>>& elsewhere() { return elsewhere_; }
  const std::vector<RemotePatch<Dim>>& elsewhere() const { return elsewhere_; }
  /// The ranks that a patch sends to, ascending.
  const std::vector<RemoteNeighbour>& sends(int i) const {
    return sends_[static_cast<std::size_t>(i)];
  }
  /// All patches of all ranks, ascending ids, and who has them.
  const std::vector<Index>& all_patches() const { return all_; }
  const std::vector<int>& owners() const { return owner_; }
  /// Where links find the sums of patches of other ranks.
  const SumMessages& sum_messages() const { return messages_; }
  /// Drop patches far from particles, create those that are near; to be called before max_lead
  /// steps after Patch::needs_surroundings. No particle may be on its way. Patches whose work
  /// no history row has yet stay, so that rows do not depend on when this is called.
  void rebuild();

  /// Split patches with more than `most` particles (choose_splits()), between two steps, and tell
  /// the ids that follow; rebuild() must be next. The parts' particles are in an order that depends
  /// on that of the patch only; their sums are still to be mapped. Collective.
  PatchRenumbering split(Index most);
  const std::vector<PatchSplit>& splits() const { return splits_; }  ///< since the start

  /// Give patches to other ranks, `owner` of each of all_patches(), between two steps. Collective.
  void give_to(const std::vector<int>& owner, Index step);

  /// Patches, particles and shared nodes as a partition over ranks sees them.
  PatchGraph graph() const;
  Index particles() const;
  std::size_t bytes() const;
  /// Cells per patch that the partition aims at.
  Index target_cells() const { return target_cells_; }
  /// What the beginning of a stage did to particles; nothing in other runs.
  const ChangedParticles& changed() const { return changed_; }
  double least_mass() const { return least_mass_; }  ///< Patch::least_mass [kg]
  /// For the first particle that comes in addition to the model's.
  Index next_id() const { return census_.next_id; }
  const ColumnLayout<Dim>& layout() const { return layout_; }

 private:
  using Patches = std::vector<std::unique_ptr<Patch<Dim>>>;
  using Brick = typename Partition<Dim>::Brick;
  PatchTopology<Dim> topology_of(Index id) const;
  std::unique_ptr<Patch<Dim>> make_patch(Index id) const;
  void set_conditions();
  std::vector<Brick> filled_bricks(const RowsByPatch& rows, int threads) const;
  /// Throws InputError, on all ranks, where this rank's patches would take more memory than it may:
  /// `occupied` of them (ascending), with these particles, have it for nodes as well. Collective.
  void need_memory(std::span<const Index> ids, std::span<const Index> occupied,
                   Index particles) const;
  void distribute(Model<Dim>& model, int threads);
  void share_patches(const std::vector<Index>& particles);
  bool shares_mesh() const { return ranks_.several() && !model_->mesh->is_structured(); }
  void distribute_shared(Model<Dim>& model);
  void restore_shared(const SimulationState& state);
  std::unique_ptr<SharedCut<Dim>> make_cut(const Team& team);
  void keep_own_mesh(const SharedCut<Dim>& cut);
  void choose_owners(const SimulationState& state);
  void exchange_mesh(const std::vector<int>& owner);
  void restore(Model<Dim>& model, const SimulationState& state, int threads);
  /// Put the rows of the model's table, which are new, into their patches. Collective.
  void place_rows(Model<Dim>& model, int threads);
  std::vector<Brick> injected_bricks() const;
  std::vector<Index> needed(std::span<const Brick> filled) const;
  std::vector<Index> of_all_ranks(const std::vector<Index>& ids) const;
  int owner_of(Index id) const;
  std::vector<Index> own_patches() const;
  std::vector<char> find_halo_edge_cells(const Patch<Dim>& patch) const;
  void arrange(std::vector<Index> ids);
  void link();
  std::vector<char> connect_changed();
  void link_own(Patch<Dim>& patch);
  void link_elsewhere(Patch<Dim>& patch, RemotePatch<Dim>& other);
  template <class Body>
  void for_each_share_elsewhere(Body&& body);
  void mirror_nodes();
  void find_sends();
  void renumber(const PatchRenumbering& ids);
  Patches parts_of(Patch<Dim>& patch, Index first, Index n) const;

  Model<Dim>* model_;   ///< whose mesh is this rank's part where there are several
  MemoryLimit memory_;  ///< the same on all ranks
  ParticleCensus census_;
  Index target_cells_;
  Partition<Dim> partition_;
  InjectedCells<Dim> injected_;  ///< that this rank keeps
  int rings_;
  NodeSumCopies copies_;
  ColumnLayout<Dim> layout_;
  double least_mass_ = 0;  ///< Patch::least_mass
  Communicator ranks_;
  SumMessages messages_;
  Patches patches_;  ///< of this rank, ascending patch id
  std::vector<Index> all_;
  std::vector<int> owner_;
  std::vector<RemotePatch<Dim>> elsewhere_;
  bool renumbered_ = false;   ///< ids of patches are others than when they were linked
  bool all_changed_ = false;  ///< all_ is another one than when patches were linked
  std::vector<std::vector<RemoteNeighbour>> sends_;
  std::vector<PatchSplit> splits_;
  ChangedParticles changed_;
};

/// How many nodes a patch shares with each of its neighbours.
template <int Dim>
std::vector<Index> shared_nodes(const PatchTopology<Dim>& topology);

extern template class PatchSet<2>;
extern template class PatchSet<3>;

}  // namespace lahar
