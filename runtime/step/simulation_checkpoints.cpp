/// \file States for checkpoints. Tasks copy those of their patches while steps are taken: at the
/// beginning of a step, when a patch's particles have come and nothing else of the step is done, a
/// patch is as it would be if the graph had drained. What cannot be copied so is taken from a
/// drained graph.
#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "runtime/patches/patch_state.h"
#include "runtime/step/simulation_driver.h"

namespace lahar {

template <int Dim>
RunState SimulationDriver<Dim>::run_state(Step at) const {
  return {.dim = Dim,
          .step = at,
          .time = time_at(at),
          .dt = at > 0 ? dt_of(at - 1) : 0.0,
          .dt_limit = last_limit,
          .particles = all_particles,
          .removed = all_removed,
          .next_id = log.next_id(),
          .history_steps = history_steps,
          .work = work,
          .kinetic_at_start = start_row.kinetic,
          .cells_per_patch = patches.target_cells(),
          .least_mass = patches.least_mass(),
          .columns = column_text(patches.layout()),
          .splits = patches.splits(),
          .split_step = split_step,
          .watchdog = judge.state};
}

template <int Dim>
SimulationState SimulationDriver<Dim>::present_state() const {
  SimulationState state{.run = run_state(step), .patches = {}, .sizes = {}, .bytes = {}};
  state.run.particles = ranks.sum(patches.particles());
  state.run.removed = ranks.sum(removed);
  std::vector<int> position;
  for (int i = 0; i < patches.size(); ++i) {
    if (!has_state(patches[i])) continue;
    position.push_back(i);
    state.patches.push_back(patches[i].topology.patch);
    state.sizes.push_back(static_cast<Index>(packed_bytes(patches[i])));
  }
  state.bytes = [this, position](std::size_t i) { return pack(patches[position[i]], step); };
  return state;
}

template <int Dim>
std::size_t SimulationDriver<Dim>::state_bytes() const {
  std::size_t bytes = 0;
  for (int i = 0; i < patches.size(); ++i)
    if (has_state(patches[i])) bytes += packed_bytes(patches[i]);
  return bytes;
}

template <int Dim>
void SimulationDriver<Dim>::begin_keeping() {
  copies_states = false;
  measured_ids = log.next_id();
  largest_copy = copies_frames() ? frame_size : 0;
  if (!observer.checkpoint || model.analysis.remove_leaving_particles) return;
  const auto state_size = static_cast<std::size_t>(ranks.max(static_cast<Index>(state_bytes())));
  copies_states = state_size <= options.staging_bytes;
  if (copies_states) largest_copy = std::max(largest_copy, state_size);
  std::array<Index, 2> sums{patches.particles(), removed};
  ranks.sum(sums);
  all_particles = sums[0];
  all_removed = sums[1];
}

template <int Dim>
void SimulationDriver<Dim>::keep(int p, Step at) {
  if (has_state(patches[p])) kept[at][static_cast<std::size_t>(p)] = pack(patches[p], at);
}

template <int Dim>
void SimulationDriver<Dim>::hand_on_kept(Step at) {
  SimulationState state{.run = kept_run, .patches = {}, .sizes = {}, .bytes = {}, .copied = true};
  if (model.analysis.step.adaptive) state.run.dt_limit = limit[at];
  const auto copies = std::make_shared<std::vector<std::vector<std::byte>>>(std::move(kept[at]));
  kept[at].assign(static_cast<std::size_t>(patches.size()), {});
  std::vector<std::size_t> position;
  for (int p = 0; p < patches.size(); ++p) {
    const auto i = static_cast<std::size_t>(p);
    if ((*copies)[i].empty()) continue;
    position.push_back(i);
    state.patches.push_back(patches[p].topology.patch);
    state.sizes.push_back(static_cast<Index>((*copies)[i].size()));
  }
  const auto ids = std::make_shared<const InjectionLog>(log);  // which goes on
  state.bytes = [copies, position, ids](std::size_t i) {
    std::vector<std::byte> bytes = std::move((*copies)[position[i]]);
    if (!ids->empty()) change_ids(bytes, [&](std::span<Index> own) { ids->make_dense(own); });
    return bytes;
  };
  checkpoint_is_written(at);
  attempt([&] { observer.checkpoint(state); });
}

template <int Dim>
void SimulationDriver<Dim>::plan_checkpoint(Step step) {
  if (step < next_request || requested_checkpoint >= 0) return;
  requested_checkpoint = step + max_lead;  // which nobody has begun
  if (!copies_states) executor->stop_before(step + max_lead);
}

template <int Dim>
void SimulationDriver<Dim>::write_checkpoint() {
  requested_checkpoint = -1;
  checkpoint_is_written(step);
  observer.checkpoint(present_state());
}

template <int Dim>
void SimulationDriver<Dim>::checkpoint_is_written(Step at) {
  if (requested_checkpoint == at) requested_checkpoint = -1;
  checkpoint_asked = false;
  // What this rank has said by now of steps that it had done.
  next_request = at + max_lead;
}

template class SimulationDriver<2>;
template class SimulationDriver<3>;

}  // namespace lahar
