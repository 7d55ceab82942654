#include "runtime/step/checkpoint_stager.h"

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "runtime/patches/patch_state.h"

namespace lahar {

template <int Dim>
std::size_t CheckpointStager<Dim>::bytes() const {
  std::size_t bytes = 0;
  for (int i = 0; i < patches_.size(); ++i)
    if (has_state(patches_[i])) bytes += packed_bytes(patches_[i]);
  return bytes;
}

template <int Dim>
SimulationState CheckpointStager<Dim>::present(RunState run, Index removed,
                                               const Communicator& ranks) const {
  run.particles = ranks.sum(patches_.particles());
  run.removed = removed;
  SimulationState state{.run = std::move(run), .patches = {}, .sizes = {}, .bytes = {}};
  std::vector<int> position;
  for (int i = 0; i < patches_.size(); ++i) {
    if (!has_state(patches_[i])) continue;
    position.push_back(i);
    state.patches.push_back(patches_[i].topology.patch);
    state.sizes.push_back(static_cast<Index>(packed_bytes(patches_[i])));
  }
  state.bytes = [this, position, step = state.run.step](std::size_t i) {
    return pack(patches_[position[i]], step);
  };
  return state;
}

template <int Dim>
void CheckpointStager<Dim>::begin(Step step, bool copies, Index removed,
                                  const Communicator& ranks) {
  begun_ = step;
  copies_ = copies;
  for (auto& states : copied_) states.assign(static_cast<std::size_t>(patches_.size()), {});
  if (!copies) return;
  particles_ = ranks.sum(patches_.particles());
  removed_ = removed;
}

template <int Dim>
void CheckpointStager<Dim>::copy(int patch, Step at) {
  if (has_state(patches_[patch]))
    copied_[at][static_cast<std::size_t>(patch)] = pack(patches_[patch], at);
}

template <int Dim>
void CheckpointStager<Dim>::set_run(RunState run) {
  run_ = std::move(run);
  run_.particles = particles_;
  run_.removed = removed_;
}

template <int Dim>
SimulationState CheckpointStager<Dim>::take(Step at, double dt_limit,
                                            std::vector<RigidBodyState> bodies,
                                            const InjectionLog& log) {
  SimulationState state{.run = run_, .patches = {}, .sizes = {}, .bytes = {}, .copied = true};
  state.run.dt_limit = dt_limit;
  state.run.rigid_bodies = std::move(bodies);
  const auto copies = std::make_shared<std::vector<std::vector<std::byte>>>(std::move(copied_[at]));
  copied_[at].assign(copies->size(), {});
  std::vector<std::size_t> position;
  for (std::size_t i = 0; i < copies->size(); ++i) {
    if ((*copies)[i].empty()) continue;
    position.push_back(i);
    state.patches.push_back(patches_[static_cast<int>(i)].topology.patch);
    state.sizes.push_back(static_cast<Index>((*copies)[i].size()));
  }
  const auto ids = std::make_shared<const InjectionLog>(log);  // which goes on
  state.bytes = [copies, position, ids](std::size_t i) {
    std::vector<std::byte> bytes = std::move((*copies)[position[i]]);
    if (!ids->empty()) change_ids(bytes, [&](std::span<Index> own) { ids->make_dense(own); });
    return bytes;
  };
  is_written(at);
  return state;
}

template <int Dim>
bool CheckpointStager<Dim>::plan(Step step) {
  if (step < next_request_ || requested_ >= 0) return false;
  requested_ = step + max_lead;  // no patch has begun that step
  return true;
}

template <int Dim>
void CheckpointStager<Dim>::is_written(Step at) {
  if (requested_ == at) requested_ = -1;
  asked_ = false;
  // Agreements of earlier steps may still ask for what is written now.
  next_request_ = at + max_lead;
}

template <int Dim>
Step CheckpointStager<Dim>::drain_step(Step done, Step end) const {
  if (copies_) return end;
  if (every_ > 0) end = std::min<Step>(end, (done / every_ + 1) * every_);
  if (requested_ > done) end = std::min(end, requested_.load());
  return end;
}

template class CheckpointStager<2>;
template class CheckpointStager<3>;

}  // namespace lahar
