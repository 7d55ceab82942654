#include "runtime/step/simulation_driver.h"

#include <fmt/format.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <span>
#include <tuple>

#include "physics/base/error.h"
#include "physics/kernels/implicit.h"
#include "physics/kernels/kernels.h"
#include "runtime/patches/particle_message.h"
#include "runtime/step/snapshot.h"
#include "runtime/step/watchdog.h"

namespace lahar {

namespace {

ExecutionOptions with_threads(ExecutionOptions options) {
  if (options.threads <= 0) options.threads = available_threads();
  return options;
}

}  // namespace

template <int Dim>
SimulationDriver<Dim>::SimulationDriver(Model<Dim> model, ExecutionOptions options,
                                        Observer observer, const SimulationState* state)
    : options_(with_threads(options)),
      observer_(std::move(observer)),
      model_(std::move(model)),
      stages_(timestep<Dim>(model_.analysis, !model_.injections.empty())),
      ranks_(options_.ranks),
      phases_(phases_of(stages(), ranks_.several())),
      watch_(model_, patches_, ranks_, [this](const std::string& text) { warn(text); }),
      lost_(model_.analysis, [this](const std::string& text) { warn(text); }),
      patches_(make_patches(state)),
      rest_(model_, patches_, ranks_),
      log_(model_.injections,
           state ? std::max(state->run.next_id, patches_.next_id()) : patches_.next_id()),
      limits_(model_, patches_),
      time_(model_.analysis, model_.output, limits_.of_injections(ranks_)),
      load_steps_(model_.analysis, model_.watchdog),
      rigid_(model_),
      schedule_(model_.output, model_.analysis.first_step, time_),
      history_(time_, model_.rigid_bodies.size()),
      gauges_(model_, patches_.layout()),
      frames_(model_, patches_, log_, time_),
      nodes_(model_, patches_, time_),
      stager_(patches_, observer_.checkpoint ? model_.output.checkpoint_steps : 0),
      budget_(options_.staging_bytes),
      epochs_(patches_, model_.analysis, ranks_, options_.balance, options_.threads),
      trace_(phases_),
      times_(stages()) {
  seconds_per_tick();  // from now on
  if (model_.changes.takes_time())
    time_.shorten_until(model_.changes.ends_at(), model_.changes.longest_step());
  if (ranks_.several() && !is_parallel())
    throw InputError("only the task graph runs on several ranks; leave out --serial");
  frames_.measure(ranks_, nodes_.bytes());
  need_memory_of_copies({patches_.bytes(), frames_.bytes(), stager_.bytes()}, model_.output,
                        options_.staging_bytes, options_.memory, ranks_);
  if (state && state->use == StateUse::go_on)
    resume(state->run);
  else
    start(state);
  begin_time_ = time();
  if (observer_.poll) ranks_.while_waiting([this] { poll_observer(); });
#if defined(__GLIBC__)
  malloc_trim(0);  // what the model's tables took goes back to the system
#endif
}

template <int Dim>
SimulationDriver<Dim>::~SimulationDriver() {
  if (observer_.poll) ranks_.while_waiting({});
}

template <int Dim>
PatchSet<Dim> SimulationDriver<Dim>::make_patches(const SimulationState* state) {
  const NodeSumCopies copies = node_sum_copies(model_.analysis);
  std::vector<TimestepStage<Dim>> all = stages_;
  if (begins_with_solve(model_.analysis)) append_solver_stages(model_.analysis, all);
  const SumMessages messages = message_of_sums(all);
  return state ? PatchSet<Dim>(model_, options_.support_rings, copies, *state, threads(), ranks_,
                               messages, options_.memory)
               : PatchSet<Dim>(model_, options_.support_rings, copies, threads(), ranks_, messages,
                               options_.memory);
}

template <int Dim>
void SimulationDriver<Dim>::start(const SimulationState* state) {
  step_ = model_.analysis.first_step;
  if (state) rigid_.take_over(state->run.rigid_bodies, patches_, ranks_);
  rigid_.begin(step_, time());
  history_.begin(history());
  watch_.begin(history_.start());
  const double stable = time_.begin(limits_.present(ranks_), [this] {
    std::string where;  // looked for only now: that takes longer than the limit itself
    limits_.present(ranks_, &where);
    return where;
  });
  if (time_.is_adaptive()) watch_.judge_step(0, time_.time_at(0), stable);
  rigid_.move(step_, time_.time_at(step_), time_.dt_of(step_));
  const bool is_mapped = state && state->use == StateUse::alike;
  for (int p = 0; p < patches_.size() && !is_mapped; ++p) {
    if (begins_with_solve(model_.analysis) && model_.analysis.mean_volume) join_bins(patches_[p]);
    map_first(patches_[p], stages_, context(step_));
  }
  epochs_.balance().share(patches_, step_);
  schedule_.begin(time_.dt_of(0));
  build_executor();
}

template <int Dim>
void SimulationDriver<Dim>::resume(const RunState& run) {
  step_ = run.step;
  lost_.resume(run.removed, run.step);
  epochs_.resume(run.split_step);
  history_.resume(run.kinetic_at_start, run.work);
  gauges_.resume(run.gauges);
  schedule_.begin(run.dt, run.history_steps);
  watch_.resume(run.watchdog);
  time_.resume(step_, run.time, run.dt, run.dt_limit);
  if (rest_.resume(run.rest)) time_.end_at(step_);
  build_executor();
  rigid_.resume(step_, run.time, run.rigid_bodies);
  if (sets_dt() && !finished()) set_dt(step_, run.dt_limit);
}

template <int Dim>
void SimulationDriver<Dim>::advance(Index steps) {
  const Step end = step_ + std::min(steps, time_.most_nsteps() - step_);
  stops_ = stop_asked_ = false;
  lost_.throw_if_too_many(step_, time_.nsteps(), time());
  watch_.throw_alarm(step_, time_.nsteps());
  if (TraceRecorder* recorder = TraceRecorder::active()) recorder->set_present(step_);
  // Who wants a run to stop whose end is near hears of that end.
  while (step_ < end && !finished() && (!stops_ || lost_.too_many())) {
    prepare_copies();
    if (implicit_) find_equilibrium();
    if (pressure_) find_pressure();
    step_ = executor_->run(step_, drain_step(end));
    if (exchange_) exchange_->send_rest();
    take_removed();
    failures_.throw_first(step_, ranks_);
    // Before particles are delivered: then it is in the order of frames that were copied.
    if (frames_are_large() && frame_due(step_ - 1)) hand_on_large_frame();
    settle();
    take_dense_ids();
    if (finished()) check_end();
    plan_next_step();
    test_rest();  // before patches move to other ranks
    const bool ends = step_ >= end || finished() || stops_;
    if (ends && nodes_.any()) nodes_.keep(step_);
    change_patches();
    // What was asked for and comes after the end is written now. When too many particles have left,
    // the run ends soon, and only its end is written.
    const bool writes = stager_.due(step_) || (ends && stager_.is_planned_after(step_));
    if (writes && !lost_.too_many()) write_checkpoint();
    lost_.throw_if_too_many(step_, time_.nsteps(), time());
    watch_.throw_alarm(step_, time_.nsteps());
  }
}

template <int Dim>
void SimulationDriver<Dim>::prepare_copies() {
  const auto n = static_cast<std::size_t>(patches_.size());
  history_.make_room(n);
  frames_.make_room();
  nodes_.make_room();
  for (auto& events : injected_) events.assign(n, {});
  epochs_.begin();
  stop_before_.clear();
  budget_.begin(log_.next_id());
  if (observer_.large_frame && schedule_.plans_frames() && !frames_are_large())
    budget_.add(frames_.bytes());
  // Tasks copy states if there is memory for that. Not where particles are removed: only a drained
  // graph tells the observer of them. Nor where rest is tested: states say whether the run has come
  // to rest, and the test follows when the graph has drained.
  bool copies_states = observer_.checkpoint && !removes_particles() && !rest_.on();
  if (copies_states) {
    const Index own = static_cast<Index>(stager_.bytes());
    const auto bytes = static_cast<std::size_t>(ranks_.max(own));
    copies_states = budget_.has_room_for(bytes);
    if (copies_states) budget_.add(bytes);
  }
  stager_.begin(step_, copies_states, lost_.count(), ranks_);
}

template <int Dim>
void SimulationDriver<Dim>::find_equilibrium() {
  ++solves_.steps;
  ImplicitReport report = try_step();
  bool was_cut = false;
  while (can_be_cut() && !load_steps_.accepts(report)) {
    was_cut = true;
    ++solves_.cuts;
    set_dt(step_, load_steps_.cut(time_.dt_of(step_)));
    report = try_step();
  }
  if (!report.converged) throw WholeStepError(no_equilibrium(report));
  const double time = time_.time_at(step_), dt = time_.dt_of(step_);
  if (time_.is_adaptive())
    time_.set_limit(step_ + 1, load_steps_.next({.planned = time_.limit_of(step_), .dt = dt},
                                                was_cut || report.parts > 1, report));
  if (!model_.analysis.implicit.quasi_static) return;
  if (const auto slid = slides_.add(step_ + 1, time + dt, dt, report.longest_move)) warn(*slid);
}

template <int Dim>
ImplicitReport SimulationDriver<Dim>::try_step() {
  ImplicitReport report = implicit_->solve({.time = time_.time_at(step_),
                                            .dt = time_.dt_of(step_),
                                            .first = step_ == 0,
                                            .in_parts = !can_be_cut()});
  solves_.iterations += report.iterations;
  solves_.linear_iterations += report.linear_iterations;
  solves_.in_parts += report.parts > 1;
  solves_.linearize += report.linearize_seconds;
  solves_.linear += report.linear_seconds;
  solves_.products += report.products;
  return report;
}

template <int Dim>
std::string SimulationDriver<Dim>::no_equilibrium(const ImplicitReport& report) const {
  const bool adaptive = time_.is_adaptive();
  return fmt::format(
      "step {} (t = {:.6g} s): no equilibrium found{}, not even of {:.2g} of the loads more: {}. "
      "Is the body held everywhere it can move, and are its loads less than it can bear? If so, "
      "{}",
      step_ + 1, time_.time_at(step_),
      adaptive ? fmt::format(" in the smallest step, {:.3g} s", time_.dt_of(step_)) : "",
      report.least_part, report.problem,
      adaptive ? "allow smaller steps (time_step of watchdog) or more iterations (max_iteration)"
               : "take smaller steps, or adaptive ones (\"time_step\": {\"adaptive\": true})");
}

template <int Dim>
void SimulationDriver<Dim>::find_pressure() {
  const PressureReport report = pressure_->solve(time_.time_at(step_), time_.dt_of(step_),
                                                 step_ == model_.analysis.first_step);
  ++solves_.steps;
  solves_.linear_iterations += report.iterations;
  solves_.linearize += report.assemble_seconds;
  solves_.linear += report.solve_seconds;
  solves_.products += report.products;
  if (report.converged) return;
  throw WholeStepError(fmt::format(
      "step {} (t = {:.6g} s): the pressure was not found: {}. Take a smaller step; where "
      "iterations did not suffice, give the linear solver more (max_iter)",
      step_ + 1, time_.time_at(step_), report.problem));
}

template <int Dim>
Step SimulationDriver<Dim>::drain_step(Step end) const {
  if (begins_with_solve(model_.analysis)) end = std::min(end, step_ + 1);
  end = std::min<Step>(end, time_.nsteps());  // dt of the last step may have shown that it is last
  if (frames_are_large()) end = std::min(end, schedule_.next_frame(step_));
  end = rest_.drain_step(step_, end);
  end = watch_.end_step(step_, end);
  end = lost_.drain_step(step_, end);
  end = stager_.drain_step(step_, end);
  return epochs_.drain_step(step_, end);
}

template <int Dim>
void SimulationDriver<Dim>::take_removed() {
  if (!removes_particles()) return;
  std::vector<RemovedParticle> all;
  for (int i = 0; i < patches_.size(); ++i) {
    all.insert(all.end(), patches_[i].removed.begin(), patches_[i].removed.end());
    patches_[i].removed.clear();
  }
  // Where the run failed, some patches were ahead.
  const Step last = ranks_.min(failures_.first_step());
  std::erase_if(all, [&](const RemovedParticle& one) { return one.step > last; });
  for (RemovedParticle& one : all) one.id = log_.dense(one.id);
  if (ranks_.several()) all = ranks_.gather_all(std::span<const RemovedParticle>(all));
  gauges_.add_removed(all);
  std::erase_if(all, [](const RemovedParticle& one) { return one.as_planned; });
  if (all.empty()) return;
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::tie(a.step, a.id) < std::tie(b.step, b.id);
  });
  lost_.add(all);
  if (observer_.removed) attempt([&] { observer_.removed(all); });
}

template <int Dim>
void SimulationDriver<Dim>::hand_on_large_frame() {
  observer_.large_frame(frame_source());
  if (nodes_.any() && observer_.nodes) observer_.nodes(nodes_.present(step_));
}

template <int Dim>
void SimulationDriver<Dim>::settle() {
  for (int p = 0; p < patches_.size(); ++p) {
    if (!begins_with_solve(model_.analysis)) {
      stages_[0].begin(patches_[p], context(step_));
      continue;
    }
    deliver(patches_[p]);
    if (model_.analysis.mean_volume) join_bins(patches_[p]);
  }
  for (int p = 0; p < patches_.size(); ++p) clear_outboxes(patches_[p]);
  for (RemotePatch<Dim>& from : patches_.elsewhere()) clear(from);
}

template <int Dim>
void SimulationDriver<Dim>::take_dense_ids() {
  if (log_.empty()) return;
  for (int p = 0; p < patches_.size(); ++p) log_.make_dense(patches_[p].particles.id);
  log_.clear();
  frames_.measure(ranks_, nodes_.bytes());
}

template <int Dim>
void SimulationDriver<Dim>::check_end() {
  for (int p = 0; p < patches_.size(); ++p) {
    check_finite(patches_[p]);
    if (patches_[p].fault.kind != ParticleFault::Kind::none)
      fail_with_fault(output_index_, p, step_ - 1);
  }
  failures_.throw_first(step_, ranks_);
}

template <int Dim>
void SimulationDriver<Dim>::plan_next_step() {
  if (!sets_dt()) return;
  const double limit = implicit_ ? time_.limit_of(step_) : ranks_.min(limits_.of_last_step());
  if (time_.is_adaptive()) time_.set_limit(step_, limit);
  if (rigid_.any_free()) {
    const std::span<const Index> own = rigid_.sums(patches_);
    std::vector<Index> sums(own.begin(), own.end());
    ranks_.sum(sums);
    rigid_.take(step_, sums);
  }
  if (!finished()) set_dt(step_, limit);
}

template <int Dim>
void SimulationDriver<Dim>::change_patches() {
  if (const auto parts = epochs_.split(step_)) {
    build_executor();
    for (int p = 0; p < patches_.size(); ++p)
      if (std::binary_search(parts->begin(), parts->end(), patches_[p].topology.patch))
        map_first(patches_[p], stages_, context(step_));
  } else if (epochs_.rebuild()) {
    build_executor();
  }
  epochs_.remap(step_, time_.nsteps(), [this] { build_executor(); });
}

template <int Dim>
void SimulationDriver<Dim>::test_rest() {
  if (!rest_.due(step_)) return;
  std::optional<double> unbalanced;
  const bool had_finished = finished();
  const double time = time_.time_at(step_);
  if (implicit_)
    unbalanced =
        implicit_->unbalanced(time, had_finished ? time_.last_dt(step_) : time_.dt_of(step_));
  const RestOfBodies bodies = rigid_.rest(step_, time, time_.last_dt(step_));
  if (!rest_.judge(time, history().kinetic, bodies, unbalanced)) return;
  time_.end_at(step_);
  if (!had_finished) check_end();
}

template <int Dim>
std::vector<PatchParticles> SimulationDriver<Dim>::particles_in_place() const {
  std::vector<PatchParticles> all;
  for (int p = 0; p < patches_.size(); ++p) all.push_back(lahar::particles_in_place(patches_[p]));
  return all;
}

template <int Dim>
void SimulationDriver<Dim>::write_checkpoint() {
  stager_.is_written_at_rest(step_);
  observer_.checkpoint(state());
}

template <int Dim>
HistoryRow SimulationDriver<Dim>::history() {
  std::vector<HistoryRow> parts;
  for (int i = 0; i < patches_.size(); ++i) {
    const PatchWork kept = patches_[i].work;
    parts.push_back(sums(patches_[i], model_));
    patches_[i].work = kept;
  }
  HistoryRow row = history_.row_of(parts, step_, ranks_);
  rigid_.describe(step_ + max_lead + 1, time_.time_at(step_), row);  // the slot of the step before
  return row;
}

template <int Dim>
GaugeRows SimulationDriver<Dim>::gauges() {
  std::vector<Patch<Dim>*> patches;
  for (int i = 0; i < patches_.size(); ++i) patches.push_back(&patches_[i]);
  return gauges_.present(patches, step_, time(), ranks_);
}

template <int Dim>
SimulationState SimulationDriver<Dim>::state() const {
  RunState run = run_state(step_);
  run.dt_limit = time_.limit_of(step_);
  run.rigid_bodies = rigid_.state(step_, time());
  return stager_.present(std::move(run), lost_.count(), ranks_);
}

template <int Dim>
SimulationInfo SimulationDriver<Dim>::info() const {
  SimulationInfo info;
  info.threads = threads();
  info.cells = model_.mesh->n_cells();
  info.nodes = model_.mesh->n_nodes();
  info.particles = ranks_.sum(patches_.particles());
  info.removed = lost_.count();
  double divided = 0;
  for (int i = 0; i < patches_.size(); ++i) divided += patches_[i].work.divided;
  info.divided =
      static_cast<Index>(history_.work().divided) + ranks_.sum(static_cast<Index>(divided));
  info.solves = solves_;
  info.rest = rest_.state();
  info.changed = patches_.changed();
  info.patches = static_cast<int>(patches_.all_patches().size());
  info.tasks_per_step = static_cast<int>(phases_.size()) * info.patches + (graph().has_dt ? 1 : 0);
  info.cells_per_patch = patches_.target_cells();
  info.splits = static_cast<Index>(patches_.splits().size());
  for (std::size_t g = 0; g < model_.injections.size(); ++g) {
    const Injection<Dim>& source = model_.injections[g];
    if (source.flow == 0) continue;
    const double density = model_.materials[source.material].density,
                 once = density * source.filling,
                 all = static_cast<double>(source.n_cells() * source.per_cell);
    const double active =
        std::max(0.0, std::min(time(), source.end) - std::max(begin_time_, source.start));
    info.injected.push_back({.mass = once * static_cast<double>(log_.particles_of(g)) / all,
                             .expected = density * source.flow * active,
                             .once = once});
  }
  info.mass_at_start = history_.start().mass;
  info.particles_at_start = history_.start().particles;
  info.energy_scale = watch_.energy_scale(info.mass_at_start);
  info.dt_limit = limits_.present(ranks_);
  info.dt = time_.dt_of(step_);
  info.bytes = static_cast<std::size_t>(ranks_.sum(static_cast<Index>(patches_.bytes())));
  info.frame_bytes = frames_.bytes();
  info.all_frame_bytes = frames_.bytes_of(ranks_.sum(frames_.particles())) +
                         static_cast<std::size_t>(ranks_.sum(static_cast<Index>(nodes_.bytes())));
  info.state_bytes = static_cast<std::size_t>(ranks_.max(static_cast<Index>(stager_.bytes())));
  return info;
}

template <int Dim>
std::vector<Stage> SimulationDriver<Dim>::stages() const {
  return stages_of(stages_);
}

template <int Dim>
std::vector<StageLoop> SimulationDriver<Dim>::loops() const {
  std::vector<StageLoop> all{{time_step_loop, "once", stages(), phases_}};
  const auto append = [&](const std::vector<StageLoop>& loops) {
    all.insert(all.end(), loops.begin(), loops.end());
  };
  if (implicit_) append(implicit_->loops());
  if (pressure_) append(pressure_->loops());
  return all;
}

template <int Dim>
std::vector<Index> SimulationDriver<Dim>::patch_counts() const {
  std::vector<Index> counts;
  for (int i = 0; i < patches_.size(); ++i) counts.push_back(patches_[i].count);
  return counts;
}

template <int Dim>
std::vector<std::string> SimulationDriver<Dim>::patch_names() const {
  std::vector<std::string> names;
  for (int i = 0; i < patches_.size(); ++i) {
    const auto& patch = patches_[i];
    names.push_back(fmt::format("patch {}: {} cells, {} particles", patch.topology.patch,
                                patch.topology.cells.size(), patch.count));
  }
  return names;
}

}  // namespace lahar

#include "runtime/step/simulation_driver_instances.h"
