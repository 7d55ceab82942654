#include "runtime/solve/rounds.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <stdexcept>
#include <utility>

#include "runtime/trace/record/looking.h"

namespace lahar {

namespace {

/// The list of a round, so many times.
template <class T>
std::vector<T> repeated(const std::vector<T>& list, int times) {
  std::vector<T> all;
  for (int k = 0; k < times; ++k) all.insert(all.end(), list.begin(), list.end());
  return all;
}

}  // namespace

template <int Dim>
Rounds<Dim>::Rounds(PatchSet<Dim>& patches, std::vector<TimestepStage<Dim>> stages,
                    RoundOptions options, RoundCalls<Dim> calls)
    : patches_(patches),
      stages_(std::move(stages)),
      options_(std::move(options)),
      calls_(std::move(calls)),
      phases_(phases_of(stages_of(stages_), options_.groups != nullptr)),
      elements_(static_cast<std::size_t>(options_.sums * ExactSum::size)),
      sums_(static_cast<std::size_t>(options_.sums)) {
  if (options_.groups) ranks_ = options_.groups->patches;
  for (std::size_t f = 0; f < phases_.size(); ++f)
    if (phases_[f].task.gives_dt) giving_phase_ = static_cast<int>(f);
  prepares_next_ = std::any_of(stages_.begin(), stages_.end(),
                               [](const auto& stage) { return stage.of_next_step; });
  terms_.resize(static_cast<std::size_t>(patches_.size()));
  stage_ticks_.resize(terms_.size(), std::vector<StageTicks>(stages_.size()));
  failures_.begin(patches_.size());
  const std::vector<Stage> tasks = tasks_of(phases_);
  const int rounds = safe_rounds(tasks);
  TaskGraph graph = make_task_graph(tasks, patches_.neighbours(), ranks_.several(),
                                    static_cast<int>(patches_.elsewhere().size()), rounds);
  if (graph.has_dt != (options_.sums > 0) || options_.sums > most_sums)
    throw std::logic_error("the stages of a round do not give and need the sums of rounds");
  connect_ranks(rounds);
  TaskBodies bodies{
      .run = [this](int stage, int p, Step step) { run_task(stage, p, step); },
      .set_dt =
          [this](Step round) {
            TraceSpan trace = TraceSpan::of_solver(TraceKind::dt, options_.loop, round);
            const TaskGraph& graph = executor_->graph();
            trace.set_ready(
                executor_->ready_at(graph.dt_task(static_cast<int>(round % graph.rounds))));
            if (!exchange_) take_sums(sum_up());
            if (round - 1 < last_round_) decide(round - 1);  // those of the last: run()
          },
      .completed =
          [this](Step step) {
            if (!exchange_) return;
            failures_.learn(agreed_[step].least.failed_step);
            executor_->stop_before(agreed_[step].least.stop_before);
          },
      .looking = &trace_looking,
      .clock = &trace_clock};
  executor_ =
      make_executor(std::move(graph), std::move(bodies), options_.executor, exchange_.get());
}

template <int Dim>
Rounds<Dim>::~Rounds() = default;

template <int Dim>
void Rounds<Dim>::connect_ranks(int rounds) {
  if (!ranks_.several()) return;
  ranks_.wait_for_all();  // the messages of earlier exchanges have all come
  ExchangeCalls calls{
      .give =
          [this](Step) {
            Agreement own;
            own.least.failed_step = failures_.first_step();
            own.least.stop_before = stop_before_.get();
            return own;
          },
      .take = [this](Step step, const Agreement& found) { agreed_[step] = found; },
      .give_sums = [this](Step) { return sum_up(); },
      .take_sums = [this](Step, std::span<const Index> elements) { take_sums(elements); },
      .failed_step = [this] { return failures_.first_step(); },
      .failure_elsewhere = [this](Step round) { failures_.learn(round); },
      .others = options_.others};
  exchange_ = std::make_unique<RankExchange<Dim>>(
      *options_.groups, patches_,
      ExchangePlan{
          .messages = repeated(rank_messages(stages_, phases_, patches_.sum_messages()), rounds),
          .first = next_step_ * rounds,
          .rounds = rounds,
          .loop = options_.loop},
      std::move(calls), InjectedLatency{options_.latency}, options_.shared_memory);
}

template <int Dim>
Step Rounds<Dim>::run(Step most) {
  if (most <= 0) return 0;
  const Step first = next_round();
  const TraceSpan trace = TraceSpan::of_solver(TraceKind::rounds, options_.loop, first);
  last_round_ = first + most - 1;
  next_step_ = executor_->run(next_step_, (last_round_ / rounds()) + 1);
  if (exchange_) exchange_->send_rest();
  Step failed = 0;
  failures_.throw_first(failed, ranks_);
  const Step last = last_round_;
  if (options_.sums > 0) {  // no stage has asked for those of the last round
    sum_up();
    ranks_.sum(elements_);
    take_sums(elements_);
    decide(last);
    failures_.throw_first(failed, ranks_);
  }
  return last - first + 1;
}

// --- tasks ---------------------------------------------------------------------------------------

template <int Dim>
void Rounds<Dim>::run_task(int task_stage, int p, Step step) {
  const Step round = executor_->graph().round_at(step, task_stage / phases());
  if (p >= patches_.size()) return take_message(task_stage, p, round);
  const int f = task_stage % phases();
  const Phase& phase = phases_[static_cast<std::size_t>(f)];
  TraceRecorder* const recorder = this->recorder();
  TraceRecord record;
  if (recorder) record = begun(*recorder, task_stage, p, round);
  StageClock clock(stage_ticks_[static_cast<std::size_t>(p)].data());
  // A step of the graph may have a round more than is taken: nothing is done in it.
  if (round <= last_round_.load(std::memory_order_acquire)) {
    // All ranks know alike, from the sums of a failed round, that they are not those of all.
    const std::span<double> own = f == giving_phase_ ? terms(p) : std::span<double>{};
    std::fill(own.begin(), own.end(), std::numeric_limits<double>::quiet_NaN());
    if (!failures_.idles(p, round)) run_own_task(phase, p, round, clock);
  }
  if (recorder) {
    clock.read(phase.first, phase.last, record.detail.stage.data());
    record.end = ticks();
    recorder->add(record);
  }
  clock.finish(phase.first, phase.last);
  if (exchange_) exchange_->send(task_stage, p, round);
}

template <int Dim>
TraceRecord Rounds<Dim>::begun(const TraceRecorder& recorder, int task_stage, int p,
                               Step round) const {
  const Index patch =
      p < patches_.size()
          ? patches_[p].topology.patch
          : patches_.elsewhere()[static_cast<std::size_t>(p - patches_.size())].patch;
  return {.begin = ticks(),
          .ready = executor_->ready_at(executor_->graph().task(task_stage, p)),
          .step = recorder.present(),
          .round = static_cast<std::int32_t>(round),
          .loop = options_.loop,
          .patch = static_cast<std::int32_t>(patch),
          .phase = static_cast<std::uint8_t>(task_stage % phases())};
}

template <int Dim>
void Rounds<Dim>::take_message(int task_stage, int p, Step round) {
  const TraceFound found;
  TraceRecorder* const recorder = this->recorder();
  TraceRecord record;
  if (recorder) record = begun(*recorder, task_stage, p, round);
  exchange_->unpack(task_stage, p - patches_.size(), round);
  if (!recorder) return;
  record.kind = TraceKind::unpack;
  record.detail.missed = executor_->missed_at(executor_->graph().task(task_stage, p));
  record.end = ticks();
  recorder->add(record);
}

template <int Dim>
void Rounds<Dim>::run_own_task(const Phase& phase, int p, Step round, StageClock& clock) {
  Patch<Dim>& patch = patches_[p];
  try {
    const std::size_t failed =
        run_phase(patch, stages_, phase, calls_.context(round),
                  prepares_next_ ? calls_.context(round + 1) : StepContext<Dim>{},
                  [&](std::size_t s) { clock.lap(s); });
    if (patch.fault.kind != ParticleFault::Kind::none) {
      const StepContext<Dim> context = calls_.context(round);
      return fail(
          failed, p, round,
          describe_fault(std::exchange(patch.fault, {}), *context.model, patches_.next_id()));
    }
    if (!phase.task.gives_dt) return;
    std::array<double, most_sums> own{};
    const std::span<double> to = terms(p);
    if (calls_.give) calls_.give(p, round, std::span(own).first(to.size()));
    std::copy_n(own.begin(), to.size(), to.begin());
  } catch (const std::exception& error) {
    fail(phase.first, p, round, error.what());
  }
}

template <int Dim>
void Rounds<Dim>::fail(std::size_t stage, int p, Step round, const std::string& cause) {
  failures_.add(p, {round, static_cast<int>(stage), stages_[stage].stage.name,
                    calls_.context(round).time, patches_[p].topology.patch, cause});
  const Step step = round / rounds();
  stop_before_.give(step + max_lead);
  executor_->request_stop(step);
}

template <int Dim>
double Rounds<Dim>::stage_seconds(std::size_t stage) const {
  std::uint64_t total = 0;
  for (const auto& of_patch : stage_ticks_) total += of_patch[stage].total;
  return seconds_per_tick() * static_cast<double>(total);
}

// --- sums ----------------------------------------------------------------------------------------

template <int Dim>
std::span<double> Rounds<Dim>::terms(int p) {
  return std::span(terms_[static_cast<std::size_t>(p)])
      .first(static_cast<std::size_t>(options_.sums));
}

template <int Dim>
std::span<const Index> Rounds<Dim>::sum_up() {
  std::array<ExactSum, most_sums> sums;
  const auto n = static_cast<std::size_t>(options_.sums);
  for (int p = 0; p < patches_.size(); ++p) {
    const std::span<const double> own = terms(p);
    for (std::size_t k = 0; k < n; ++k) sums[k] += own[k];
  }
  for (std::size_t k = 0; k < n; ++k)
    std::copy_n(sums[k].elements().begin(), ExactSum::size,
                elements_.begin() + static_cast<std::ptrdiff_t>(k * ExactSum::size));
  if (calls_.give_integers) {
    elements_.resize(n * ExactSum::size);
    const std::span<const Index> integers = calls_.give_integers();
    elements_.insert(elements_.end(), integers.begin(), integers.end());
  }
  return elements_;
}

template <int Dim>
void Rounds<Dim>::take_sums(std::span<const Index> elements) {
  for (std::size_t k = 0; k < sums_.size(); ++k)
    sums_[k] =
        ExactSum(elements.subspan(k * ExactSum::size).template first<ExactSum::size>()).value();
  if (calls_.take_integers) calls_.take_integers(elements.subspan(sums_.size() * ExactSum::size));
}

template <int Dim>
void Rounds<Dim>::decide(Step round) {
  bool goes_on = true;
  try {
    if (calls_.take) goes_on = calls_.take(round, sums_);
  } catch (...) {
    failures_.keep(std::current_exception());
    goes_on = false;
  }
  if (goes_on || round >= last_round_) return;
  last_round_ = round + 1;
  executor_->stop_before((round + 1) / rounds() + 1);
}

template class Rounds<2>;
template class Rounds<3>;

}  // namespace lahar
