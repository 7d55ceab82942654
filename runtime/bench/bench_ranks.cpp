#include "runtime/bench/bench_ranks.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>
#include <vector>

#include "runtime/base/exit_codes.h"
#include "runtime/bench/bench_cases.h"
#include "runtime/bench/bench_result.h"
#include "runtime/bench/bench_solves.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

using Clock = std::chrono::steady_clock;

/// Something that some of the ranks compute while the others sleep.
struct RankJob {
  std::string name;
  Model<3> model;
  ExecutionOptions execution;
  int ranks;           ///< the first so many
  bool alone = false;  ///< each of them computes one of its own, and they do not know of each other
};

/// Samples of the time of a step [s], by job.
struct StepTimes {
  std::vector<BenchSamples> samples;
  double operator[](std::size_t job) const { return samples[job].median(); }
  /// Median of the ratios of samples that were taken one soon after the other.
  double ratio(std::size_t job, std::size_t to) const {
    BenchSamples ratios;
    for (std::size_t s = 0; s < samples[job].values.size(); ++s)
      ratios.values.push_back(samples[job].values[s] / samples[to].values[s]);
    return ratios.median();
  }
};

class RankMeasurement {
 public:
  RankMeasurement(const RankBenchArguments& arguments, const Communicator& world)
      : arguments_(arguments), world_(world) {}

  /// Samples taken in turn.
  StepTimes step_times(std::vector<RankJob> jobs) const {
    std::vector<std::unique_ptr<Simulation>> simulations;
    std::vector<Communicator> groups;
    for (RankJob& job : jobs) {
      groups.push_back(job.alone ? Communicator{} : world_.first(job.ranks));
      simulations.emplace_back();
      if (world_.rank() < job.ranks) {
        job.execution.ranks = groups.back();
        simulations.back() = std::make_unique<Simulation>(job.model, job.execution);
        simulations.back()->advance(5);
      }
      job.model = {};
      rest();
    }
    StepTimes times;
    times.samples.resize(jobs.size());
    std::vector<Index> steps(jobs.size(), 3);   // of a first sample, that says how many it takes
    const int rounds = 2 * arguments_.repeats;  // machines drift: many short samples
    for (int s = 0; s <= rounds; ++s)
      for (std::size_t k = 0; k < jobs.size(); ++k) {
        const auto begin = Clock::now();
        if (simulations[k]) simulations[k]->advance(steps[k]);
        const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
        rest();
        const double step =
            world_.max(simulations[k] ? seconds : 0.0) / static_cast<double>(steps[k]);
        if (s > 0) times.samples[k].values.push_back(step);
        if (s == 0) steps[k] = steps_of(step);
      }
    simulations.clear();
    for (Communicator& group : groups) group.release();
    return times;
  }

 private:
  /// In a sample, of steps that take so long [s]: so many that draining the graph at its end, where
  /// ranks wait for the slowest, counts for nothing.
  Index steps_of(double step) const {
    const double seconds = arguments_.quick ? 0.1 : 0.5;
    const Index fewest = arguments_.quick ? 4 : 100;
    return std::max(fewest, static_cast<Index>(seconds / step));
  }

  /// Wait for all without taking the cores of those that compute: who looks every half of a
  /// millisecond takes 5 % of two threads' time.
  void rest() const {
    MPI_Request request = MPI_REQUEST_NULL;
    MPI_Ibarrier(world_.communicator(), &request);
    for (int done = 0; !done;) {
      MPI_Test(&request, &done, MPI_STATUS_IGNORE);
      if (!done) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  const RankBenchArguments& arguments_;
  Communicator world_;
};

Model<3> block(Index cells) {
  return lattice_block<3>({.cells = cells});
}

double nanoseconds(double step, Index cells) {
  return step * 1e9 / static_cast<double>(BlockSize{cells}.particles(3));
}

void measure_ranks(const RankBenchArguments& arguments, const Communicator& world) {
  const RankMeasurement measurement(arguments, world);
  const bool speaks = world.rank() == 0;
  if (world.size() == 2) {
    if (speaks)
      fmt::print(
          "## 2 ranks of one thread against one rank of 2 threads, H8, linear elastic, USL\n\n"
          "And against two processes that compute half of the particles each and do not know of "
          "each other: what\nthese take longer than threads comes from cores of unequal speed, "
          "not from messages.\n\n"
          "| particles | 1 x 2 [ns] | 2 x 1 [ns] | ratio | two halves [ns] | ratio to 1 x 2 "
          "| 2 x 1 to halves | 1 x 1 [ns] |\n"
          "|---:|---:|---:|---:|---:|---:|---:|---:|\n");
    for (const Index cells : {25, 50}) {
      const Model<3> half = lattice_block<3>({.cells = cells, .filled = 0.5});
      const auto t = measurement.step_times({{"1 x 2", block(cells), {.threads = 2}, 1},
                                             {"2 x 1", block(cells), {.threads = 1}, 2},
                                             {"halves", half, {.threads = 1}, 2, true},
                                             {"1 x 1", block(cells), {.threads = 1}, 1}});
      if (speaks)
        fmt::print("| {} | {:.1f} | {:.1f} | {:.3f} | {:.1f} | {:.3f} | {:.3f} | {:.1f} |\n",
                   format_count(BlockSize{cells}.particles(3)), nanoseconds(t[0], cells),
                   nanoseconds(t[1], cells), t.ratio(1, 0), nanoseconds(t[2], cells), t.ratio(2, 0),
                   t.ratio(1, 2), nanoseconds(t[3], cells));
    }
  }
  // As many particles per rank, as nearly as whole cells allow.
  const Index one = 25, all = world.size() == 2 ? 31 : 40;
  const auto t = measurement.step_times(
      {{"one", block(one), {.threads = 1}, 1}, {"all", block(all), {.threads = 1}, world.size()}});
  if (!speaks) return;
  const double per_rank = nanoseconds(t[1], all) * world.size();
  const double efficiency =
      nanoseconds(1, one) / (t.ratio(1, 0) * nanoseconds(1, all) * world.size());
  const int cores = available_threads();
  fmt::print(
      "\n## Weak scaling, {} ranks of one thread{}\n\n"
      "| ranks | particles | time per particle-step and rank [ns] | efficiency |\n"
      "|---:|---:|---:|---:|\n"
      "| 1 | {} | {:.1f} | 1 |\n| {} | {} | {:.1f} | {:.3f} |\n\n",
      world.size(), world.size() > cores ? fmt::format(", oversubscribed: {} cores", cores) : "",
      format_count(BlockSize{one}.particles(3)), nanoseconds(t[0], one), world.size(),
      format_count(BlockSize{all}.particles(3)), per_rank,
      efficiency * std::max(1.0, world.size() / double(cores)));
}

void measure_overlap(const RankBenchArguments& arguments, const Communicator& world) {
  constexpr double latency = 600e-6;
  constexpr Index cells = 40;
  const RankMeasurement measurement(arguments, world);
  const bool speaks = world.rank() == 0;
  if (speaks)
    fmt::print(
        "## {} ranks{}: a step without and with {:.0f} us held back from each message, H8, {} "
        "particles\n\n"
        "| scheme | step | graph [ms] | with latency | growth | bulk [ms] | with latency | "
        "growth |\n|---|---|---:|---:|---:|---:|---:|---:|\n",
        world.size(), world.size() > available_threads() ? " (oversubscribed)" : "", latency * 1e6,
        format_count(BlockSize{cells}.particles(3)));
  for (const Scheme scheme : {Scheme::usl, Scheme::usf})
    for (const bool adaptive : {false, true}) {
      Model<3> model = block(cells);
      model.analysis.scheme = scheme;
      model.analysis.step.adaptive = adaptive;
      model.analysis.step.safety = 0.5;
      using Mode = ExecutionOptions::Mode;
      const auto job = [&](Mode mode, double seconds) {
        ExecutionOptions execution{.mode = mode, .threads = 1, .latency = seconds};
        execution.balance.when = BalanceOptions::When::never;
        return RankJob{"", model, execution, world.size()};
      };
      const auto t =
          measurement.step_times({job(Mode::flow_graph, 0), job(Mode::flow_graph, latency),
                                  job(Mode::bulk, 0), job(Mode::bulk, latency)});
      if (speaks)
        fmt::print("| {} | {} | {:.2f} | {:.2f} | {:+.1f} % | {:.2f} | {:.2f} | {:+.1f} % |\n",
                   scheme == Scheme::usl ? "USL" : "USF", adaptive ? "adaptive" : "fixed",
                   t[0] * 1e3, t[1] * 1e3, 100 * (t.ratio(1, 0) - 1), t[2] * 1e3, t[3] * 1e3,
                   100 * (t.ratio(3, 2) - 1));
    }
  if (speaks) fmt::print("\n");
}

/// [s] of an iteration of the linear solves of a step.
double iteration_time(Simulation& simulation) {
  const SolveCounts before = simulation.solves();
  simulation.advance(1);
  const SolveCounts after = simulation.solves();
  return (after.linear - before.linear) /
         static_cast<double>(after.linear_iterations - before.linear_iterations);
}

/// Linear solves, whose messages and reductions are to be hidden as those of steps are.
void measure_iterations(const RankBenchArguments& arguments, const Communicator& world) {
  constexpr double latency = 600e-6;
  const bool speaks = world.rank() == 0;
  if (speaks)
    fmt::print(
        "The same of an iteration of linear solves in the mean, implicit step, H8\n\n"
        "| unknowns | iteration [ms] | with latency | growth |\n|---:|---:|---:|---:|\n");
  const std::vector<Index> sizes =
      arguments.quick ? std::vector<Index>{16} : std::vector<Index>{16, 24, 32};
  for (const Index cells : sizes) {
    const auto make = [&](double held_back) {
      ExecutionOptions execution{.threads = 1, .ranks = world, .latency = held_back};
      execution.balance.when = BalanceOptions::When::never;
      return Simulation(implicit_block<3>({cells}), execution);
    };
    Simulation free = make(0), late = make(latency);
    BenchSamples of_free, of_late, growth;
    for (int s = 0; s <= arguments.repeats; ++s) {
      const double a = world.max(iteration_time(free)), b = world.max(iteration_time(late));
      if (s == 0) continue;  // memory is touched for the first time
      of_free.values.push_back(a);
      of_late.values.push_back(b);
      growth.values.push_back(b / a);
    }
    if (speaks)
      fmt::print("| {} | {:.2f} | {:.2f} | {:+.1f} % |\n",
                 format_count(3 * cells * (cells + 1) * (cells + 1)), of_free.median() * 1e3,
                 of_late.median() * 1e3, 100 * (growth.median() - 1));
  }
  if (speaks) fmt::print("\n");
}

void measure_balance(const RankBenchArguments& arguments, const Communicator& world) {
  const bool speaks = world.rank() == 0;
  if (speaks)
    fmt::print(
        "## A block slides from one end of the mesh to the other, {} ranks{}, H8, a cell in 80 "
        "steps\n\n"
        "Beside it the same block at rest, whose load does not change: what is measured there is "
        "noise.\n\n"
        "| particles | motion | heaviest rank over the mean, as measured | at worst "
        "| in particles | at worst | remaps | moved each | at most | time in them |\n"
        "|---:|---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
        world.size(), world.size() > available_threads() ? " (oversubscribed)" : "");
  const std::vector<Index> lengths =
      arguments.quick ? std::vector<Index>{40} : std::vector<Index>{40, 80};
  for (const Index length : lengths)
    for (const bool moves : {true, false}) {
      Simulation simulation(sliding_block(length, moves), {.threads = 1, .ranks = world});
      const auto begin = Clock::now();
      simulation.run();
      const double seconds = world.max(std::chrono::duration<double>(Clock::now() - begin).count());
      const BalanceReport found = simulation.balance();
      if (speaks)
        fmt::print(
            "| {} | {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {} | {:.1f} % | {:.1f} % | {:.2f} % "
            "|\n",
            format_count(sliding_particles(length)), moves ? "slides" : "rests", found.work.mean,
            found.work.worst, found.particles.mean, found.particles.worst, found.remaps,
            100 * found.moved, 100 * found.most_moved, 100 * found.seconds / seconds);
    }
  if (speaks) fmt::print("\n");
}

/// Start this command again, under mpirun, with each of these numbers of ranks.
int start(const RankBenchArguments& arguments, const std::string& what,
          const std::vector<int>& sizes) {
  if (geteuid() == 0) {  // of which Open MPI wants to be sure
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 0);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 0);
  }
  for (const int ranks : sizes) {
    std::fflush(stdout);
    const std::string command = fmt::format(
        "mpirun --oversubscribe --bind-to none -n {} '{}' bench {} --repeat {}{}", ranks,
        arguments.program, what, arguments.repeats, arguments.quick ? " --quick" : "");
    if (std::system(command.c_str()) != 0)
      throw RankError("`" + command + "` failed. Is mpirun of Open MPI installed and in the PATH?");
  }
  return exit_ok;
}

int measured(const RankBenchArguments& arguments, const std::string& what,
             const std::vector<int>& sizes, auto measure) {
  const Communicator world = Communicator::world();
  if (!world.several()) return start(arguments, what, sizes);
  measure(arguments, world);
  return exit_ok;
}

}  // namespace

int bench_ranks(const RankBenchArguments& arguments) {
  return measured(arguments, "ranks", {2, 4}, measure_ranks);
}

int bench_overlap(const RankBenchArguments& arguments) {
  return measured(arguments, "overlap", {2, 4},
                  [](const RankBenchArguments& asked, const Communicator& world) {
                    measure_overlap(asked, world);
                    measure_iterations(asked, world);
                  });
}

int bench_balance(const RankBenchArguments& arguments) {
  return measured(arguments, "balance", {4}, measure_balance);
}

}  // namespace lahar
