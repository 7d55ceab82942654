#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "physics/kernels/kernels.h"
#include "runtime/step/history_sums.h"
#include "runtime/step/simulation_impl.h"
#include "runtime/step/simulation_trace.h"
#include "runtime/step/snapshot.h"

namespace lahar {

namespace {

/// A fixed step is compared with its limit where speeds might have lowered it, and every so many
/// steps for slow changes of density: computing the limit costs as much as a stage.
constexpr Step limit_check_steps = 16;

/// Particles that left a patch [-] wait in its memory until the graph drains. It has to where they
/// are so many, 70 KiB, as perhaps nothing else makes it drain.
constexpr std::size_t most_removed = 1000;

std::string too_many_frames(Step step, double time) {
  return fmt::format(
      "step {} (t = {:.6g} s): no more frames are written but the last one; "
      "post_processing.max_frames is the largest number of them.",
      step, time);
}

}  // namespace

template <int Dim>
Agreement Simulation<Dim>::Impl::give(Step step) {
  if (stop_asked.load()) lower(stop_step, step + max_lead);
  Agreement own;
  own.least.stop_before = stop_step.load();
  own.least.failed_step = failed_step.load();
  own.least.rebuild = rebuild_needed.load() ? -1 : 0;
  own.least.checkpoint = checkpoint_asked.load() ? -1 : 0;
  own.least.stop = stop_asked.load() ? -1 : 0;
  own.least.crowded = crowded[step].exchange(false) ? -1 : 0;
  own.least.full = full[step].exchange(false) ? -1 : 0;
  if (watch_due(step)) own.least.strained = strained[step].exchange(false) ? -1 : 0;
  if (sums_due(step)) {
    RowSums sums;
    double fastest = 0;
    for (const HistoryRow& part : rows[step]) {
      sums.add(part);
      fastest = std::max(fastest, part.max_speed);
    }
    own.least.minus_speed = -std::bit_cast<Index>(fastest);
    own.sum = sums.elements();
  }
  if (log.due(time_at(step))) {
    std::vector<Index> events;
    for (auto& of_patch : injected[step])
      for (const Index event : std::exchange(of_patch, {})) events.push_back(event);
    const std::vector<Index> elements = log.elements(events);
    own.sum.insert(own.sum.end(), elements.begin(), elements.end());
  }
  balance.finish(step);
  if (balance.is_due(step)) {
    const auto load = balance.load();
    own.least.minus_work = -load.work;
    own.least.minus_particles = -load.particles;
    own.sum.insert(own.sum.end(), {load.work, load.particles});
  }
  return own;
}

template <int Dim>
Step Simulation<Dim>::Impl::drain_step(Step end) const {
  end = std::min<Step>(end, nsteps);  // dt of the last step may have shown that it is the last
  const auto before = [&](bool drains, Index every) {
    if (drains && every > 0) end = std::min<Step>(end, (step / every + 1) * every);
  };
  before(frames_are_large(), model.output.frame_steps);
  if (frames_are_large() && model.output.frame_dt > 0) end = std::min(end, step_of_frame());
  if (step_alarm_end > step) end = std::min(end, step_alarm_end);
  if (judge.state.end_step > step) end = std::min(end, judge.state.end_step);
  before(observer.checkpoint && !copies_states, model.output.checkpoint_steps);
  if (!copies_states && requested_checkpoint > step)
    end = std::min(end, requested_checkpoint.load());
  if (split_step > step) end = std::min(end, split_step);
  before(balance.forced_every() > 0, balance.forced_every());
  return end;
}

template <int Dim>
Step Simulation<Dim>::Impl::step_of_frame() const {
  constexpr Step never = std::numeric_limits<Step>::max();
  if (model.analysis.step.adaptive) return frame_due(step) ? step + 1 : never;  // set_dt() does it
  const double interval = model.output.frame_dt, length = model.analysis.step.dt;
  const double steps = next_multiple(time_at(step), interval) / length;
  if (steps > 1e18) return never;
  Step at = std::max(step + 1, static_cast<Step>(steps) - 1);
  while (at < nsteps &&
         multiples_by(time_at(at), interval) == multiples_by(time_at(step), interval))
    ++at;
  return at;
}

template <int Dim>
void Simulation<Dim>::Impl::output(int p, Step step) {
  const auto i = static_cast<std::size_t>(p);
  if (may_be_unstable(p, step)) check_limit(p, step);
  const bool needs_sums = sums_due(step);
  if (needs_sums || frame_due(step)) check_finite(patches[p]);
  if (needs_sums) rows[step][i] = sums(patches[p], model);
  if (watch_due(step) && is_strained(patches[p], model)) strained[step] = true;
  if (copy_due(step)) pieces[step][i] = snapshot(patches[p], model, spare->take(i));
  if (patches[p].removed.size() >= most_removed) full[step] = true;
  if (split_due(step) && is_crowded(patches[p], most_particles())) crowded[step] = true;
}

template <int Dim>
bool Simulation<Dim>::Impl::may_be_unstable(int p, Step step) const {
  const TimeStep& plan = model.analysis.step;
  if (plan.adaptive || plan.accept_unstable) return false;
  const Patch<Dim>& patch = patches[p];
  return (step + 1) % limit_check_steps == 0 || step + 1 == nsteps ||
         plan.dt * (wave_speed_bound + patch.max_speed) > patch.smallest_cell;
}

template <int Dim>
void Simulation<Dim>::Impl::check_limit(int p, Step step) {
  const double used = dt_of(step);
  if (!(used > time_step_limit<Dim>(patches[p], model, patches[p].bins))) return;
  Local limiting = -1;
  const double limit = time_step_limit<Dim>(patches[p], model, patches[p].bins, &limiting);
  fail(output_index, p, step,
       unstable_message(used, limit,
                        describe_particle(patches[p].particles, limiting, patches.next_id())) +
           " " + unstable_hint(limit));
}

template <int Dim>
void Simulation<Dim>::Impl::finish_step(Step step) {
  const TraceSpan trace(TraceKind::completed, step);
  record_progress(step);
  if (options.delays.serial > 0) waste_time(options.delays.serial, step);
  if (!exchange) agreed[step] = give(step);
  const Agreement::Least& least = agreed[step].least;
  executor->stop_before(least.stop_before);
  if (least.rebuild < 0) rebuild_needed = true;
  if (least.checkpoint < 0) plan_checkpoint(step);
  if (least.stop < 0) stop_requested = true;
  learn_of_failure(least.failed_step);
  // All ranks find the same, and nobody has begun the step before which they stop.
  if (least.crowded < 0 && split_step < 0) {
    split_step = step + max_lead;
    executor->stop_before(split_step);
  }
  if (least.full < 0) executor->stop_before(step + max_lead);
  if (balance.is_due(step)) {
    const auto all = std::span(std::as_const(agreed[step].sum)).template last<2>();
    if (balance.is_uneven({-least.minus_work, -least.minus_particles}, {all[0], all[1]})) {
      remap_needed = true;
      executor->stop_before(step + max_lead);
    }
  }
  if (log.due(time_at(step))) take_injected(step);
  // Patches that are ahead may have failed in a later step: this one is still good.
  const bool failed = least.failed_step <= step;
  if (sums_due(step) && !failed) {
    HistoryRow row = RowSums::row(agreed[step].sum, std::bit_cast<double>(-least.minus_speed));
    finish_row(row, step + 1);
    if (history_due(step) && observer.history) attempt([&] { observer.history(row); });
    if (watch_due(step)) watch(step, row, least.strained < 0);
  }
  if (step_alarm_is_new.exchange(false)) warn_once(step_alarm);
  if (copy_due(step) && !failed) {
    for (Frame& piece : pieces[step]) log.make_dense(piece.id);
    attempt([&] { observer.frame({header_at(step + 1), std::move(pieces[step]), spare}); });
    pieces[step].assign(static_cast<std::size_t>(patches.size()), {});
  }
  if (plans_frames() && observer.warning && frame_planned(step) && !failed &&
      frames_by(step) == model.output.max_frames + 1)
    attempt([&] { observer.warning(too_many_frames(step + 1, time_at(step + 1))); });
  if (keeps(step) && least.failed_step > step) hand_on_kept(step);
  if (keeps(step + 1)) kept_run = run_state(step + 1);
  if (observer.checkpoint_wanted && observer.checkpoint_wanted()) checkpoint_asked = true;
  if (observer.progress && !observer.progress(step + 1, time_at(step + 1))) stop_asked = true;
  if (!exchange && (stop_asked || checkpoint_asked)) {  // no other rank has to hear of it first
    if (checkpoint_asked) plan_checkpoint(step);
    if (!stop_asked) return;
    stop_requested = true;
    executor->request_stop(step);
  }
}

template <int Dim>
void Simulation<Dim>::Impl::take_injected(Step step) {
  const Index before = log.next_id();
  log.take(step, std::span(std::as_const(agreed[step].sum))
                     .subspan(sums_due(step) ? RowSums::n_elements : 0, log.n_elements()));
  all_particles += log.next_id() - before;
  if (!copies_states && !copies_frames()) return;
  // All of them on one rank, at the most. (Of states, without sums of nodes.) A little more is let
  // pass, so that there always is room for many until the next time.
  const auto particle = static_cast<std::size_t>(patches.layout().rows() + 2) * sizeof(double);
  const auto came = static_cast<std::size_t>(log.next_id() - measured_ids);
  if (largest_copy + came * particle > options.staging_bytes + options.staging_bytes / 16)
    executor->stop_before(step + max_lead);
}

template <int Dim>
void Simulation<Dim>::Impl::finish_row(HistoryRow& row, Step step) {
  work += PatchWork{row.internal, row.external, row.damping, row.friction, row.divided};
  complete_row(row, step, work);
}

template <int Dim>
void Simulation<Dim>::Impl::complete_row(HistoryRow& row, Step step,
                                         const PatchWork& since_start) const {
  row.step = step;
  row.time = time_at(step);
  row.dt = step > 0 ? dt_of(step - 1) : 0.0;
  row.internal = since_start.internal;
  row.external = since_start.external;
  row.damping = since_start.damping;
  row.friction = since_start.friction;
  row.divided = since_start.divided;
  row.balance = row.kinetic + row.internal + row.damping - row.external - start_row.kinetic;
}

template <int Dim>
HistoryRow Simulation<Dim>::Impl::present_row() {
  RowSums all;
  double fastest = 0;
  for (int i = 0; i < patches.size(); ++i) {
    const PatchWork kept = patches[i].work;
    const HistoryRow part = sums(patches[i], model);
    patches[i].work = kept;
    all.add(part);
    fastest = std::max(fastest, part.max_speed);
  }
  std::vector<Index> elements = all.elements();
  ranks.sum(elements);
  HistoryRow row = RowSums::row(elements, ranks.max(fastest));
  PatchWork since_start = work;
  since_start += PatchWork{row.internal, row.external, row.damping, row.friction, row.divided};
  complete_row(row, step, since_start);
  return row;
}

template <int Dim>
FrameHeader Simulation<Dim>::Impl::header_at(Step at) const {
  FrameHeader header = frame_header<Dim>(patches.layout(), model);
  header.step = at;
  header.time = time_at(at);
  return header;
}

template <int Dim>
Frame Simulation<Dim>::Impl::of_all_ranks(Frame own) const {
  if (!ranks.several()) return own;
  const auto gather = [&](auto& values) {
    values = ranks.gather_all(std::span(std::as_const(values)));
  };
  gather(own.id);
  gather(own.material);
  gather(own.coordinates);
  for (FrameColumn& column : own.columns) gather(column.values);
  sort_by_id(own);
  return own;
}

template <int Dim>
FrameSource Simulation<Dim>::Impl::present_frame() const {
  std::vector<const Patch<Dim>*> all;
  for (int i = 0; i < patches.size(); ++i) all.push_back(&patches[i]);
  FrameSource frame = lahar::frame_source(all, header_at(step), model);
  if (!log.empty())
    frame.piece = [this, piece = std::move(frame.piece)](std::size_t i) {
      Frame one = piece(i);
      log.make_dense(one.id);
      return one;
    };
  if (is_parallel(options)) frame.threads = options.threads;
  return frame;
}

template struct Simulation<2>::Impl;
template struct Simulation<3>::Impl;

}  // namespace lahar
