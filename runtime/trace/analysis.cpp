#include "runtime/trace/analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "graph/executor.h"
#include "runtime/trace/critical_path.h"
#include "runtime/trace/idle_time.h"

namespace lahar {

namespace {

double duration(const TraceTask& task) {
  return task.end - task.begin;
}

/// The value below which a share of them lies; orders a part of them.
double quantile(std::vector<float>& values, double share) {
  if (values.empty()) return 0;
  const auto k = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

template <class Values>
double most_over_mean(const Values& values) {
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return sum > 0 ? *std::max_element(values.begin(), values.end()) *
                       static_cast<double>(values.size()) / sum
                 : 1.0;
}

std::string task_name(const TraceLog& log, const TraceTask& task) {
  if (task.kind == TraceKind::dt) return fmt::format("the time step of step {}", task.step);
  return fmt::format("{} of patch {}, step {}",
                     log.run.phases[static_cast<std::size_t>(task.phase)].name, task.patch,
                     task.step);
}

class Analysis {
 public:
  explicit Analysis(const TraceLog& log)
      : log_(log), workers_(workers_of(log)), idle_(log, workers_) {
    origin_ = log.tasks.front().begin;
    end_ = origin_ + log.run.wall;
  }

  TraceReport report() {
    use_workers();
    use_stages();
    find_efficiencies();
    find_path();
    find_waits();
    find_patches();
    find_exchange();
    find_spread();
    find_losses();
    return std::move(report_);
  }

 private:
  const auto& phase(const TraceTask& task) const {
    return log_.run.phases[static_cast<std::size_t>(task.phase)];
  }
  std::size_t worker(int rank, int thread) const { return workers_.place(rank, thread); }

  std::int64_t particles_of(const TraceTask& task) const {
    const TraceGraph& graph = log_.graph_at(task.step);
    const auto patch = graph.patches.find(task.patch);
    return patch == graph.patches.end() ? 0 : patch->second.particles;
  }

  // --- workers ----------------------------------------------------------------------------------

  void use_workers() {
    for (const auto& [rank, thread] : workers_.list)
      report_.workers.push_back({.rank = rank, .thread = thread});
    auto& use = report_.workers;
    for (const TraceInterval& i : log_.intervals) {
      const std::size_t w = worker(i.rank, i.thread);
      const double time = std::min(i.end, end_) - std::max(i.begin, origin_);
      if (w == Workers::none || time <= 0) continue;
      if (i.kind == TraceKind::poll) use[w].polling += time;
      if (i.kind == TraceKind::completed || i.kind == TraceKind::frame ||
          i.kind == TraceKind::checkpoint || i.kind == TraceKind::trace)
        use[w].other += time;
    }
    for (const TraceMessage& m : log_.messages)
      if (m.sender >= 0) {
        const TraceTask& sender = log_.tasks[static_cast<std::size_t>(m.sender)];
        use[worker(sender.rank, sender.thread)].messages += m.sent - m.packed;
      }
    const OtherWork other(log_, workers_);
    std::vector<double> busy_until(use.size(), origin_);
    for (const TraceTask& task : log_.tasks) {
      const std::size_t w = worker(task.rank, task.thread);
      switch (task.kind) {
        case TraceKind::task:
          use[w].useful += duration(task);
          break;
        case TraceKind::unpack:
          use[w].messages += duration(task);
          break;
        default:
          use[w].runtime += duration(task);
      }
      // What was ready and did not begin, though the worker did nothing else.
      if (const double free = std::max(task.ready, busy_until[w]); free < task.begin)
        use[w].runtime += task.begin - free - other.within(w, free, task.begin);
      busy_until[w] = std::max(busy_until[w], task.released);
    }
    for (WorkerUse& u : use)
      u.idle =
          std::max(0.0, log_.run.wall - u.useful - u.messages - u.polling - u.runtime - u.other);
  }

  // --- stages -----------------------------------------------------------------------------------

  void use_stages() {
    const auto& phases = log_.run.phases;
    std::vector<std::array<std::vector<float>, trace_stages>> times(phases.size());
    std::vector<std::array<std::vector<double>, trace_stages>> by_worker(phases.size());
    std::vector<double> particles(phases.size());
    for (auto& of_phase : by_worker)
      for (auto& list : of_phase) list.assign(workers_.list.size(), 0.0);
    for (const TraceTask& task : log_.tasks) {
      if (task.kind != TraceKind::task) continue;
      const auto f = static_cast<std::size_t>(task.phase);
      particles[f] += static_cast<double>(particles_of(task));
      const std::size_t w = worker(task.rank, task.thread);
      for (std::size_t s = 0; s < phases[f].stages.size(); ++s) {
        times[f][s].push_back(task.stage[s]);
        by_worker[f][s][w] += task.stage[s];
      }
    }
    for (std::size_t f = 0; f < phases.size(); ++f)
      for (std::size_t s = 0; s < phases[f].stages.size(); ++s)
        report_.stages.push_back(use_of(phases[f].name, phases[f].stages[s], times[f][s],
                                        by_worker[f][s], particles[f]));
  }

  StageUse use_of(const std::string& phase, const std::string& stage, std::vector<float>& times,
                  const std::vector<double>& by_worker, double particles) const {
    StageUse use{.phase = phase, .stage = stage, .count = static_cast<std::int64_t>(times.size())};
    if (times.empty()) return use;
    use.total = std::accumulate(by_worker.begin(), by_worker.end(), 0.0);
    use.mean = use.total / static_cast<double>(times.size());
    use.longest = *std::max_element(times.begin(), times.end());
    use.p95 = quantile(times, 0.95);
    use.p50 = quantile(times, 0.5);
    use.share = use.total / (log_.run.wall * static_cast<double>(workers_.list.size()));
    std::vector<double> by_rank(static_cast<std::size_t>(log_.run.ranks));
    for (std::size_t w = 0; w < by_worker.size(); ++w)
      by_rank[static_cast<std::size_t>(workers_.list[w].first)] += by_worker[w];
    use.by_ranks = most_over_mean(by_rank);
    use.by_threads = most_over_mean(by_worker);
    if (particles > 0) use.per_particle = use.total / particles;
    return use;
  }

  void find_efficiencies() {
    std::vector<double> useful, by_rank(static_cast<std::size_t>(log_.run.ranks));
    for (const WorkerUse& w : report_.workers) {
      useful.push_back(w.useful);
      by_rank[static_cast<std::size_t>(w.rank)] += w.useful;
    }
    const double most = *std::max_element(useful.begin(), useful.end());
    const double mean =
        std::accumulate(useful.begin(), useful.end(), 0.0) / static_cast<double>(useful.size());
    report_.efficiencies = {.parallel = mean / log_.run.wall,
                            .load_balance = most > 0 ? mean / most : 1.0,
                            .communication = most / log_.run.wall,
                            .by_ranks = 1.0 / most_over_mean(by_rank)};
    report_.ideal_time = mean;
  }

  // --- critical path ----------------------------------------------------------------------------

  void find_path() {
    report_.path = critical_path(log_, workers_);
    for (const PathPart& part : report_.path.parts)
      if (part.kind == PathPart::Kind::task) add_to_stages(part);
  }

  void add_to_stages(const PathPart& part) {
    const TraceTask& task = log_.tasks[static_cast<std::size_t>(part.task)];
    if (task.kind != TraceKind::task) return;
    std::size_t first = 0;
    for (int f = 0; f < task.phase; ++f)
      first += log_.run.phases[static_cast<std::size_t>(f)].stages.size();
    for (std::size_t s = 0; s < phase(task).stages.size(); ++s)
      report_.stages[first + s].on_path += task.stage[s];
  }

  // --- waits, patches, messages -----------------------------------------------------------------

  void find_waits() {
    constexpr std::size_t kept = 10;
    std::vector<Wait> waits;
    for (std::size_t t = 0; t < log_.tasks.size(); ++t) {
      const TraceTask& task = log_.tasks[t];
      if (task.ready <= task.without_last || task.kind == TraceKind::unpack) continue;
      const double time = idle_.within(task.rank, task.without_last, task.ready);
      if (waits.size() == kept && time <= waits.back().time) continue;
      waits.push_back({.task = static_cast<int>(t), .time = time, .for_what = {}});
      std::sort(waits.begin(), waits.end(),
                [](const Wait& a, const Wait& b) { return a.time > b.time; });
      if (waits.size() > kept) waits.pop_back();
    }
    for (Wait& wait : waits)
      wait.for_what = awaited(log_.tasks[static_cast<std::size_t>(wait.task)]);
    report_.waits = std::move(waits);
  }

  std::string awaited(const TraceTask& task) const {
    if (task.last_input < 0)
      return task.kind == TraceKind::dt
                 ? "the ranks' agreement on the time step"
                 : fmt::format("step {} to be finished everywhere", task.step - max_lead);
    const TraceTask& input = log_.tasks[static_cast<std::size_t>(task.last_input)];
    if (input.kind == TraceKind::unpack && input.last_message >= 0)
      return fmt::format("{}, from rank {}", task_name(log_, input),
                         log_.messages[static_cast<std::size_t>(input.last_message)].from);
    return task_name(log_, input);
  }

  void find_patches() {
    constexpr std::size_t kept = 10;
    std::map<int, PatchUse> uses;
    double particles = 0, total = 0;
    for (const TraceTask& task : log_.tasks) {
      if (task.kind != TraceKind::task) continue;
      PatchUse& use = uses[task.patch];
      use.rank = task.rank;
      use.total += duration(task);
      total += duration(task);
      if (task.phase == 0) {
        const auto n = static_cast<double>(particles_of(task));
        use.per_particle += n;  // so far: particle-steps
        particles += n;
      }
    }
    const double mean = total / static_cast<double>(uses.size());
    const double mean_particles = particles / static_cast<double>(uses.size());
    const auto& last = log_.graphs.back().patches;
    std::vector<PatchUse> all;
    for (auto& [number, use] : uses) {
      use.number = number;
      use.over_mean = mean > 0 ? use.total / mean : 1;
      const double more = mean_particles > 0 ? use.per_particle / mean_particles : 1;
      use.per_particle = use.per_particle > 0 ? use.total / use.per_particle : 0;
      const double slower = particles > 0 ? use.per_particle / (total / particles) : 1;
      use.why = slower > std::max(more, 1.05)
                    ? fmt::format("{:.1f} times the time per particle", slower)
                    : fmt::format("{:.1f} times the particles", more);
      if (const auto at = last.find(number); at != last.end()) {
        use.particles = at->second.particles;
        use.cells = at->second.cells;
      }
      all.push_back(use);
    }
    std::sort(all.begin(), all.end(),
              [](const PatchUse& a, const PatchUse& b) { return a.total > b.total; });
    if (all.size() > kept) all.resize(kept);
    report_.patches = std::move(all);
  }

  void find_exchange() {
    ExchangeUse& use = report_.exchange;
    for (const TraceMessage& m : log_.messages) {
      ++use.messages;
      use.bytes += m.bytes;
      use.in_flight += std::max(0.0, m.arrived - m.sent);
    }
    // When the last thing that a task waited for was a message; each moment counts once.
    std::vector<std::vector<std::pair<double, double>>> windows(
        static_cast<std::size_t>(log_.run.ranks));
    for (const TraceTask& task : log_.tasks) {
      if (task.last_input < 0) continue;
      const TraceTask& input = log_.tasks[static_cast<std::size_t>(task.last_input)];
      if (input.kind == TraceKind::unpack && task.ready > task.without_last)
        windows[static_cast<std::size_t>(task.rank)].push_back({task.without_last, task.ready});
    }
    for (std::size_t r = 0; r < windows.size(); ++r) {
      std::sort(windows[r].begin(), windows[r].end());
      double until = origin_;
      for (const auto& [begin, end] : windows[r]) {
        use.exposed += idle_.within(static_cast<int>(r), std::max(begin, until), end);
        until = std::max(until, end);
      }
    }
  }

  /// Steps of the patch that is furthest ahead and of the last one, over time.
  void find_spread() {
    std::map<int, Step> at;
    std::map<Step, int> count;
    double weighted = 0, previous = origin_, time = 0;
    for (const TraceTask& task : log_.tasks) {
      if (task.kind != TraceKind::task || task.phase != 0) continue;
      if (!count.empty()) {
        const auto spread = static_cast<int>(count.rbegin()->first - count.begin()->first);
        weighted += spread * (task.begin - previous);
        time += task.begin - previous;
        report_.spread.largest = std::max(report_.spread.largest, spread);
      }
      previous = task.begin;
      const auto [patch, is_new] = at.emplace(task.patch, task.step);
      if (!is_new) {
        if (--count[patch->second] == 0) count.erase(patch->second);
        patch->second = task.step;
      }
      ++count[task.step];
    }
    if (time > 0) report_.spread.mean = weighted / time;
  }

  // --- losses -----------------------------------------------------------------------------------

  double on_path(PathPart::Kind kind) const {
    return report_.path.by_kind[static_cast<std::size_t>(kind)];
  }

  /// The run's time is the path's: what its tasks take beyond an even share of all work is lost to
  /// imbalance, and the rest of it to what the other parts are.
  void find_losses() {
    const double wall = log_.run.wall;
    const auto share = [&](double time) { return 100 * time / wall; };
    const auto add = [&](const char* name, double loss, const std::string& text) {
      report_.findings.push_back({name, loss, text});
    };
    const double tasks = on_path(PathPart::Kind::task);
    add("imbalance", std::max(0.0, tasks - report_.ideal_time), imbalance_text(tasks));
    add("late sender", on_path(PathPart::Kind::posting), late_text());
    add("messages", on_path(PathPart::Kind::transit),
        fmt::format("{:.1f} % of the time the path waits for messages between ranks that are on "
                    "their way",
                    share(on_path(PathPart::Kind::transit))));
    add("serial section", on_path(PathPart::Kind::step),
        fmt::format("{:.1f} % of the time the path is in what one thread does when a step is "
                    "finished, or waits for it: patches may be at most {} steps ahead",
                    share(on_path(PathPart::Kind::step)), max_lead));
    add("time step", on_path(PathPart::Kind::time_step),
        fmt::format("{:.1f} % of the time the path waits for the ranks to agree on the time step",
                    share(on_path(PathPart::Kind::time_step))));
    add("runtime", on_path(PathPart::Kind::start),
        fmt::format("{:.1f} % of the time the path waits for tasks to begin that are ready",
                    share(on_path(PathPart::Kind::start))));
    std::stable_sort(report_.findings.begin(), report_.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.loss > b.loss; });
  }

  std::string imbalance_text(double tasks) const {
    std::map<int, double> by_patch;
    std::map<int, double> by_rank;
    for (const PathPart& part : report_.path.parts) {
      if (part.kind != PathPart::Kind::task) continue;
      const TraceTask& task = log_.tasks[static_cast<std::size_t>(part.task)];
      by_rank[task.rank] += part.end - part.begin;
      if (task.kind == TraceKind::task) by_patch[task.patch] += part.end - part.begin;
    }
    const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto patch = std::max_element(by_patch.begin(), by_patch.end(), less);
    const auto rank = std::max_element(by_rank.begin(), by_rank.end(), less);
    std::string text = fmt::format(
        "tasks on the path take {:.1f} % of the time, an even share of all work {:.1f} %",
        100 * tasks / log_.run.wall, 100 * report_.ideal_time / log_.run.wall);
    if (patch != by_patch.end() && patch->second > 0.4 * tasks) {
      text +=
          fmt::format("; {:.0f} % of them are patch {}", 100 * patch->second / tasks, patch->first);
      for (const PatchUse& use : report_.patches)
        if (use.number == patch->first) text += " (" + use.why + ")";
    } else if (log_.run.ranks > 1 && rank != by_rank.end()) {
      text +=
          fmt::format("; {:.0f} % of them are on rank {}", 100 * rank->second / tasks, rank->first);
    }
    return text;
  }

  std::string late_text() const {
    std::map<int, double> by_rank;
    for (const PathPart& part : report_.path.parts)
      if (part.kind == PathPart::Kind::posting)
        by_rank[log_.tasks[static_cast<std::size_t>(part.task)].rank] += part.end - part.begin;
    std::string text = fmt::format(
        "{:.1f} % of the time the path waits for messages that are ready and not yet posted",
        100 * on_path(PathPart::Kind::posting) / log_.run.wall);
    if (by_rank.empty()) return text;
    const auto worst = std::max_element(by_rank.begin(), by_rank.end(),
                                        [](auto& a, auto& b) { return a.second < b.second; });
    return text + fmt::format(", most of them of rank {}", worst->first);
  }

  const TraceLog& log_;
  Workers workers_;
  IdleTime idle_;
  double origin_ = 0, end_ = 0;
  TraceReport report_;
};

}  // namespace

TraceReport analyse(const TraceLog& log) {
  return Analysis(log).report();
}

}  // namespace lahar
