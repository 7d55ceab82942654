#include "runtime/step/simulation.h"

#include <fmt/format.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/base/error.h"
#include "physics/kernels/kernels.h"
#include "physics/materials/law.h"
#include "runtime/step/simulation_impl.h"
#include "runtime/step/snapshot.h"

namespace lahar {

namespace {

/// Wave speeds may grow by this factor, as densities fall, between two of these checks.
constexpr double wave_speed_margin = 1.1;

ExecutionOptions with_threads(ExecutionOptions options) {
  if (options.threads <= 0) options.threads = available_threads();
  return options;
}

template <int Dim>
std::vector<double> limits_of_injections(const PatchSet<Dim>& patches, const Model<Dim>& model,
                                         const Communicator& ranks) {
  std::vector<double> limits;
  for (std::size_t g = 0; g < model.injections.size(); ++g) {
    double least = std::numeric_limits<double>::infinity();
    for (int p = 0; p < patches.size(); ++p)
      least = std::min(least, injection_limit(patches[p], g, model));
    limits.push_back(ranks.min(least));
  }
  return limits;
}

}  // namespace

template <int Dim>
Simulation<Dim>::Impl::Impl(Model<Dim> model_in, ExecutionOptions options_in, Observer observer_in,
                            const SimulationState* state)
    : options(with_threads(options_in)),
      observer(std::move(observer_in)),
      model(std::move(model_in)),
      stages(timestep<Dim>(model.analysis, !model.injections.empty())),
      ranks(options.ranks),
      speeds(speed_scales(model, ranks)),
      phases(phases_of(stage_list(), ranks.several())),
      patches(make_patches(state)),
      injection_limits(limits_of_injections(patches, model, ranks)),
      balance(ranks, options.balance, static_cast<int>(ranks.min(Index{options.threads}))) {
  seconds_per_tick();  // from now on
  nsteps = model.analysis.nsteps;
  for (const Material& material : model.materials)
    wave_speed_bound = std::max(wave_speed_bound, wave_speed_margin * wave_speed(material));
  if (ranks.several() && !is_parallel(options))
    throw InputError("only the task graph runs on several ranks; leave out --serial");
  judge = WatchdogJudge(model.watchdog, speeds);
  log = InjectionLog(model.injections, state ? state->run.next_id : patches.next_id());
  measure_frame();
  need_memory_of_copies();
  if (state)
    restore(state->run);
  else
    start();
  if (observer.poll) ranks.while_waiting([this] { poll(); });
#if defined(__GLIBC__)
  malloc_trim(0);  // what the model's tables took goes back to the system
#endif
}

template <int Dim>
PatchSet<Dim> Simulation<Dim>::Impl::make_patches(const SimulationState* state) {
  const int threads = is_parallel(options) ? options.threads : 1;
  const NodeSumCopies copies = node_sum_copies(model.analysis);
  const SumMessages messages = message_of_sums(stages);
  return state ? PatchSet<Dim>(model, options.support_rings, copies, *state, threads, ranks,
                               messages, options.memory)
               : PatchSet<Dim>(model, options.support_rings, copies, threads, ranks, messages,
                               options.memory);
}

template <int Dim>
void Simulation<Dim>::Impl::measure_frame() {
  const std::size_t own = frame_bytes(patches.layout(), model, patches.particles());
  frame_size = static_cast<std::size_t>(ranks.max(static_cast<Index>(own)));
}

/// Beside patches: copies of frames and states that are written while steps are taken.
template <int Dim>
void Simulation<Dim>::Impl::need_memory_of_copies() const {
  if (!std::isfinite(options.memory.bytes)) return;
  constexpr double frames = 3, states = 2;  // see ExecutionOptions::staging_bytes
  const auto staging = static_cast<double>(options.staging_bytes);
  const auto copies = [&](bool planned, double number, std::size_t bytes) {
    const auto size = static_cast<double>(bytes);
    return planned && size <= staging ? number * size : 0.0;
  };
  const OutputPlan& plan = model.output;
  const double bytes =
      static_cast<double>(patches.bytes()) +
      copies(plan.frame_steps > 0 || plan.frame_dt > 0, frames, frame_size) +
      copies(plan.checkpoint_steps > 0 || plan.checkpoint_minutes > 0, states, state_bytes());
  const double most = ranks.max(bytes);
  if (most <= options.memory.bytes) return;
  Problem problem = too_much_memory(
      most, "patches and copies of frames and checkpoints that wait to be written", options.memory);
  problem.where = "/post_processing";
  problem.hint =
      "give a smaller --staging: steps then wait while larger ones are written; or " + problem.hint;
  throw InputError({problem});
}

template <int Dim>
Index Simulation<Dim>::Impl::history_interval(double first_dt) const {
  if (model.output.history_dt > 0) return 0;
  if (model.output.history_steps > 0) return model.output.history_steps;
  const double steps = std::min(static_cast<double>(nsteps), model.analysis.end_time / first_dt);
  return std::max<Index>(1, static_cast<Index>(steps / 100));
}

template <int Dim>
void Simulation<Dim>::Impl::start() {
  step = model.analysis.first_step;
  start_row = present_row();
  begin_watch();
  set_first_dt();
  for (int p = 0; p < patches.size(); ++p) map_first(patches[p], stages, context(step));
  balance.share(patches, step);
  history_steps = history_interval(dt[0]);
  build_executor();
}

template <int Dim>
Simulation<Dim>::Simulation(Model<Dim> model, ExecutionOptions options, Observer observer)
    : impl_(std::make_unique<Impl>(std::move(model), options, std::move(observer))) {}

template <int Dim>
Simulation<Dim>::Simulation(Model<Dim> model, ExecutionOptions options, Observer observer,
                            const SimulationState& state)
    : impl_(std::make_unique<Impl>(std::move(model), options, std::move(observer), &state)) {}

template <int Dim>
Simulation<Dim>::~Simulation() {
  if (impl_->observer.poll) impl_->ranks.while_waiting({});
}

template <int Dim>
void Simulation<Dim>::advance(Index steps) {
  impl_->advance(steps);
}

template <int Dim>
void Simulation<Dim>::run() {
  impl_->advance(impl_->nsteps - impl_->step);
}

template <int Dim>
Frame Simulation<Dim>::frame() const {
  return impl_->of_all_ranks(join(impl_->present_frame()));
}

template <int Dim>
FrameSource Simulation<Dim>::frame_source() const {
  return impl_->present_frame();
}

template <int Dim>
void Simulation<Dim>::poll() {
  if (!impl_->exchange) return;
  const auto lock = impl_->exchange->lock_mpi();
  impl_->poll();
  if (impl_->poll_failure) std::rethrow_exception(impl_->poll_failure);
}

template <int Dim>
HistoryRow Simulation<Dim>::history() const {
  return impl_->present_row();
}

template <int Dim>
SimulationState Simulation<Dim>::state() const {
  return impl_->present_state();
}

template <int Dim>
Index Simulation<Dim>::step() const {
  return impl_->step;
}

template <int Dim>
double Simulation<Dim>::time() const {
  return impl_->time_at(impl_->step);
}

template <int Dim>
bool Simulation<Dim>::finished() const {
  return impl_->step >= impl_->nsteps;
}

template <int Dim>
SimulationInfo Simulation<Dim>::info() const {
  SimulationInfo info;
  info.threads = is_parallel(impl_->options) ? impl_->options.threads : 1;
  info.cells = impl_->model.mesh->n_cells();
  info.nodes = impl_->model.mesh->n_nodes();
  const Communicator& ranks = impl_->ranks;
  info.particles = ranks.sum(impl_->patches.particles());
  info.removed = ranks.sum(impl_->removed);
  double divided = 0;
  for (int i = 0; i < impl_->patches.size(); ++i) divided += impl_->patches[i].work.divided;
  info.divided = static_cast<Index>(impl_->work.divided) + ranks.sum(static_cast<Index>(divided));
  info.patches = static_cast<int>(impl_->patches.all_patches().size());
  info.tasks_per_step = static_cast<int>(impl_->phases.size()) * info.patches +
                        (impl_->executor->graph().has_dt ? 1 : 0);
  info.cells_per_patch = impl_->patches.target_cells();
  info.splits = static_cast<Index>(impl_->patches.splits().size());
  info.dt_limit = impl_->present_limit();
  info.dt = impl_->dt_of(impl_->step);
  info.bytes = static_cast<std::size_t>(ranks.sum(static_cast<Index>(impl_->patches.bytes())));
  info.frame_bytes = impl_->frame_size;
  info.all_frame_bytes = lahar::frame_bytes(impl_->patches.layout(), impl_->model, info.particles);
  info.state_bytes = static_cast<std::size_t>(ranks.max(static_cast<Index>(impl_->state_bytes())));
  return info;
}

template <int Dim>
const BalanceReport& Simulation<Dim>::balance() const {
  return impl_->balance.report();
}

template <int Dim>
std::vector<StageTiming> Simulation<Dim>::timings() const {
  return impl_->timings();
}

template <int Dim>
const TaskGraph& Simulation<Dim>::graph() const {
  return impl_->executor->graph();
}

template <int Dim>
PatchGraph Simulation<Dim>::patch_graph() const {
  return impl_->patches.graph();
}

template <int Dim>
std::vector<Index> Simulation<Dim>::patch_counts() const {
  std::vector<Index> counts;
  for (int i = 0; i < impl_->patches.size(); ++i) counts.push_back(impl_->patches[i].count);
  return counts;
}

template <int Dim>
std::vector<std::string> Simulation<Dim>::patch_names() const {
  std::vector<std::string> names;
  for (int i = 0; i < impl_->patches.size(); ++i) {
    const auto& patch = impl_->patches[i];
    names.push_back(fmt::format("patch {}: {} cells, {} particles", patch.topology.patch,
                                patch.topology.cells.size(), patch.count));
  }
  return names;
}

template class Simulation<2>;
template class Simulation<3>;

}  // namespace lahar
