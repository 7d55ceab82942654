#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <span>
#include <tuple>

#include "physics/base/error.h"
#include "physics/kernels/kernels.h"
#include "runtime/patches/particle_message.h"
#include "runtime/patches/patch_state.h"
#include "runtime/step/simulation_driver.h"

namespace lahar {

template <int Dim>
void SimulationDriver<Dim>::restore(const RunState& run) {
  step = run.step;
  split_step = run.split_step;
  removed = ranks.rank() == 0 ? run.removed : 0;
  work = run.work;
  start_row.kinetic = run.kinetic_at_start;
  history_steps = history_interval(run.dt);
  if (model.output.history_steps == 0 && model.output.history_dt == 0 && run.history_steps > 0)
    history_steps = run.history_steps;
  restore_watch(run.watchdog);
  start_time[step] = run.time;
  last_limit = run.dt_limit;
  build_executor();
  if (model.analysis.step.adaptive)
    restore_dt(run.dt);
  else
    limit_steps_by_time();
  if (step > nsteps)
    throw InputError(
        {Problem{.where = "/analysis/nsteps",
                 .message = fmt::format("the run ends with step {}, but is to go on from step {}",
                                        nsteps, step),
                 .hint = "raise nsteps, or go on from an earlier checkpoint"}});
}

template <int Dim>
void SimulationDriver<Dim>::advance(Index steps) {
  const Step end = std::min<Step>(step + steps, nsteps);
  stop_requested = false;
  stop_asked = false;
  end_where_watched();
  while (step < end && step < nsteps && !stop_requested) {
    const auto n = static_cast<std::size_t>(patches.size());
    for (Step s = 0; s < max_lead + 2; ++s) {
      rows[s].assign(n, {});
      pieces[s].assign(n, {});
      kept[s].assign(n, {});
      injected[s].assign(n, {});
    }
    rebuild_needed = false;
    begin_keeping();
    stop_step = std::numeric_limits<Step>::max();
    step = executor->run(step, drain_step(end));
    if (exchange) exchange->send_rest();
    take_removed();
    stop_where_failed();
    // Before particles are delivered: then it is in the order of frames that were copied.
    if (frames_are_large() && frame_due(step - 1)) observer.large_frame(present_frame());
    settle();
    take_dense_ids();
    if (step >= nsteps) check_end();
    // dt of the next step, which the drained graph did not get to.
    if (model.analysis.step.adaptive) last_limit = ranks.min(own_limit());
    if (model.analysis.step.adaptive && step < nsteps) set_dt(step, last_limit);
    if (!split_patches() && ranks.any(rebuild_needed || needs_surroundings())) rebuild();
    if (std::exchange(remap_needed, false) || balance.is_forced(step)) remap();
    // What was asked for and comes after the end is written now.
    const bool ends = step >= end || step >= nsteps || stop_requested;
    if (checkpoint_due(step) || (ends && requested_checkpoint > step)) write_checkpoint();
    end_where_watched();
  }
}

template <int Dim>
std::string SimulationDriver<Dim>::first_failure() const {
  constexpr Index none = std::numeric_limits<Index>::max();
  const bool own = failures.by(step);
  const Failure first = own ? failures.earliest() : Failure{};
  const Index stage = ranks.min(own ? Index{first.stage_index} : none);
  const bool in_stage = own && first.stage_index == stage;
  const Index patch = ranks.min(in_stage ? first.patch : none);
  const Index failed = ranks.sum(failures.count(step));
  std::string message = own ? failure_message(first, ranks.rank(), failed) : "";
  of_one_rank(in_stage && first.patch == patch, message);
  return message;
}

template <int Dim>
void SimulationDriver<Dim>::stop_where_failed() {
  if (ranks.any(!failures.empty())) {
    step = ranks.min(failed_step.load());
    throw SimulationError(first_failure());
  }
  if (!output_failure) output_failure = poll_failure;
  if (!ranks.any(static_cast<bool>(output_failure))) return;
  if (output_failure) std::rethrow_exception(output_failure);
  throw IoError("another rank could not write its part of the results");
}

template <int Dim>
void SimulationDriver<Dim>::settle() {
  for (int p = 0; p < patches.size(); ++p) stages[0].begin(patches[p], context(step));
  for (int p = 0; p < patches.size(); ++p) clear_outboxes(patches[p]);
  for (RemotePatch<Dim>& from : patches.elsewhere()) clear(from);
}

template <int Dim>
void SimulationDriver<Dim>::take_dense_ids() {
  if (log.empty()) return;
  for (int p = 0; p < patches.size(); ++p) log.make_dense(patches[p].particles.id);
  log.clear();
  measure_frame();
}

template <int Dim>
void SimulationDriver<Dim>::check_end() {
  for (int p = 0; p < patches.size(); ++p) {
    check_finite(patches[p]);
    if (patches[p].fault.kind != ParticleFault::Kind::none)
      fail(output_index, p, step - 1, describe_fault(patches[p].fault, model, patches.next_id()));
  }
  stop_where_failed();
}

template <int Dim>
bool SimulationDriver<Dim>::needs_surroundings() const {
  for (int p = 0; p < patches.size(); ++p)
    if (patches[p].needs_surroundings) return true;
  return false;
}

template <int Dim>
bool SimulationDriver<Dim>::split_patches() {
  if (step != split_step) return false;
  split_step = -1;
  const PatchRenumbering ids = patches.split(most_particles());
  if (ids.empty()) return false;
  balance.renumber(ids);
  rebuild();
  map_parts(ids.parts());
  return true;
}

template <int Dim>
void SimulationDriver<Dim>::map_parts(const std::vector<Index>& parts) {
  for (int p = 0; p < patches.size(); ++p)
    if (std::binary_search(parts.begin(), parts.end(), patches[p].topology.patch))
      map_first(patches[p], stages, context(step));
}

template <int Dim>
void SimulationDriver<Dim>::rebuild() {
  keep_timings();
  patches.rebuild();
  build_executor();
}

template <int Dim>
void SimulationDriver<Dim>::remap() {
  if (step >= nsteps) return;
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  if (balance.remap(patches, step, nsteps - step)) {
    keep_timings();
    build_executor();
  }
  balance.remap_took(std::chrono::duration<double>(Clock::now() - begin).count());
}

template <int Dim>
void SimulationDriver<Dim>::take_removed() {
  if (!model.analysis.remove_leaving_particles) return;
  std::vector<RemovedParticle> all;
  for (int i = 0; i < patches.size(); ++i) {
    all.insert(all.end(), patches[i].removed.begin(), patches[i].removed.end());
    patches[i].removed.clear();
  }
  // Where the run failed, some patches were ahead.
  const Step last = ranks.min(failed_step.load());
  std::erase_if(all, [&](const RemovedParticle& one) { return one.step > last; });
  for (RemovedParticle& one : all) one.id = log.dense(one.id);
  removed += static_cast<Index>(all.size());
  if (ranks.several()) all = ranks.gather_all(std::span<const RemovedParticle>(all));
  if (all.empty() || !observer.removed) return;
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::tie(a.step, a.id) < std::tie(b.step, b.id);
  });
  attempt([&] { observer.removed(all); });
}

template class SimulationDriver<2>;
template class SimulationDriver<3>;

}  // namespace lahar
