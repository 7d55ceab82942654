#include "runtime/bench/bench_measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "runtime/bench/bench_machine.h"
#include "runtime/bench/bench_worker.h"

namespace lahar {

namespace {

/// The processes of one job.
class Crew {
 public:
  explicit Crew(const BenchJob& job) : job_(job) {
    for (int copy = 0; copy < job.copies; ++copy)
      workers_.push_back(std::make_unique<BenchWorker>(job));
    for (auto& worker : workers_) variant = worker->ready().variant;
    variant.name = job.name;
    variant.copies = job.copies;
    variant.goal = job.goal;
  }

  void warm_up(const BenchProtocol& protocol) {
    for (auto& worker : workers_) worker->begin_warm_up();
    double step = 0;
    for (auto& worker : workers_) step = std::max(step, worker->wait_warm_up());
    constexpr Index least = 2;
    const auto by_time = static_cast<Index>(std::ceil(protocol.sample_seconds / step));
    variant.steps = protocol.steps > 0 ? protocol.steps
                    : job_.steps > 0   ? job_.steps
                                       : std::max(least, by_time);
    // A sample has to fit into the model's life, with room for a warm-up; one of so many steps as
    // the job says begins with a model of its own.
    if (job_.life > 0 && variant.steps != job_.steps)
      variant.steps = std::min(variant.steps, job_.life / 2);
  }

  /// All copies together: the sum of their rates.
  void sample() {
    for (auto& worker : workers_) worker->begin_steps(variant.steps);
    const auto particle_steps = static_cast<double>(variant.particles * variant.steps);
    double rate = 0, cpu = 0;
    for (auto& worker : workers_) {
      const BenchWorker::Times times = worker->wait_steps();
      rate += particle_steps / times.wall;
      cpu += times.cpu / (particle_steps * variant.copies);
      samples.push_back(times);
    }
    variant.ns.values.push_back(1e9 / rate);
    variant.cpu_ns.values.push_back(1e9 * cpu);
  }

  void finish(bool count_crossings) {
    variant.stages = workers_.front()->finish().stages;
    // Frames of more particles than this would need more memory than the run.
    constexpr Index most = 2'000'000;
    if (count_crossings && variant.particles <= most)
      variant.crossings = workers_.front()->count_crossings();
  }

  BenchVariant variant;
  std::vector<BenchWorker::Times> samples;

 private:
  const BenchJob& job_;
  std::vector<std::unique_ptr<BenchWorker>> workers_;
};

/// Ratios sample by sample: both were taken at about the same time.
BenchFigure ratio_of(const BenchRatio& ratio, const std::vector<BenchVariant>& variants) {
  const BenchSamples &over = variants[ratio.over].ns, &under = variants[ratio.under].ns;
  BenchFigure figure{.name = ratio.name};
  for (std::size_t k = 0; k < over.values.size(); ++k)
    figure.samples.values.push_back(over.values[k] / under.values[k]);
  figure.of_medians = over.median() / under.median();
  figure.at_most = ratio.at_most;
  figure.at_least = ratio.at_least;
  return figure;
}

/// [B/s] of that many threads; 0 if it was not measured.
double bandwidth_of(const BenchMachine& machine, int threads) {
  for (const BenchRates& rates : machine.rates)
    if (rates.threads == threads) return rates.bandwidth();
  return 0;
}

/// What an iteration of a linear solve takes in the mean, whatever its preconditioner, and the
/// product of those with the diagonal against the bandwidth.
void add_solves(const BenchVariant& variant, const std::vector<BenchWorker::Times>& samples,
                const BenchMachine& machine, BenchCase& result) {
  constexpr double goal = 1.5;
  BenchFigure iteration{.name = variant.name + ", an iteration", .unit = "us"},
      product{.name = variant.name + ", a product", .unit = "us"},
      iterations{.name = variant.name + ", iterations per step", .unit = ""},
      bound{.name = variant.name + ", product / bandwidth bound", .unit = "", .at_most = goal};
  const double rate = bandwidth_of(machine, variant.threads);
  for (const BenchWorker::Times& times : samples) {
    if (times.iterations == 0) continue;  // solved directly
    const double of_product = times.multiplying / (times.products * variant.threads);
    iteration.samples.values.push_back(1e6 * times.solving / times.iterations);
    product.samples.values.push_back(1e6 * of_product);
    iterations.samples.values.push_back(times.iterations / static_cast<double>(variant.steps));
    if (rate > 0)
      bound.samples.values.push_back(of_product * rate * times.products / times.product_bytes);
  }
  for (const BenchFigure& figure : {iteration, product, iterations, bound})
    if (!figure.samples.values.empty()) result.figures.push_back(figure);
}

void measure_times(const BenchPlan& plan, const BenchProtocol& protocol,
                   const BenchMachine& machine, const BenchProgress& progress, BenchCase& result) {
  progress("making the models");
  std::vector<std::unique_ptr<Crew>> crews;
  for (const BenchJob& job : plan.jobs) crews.push_back(std::make_unique<Crew>(job));
  progress("warming up");
  for (auto& crew : crews) crew->warm_up(protocol);
  for (int repeat = 0; repeat < protocol.repeats; ++repeat)
    for (auto& crew : crews) {
      progress(fmt::format("{} of {}: {}", repeat + 1, protocol.repeats, crew->variant.name));
      crew->sample();
    }
  for (auto& crew : crews) {
    crew->finish(plan.kind == BenchPlan::Kind::time && crew->variant.per_cell > 0);
    BenchVariant& variant = crew->variant;
    if (const double rate = bandwidth_of(machine, variant.threads * variant.copies); rate > 0)
      variant.bound = 1e9 * variant.bytes / rate;
    if (!plan.stages) variant.stages.clear();
    result.variants.push_back(variant);
  }
  if (plan.solves) add_solves(crews.front()->variant, crews.front()->samples, machine, result);
}

void add_bound(const BenchPlan& plan, BenchCase& result) {
  const BenchVariant& first = result.variants.front();
  if (plan.bound_at_most == 0 || first.bound == 0) return;
  BenchFigure figure{.name = first.name + " / bandwidth bound"};
  for (const double ns : first.ns.values) figure.samples.values.push_back(ns / first.bound);
  figure.at_most = plan.bound_at_most;
  result.figures.push_back(figure);
}

/// Resident memory beyond that of the last job, per particle beyond its particles.
void measure_memory(const BenchPlan& plan, const BenchProgress& progress, BenchCase& result) {
  constexpr Index steps = 8;
  struct Use {
    double particles, resident, peak;
  };
  std::vector<Use> uses;
  for (const BenchJob& job : plan.jobs) {
    progress(job.name);
    BenchWorker worker(job);
    const auto particles = static_cast<double>(worker.ready().variant.particles);
    worker.begin_steps(steps);
    worker.wait_steps();
    const BenchWorker::End end = worker.finish();
    uses.push_back({particles, end.resident, end.peak});
  }
  const Use& empty = uses.back();
  for (std::size_t k = 0; k + 1 < uses.size(); ++k) {
    const Use& use = uses[k];
    const double particles = use.particles - empty.particles;
    const std::string& name = plan.jobs[k].name;
    constexpr double goal = 300;  // [B], output off
    const double limit = plan.jobs[k].output ? 0 : goal;
    result.figures.push_back({.name = name + ", while it runs",
                              .unit = "B/particle",
                              .samples = {{(use.resident - empty.resident) / particles}},
                              .at_most = limit});
    result.figures.push_back({.name = name + ", peak",
                              .unit = "B/particle",
                              .samples = {{(use.peak - empty.peak) / particles}},
                              .at_most = limit});
  }
  result.figures.push_back(
      {.name = "a run without particles", .unit = "MiB", .samples = {{empty.resident / 1048576}}});
}

void measure_start(const BenchPlan& plan, const BenchProtocol& protocol,
                   const BenchProgress& progress, BenchCase& result) {
  BenchFigure read{.name = "scenario to model", .unit = "s"},
      construct{.name = "model to simulation", .unit = "s"},
      step{.name = "first step", .unit = "s"}, all{.name = "start-up", .unit = "s"};
  for (int repeat = 0; repeat < protocol.repeats; ++repeat) {
    progress(fmt::format("{} of {}", repeat + 1, protocol.repeats));
    BenchWorker worker(plan.jobs.front());
    const BenchWorker::Ready ready = worker.ready();
    worker.begin_steps(1);
    const double first = worker.wait_steps().wall;
    read.samples.values.push_back(ready.read_seconds);
    construct.samples.values.push_back(ready.construct_seconds);
    step.samples.values.push_back(first);
    all.samples.values.push_back(ready.read_seconds + ready.construct_seconds);
  }
  result.figures = {read, construct, all, step};
}

}  // namespace

BenchCase measure(const BenchPlan& plan, const BenchProtocol& protocol, const BenchMachine& machine,
                  const BenchProgress& progress) {
  BenchCase result{.name = plan.name, .title = plan.title};
  switch (plan.kind) {
    case BenchPlan::Kind::time:
      measure_times(plan, protocol, machine, progress, result);
      for (const BenchRatio& ratio : plan.ratios)
        result.figures.push_back(ratio_of(ratio, result.variants));
      add_bound(plan, result);
      break;
    case BenchPlan::Kind::memory:
      measure_memory(plan, progress, result);
      break;
    case BenchPlan::Kind::start_up:
      measure_start(plan, protocol, progress, result);
  }
  return result;
}

std::vector<BenchRates> measure_machine(int threads, const BenchProtocol& protocol) {
  std::vector<int> counts{1};
  if (threads > 1) counts.push_back(threads);
  std::vector<BenchRates> all;
  for (const int count : counts) {
    ChildProcess child([&](ChildProcess& parent) {
      const BenchRates rates = measure_rates(count, 2 * protocol.repeats, bench_array_bytes());
      const nlohmann::json said{rates.triad.values, rates.update.values, rates.multiply.values};
      parent.send(said.dump());
    });
    const nlohmann::json said = nlohmann::json::parse(child.receive());
    BenchRates rates{.threads = count};
    said.at(0).get_to(rates.triad.values);
    said.at(1).get_to(rates.update.values);
    said.at(2).get_to(rates.multiply.values);
    all.push_back(rates);
  }
  return all;
}

}  // namespace lahar
