#include "runtime/trace/analyse/analysis.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <set>

#include "runtime/trace/analyse/analysis_parts.h"
#include "runtime/trace/analyse/critical_path.h"
#include "runtime/trace/analyse/idle_time.h"

namespace lahar {

namespace {

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

class Analysis {
 public:
  explicit Analysis(const TraceLog& log)
      : log_(log), workers_(workers_of(log)), idle_(log, workers_) {
    origin_ = log.tasks.front().begin;
    end_ = origin_ + log.run.wall;
  }

  TraceReport report() {
    use_workers();
    find_turns();
    use_stages();
    use_loops();
    find_efficiencies();
    find_path();
    report_.waits = longest_waits(log_, idle_);
    report_.patches = slowest_patches(log_);
    report_.exchange = exchange_of(log_, idle_);
    report_.spread = spread_of(log_);
    report_.disturbance = disturbance_of(log_);
    report_.findings = losses_of(log_, report_);
    return std::move(report_);
  }

 private:
  const auto& phase(const TraceTask& task) const {
    return log_.run.phases[static_cast<std::size_t>(task.phase)];
  }
  std::size_t worker(int rank, int thread) const { return workers_.place(rank, thread); }

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
          i.kind == TraceKind::checkpoint || i.kind == TraceKind::trace ||
          i.kind == TraceKind::direct)
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
      if (task.kind != TraceKind::task || !is_taken(task)) continue;
      const auto f = static_cast<std::size_t>(task.phase);
      particles[f] += static_cast<double>(particles_of(log_, task));
      const std::size_t w = worker(task.rank, task.thread);
      for (std::size_t s = 0; s < phases[f].stages.size(); ++s) {
        times[f][s].push_back(task.stage[s]);
        by_worker[f][s][w] += task.stage[s];
      }
    }
    for (std::size_t f = 0; f < phases.size(); ++f)
      for (std::size_t s = 0; s < phases[f].stages.size(); ++s) {
        report_.stages.push_back(use_of(phases[f].name, phases[f].stages[s], times[f][s],
                                        by_worker[f][s], particles[f]));
        report_.stages.back().loop = loop_of(static_cast<int>(f)).name;
      }
  }

  const TraceRun::Loop& loop_of(int phase) const {
    return log_.run.loops[static_cast<std::size_t>(log_.run.loop_of(phase))];
  }

  /// A step of a graph may have a round more than is taken: in it, nothing is done by any task.
  void find_turns() {
    turns_.resize(log_.run.loops.size());
    for (const TraceTask& task : log_.tasks) {
      const bool works =
          task.round < 0 || std::ranges::any_of(task.stage, [](float t) { return t > 0; });
      if (task.kind == TraceKind::task && works)
        turns_[static_cast<std::size_t>(log_.run.loop_of(task.phase))].insert(task.turn());
    }
  }
  bool is_taken(const TraceTask& task) const {
    return task.round < 0 ||
           turns_[static_cast<std::size_t>(log_.run.loop_of(task.phase))].contains(task.round);
  }

  /// Graphs of loops follow each other: one ends where the first task of another begins.
  void use_loops() {
    for (const TraceRun::Loop& loop : log_.run.loops) report_.loops.push_back({.name = loop.name});
    int present = -1;
    double begin = 0, end = 0;
    for (const TraceTask& task : log_.tasks) {  // by beginning
      const int loop = log_.run.loop_of(task.phase);
      if (loop != present || (task.from_rest && task.begin >= end)) {
        if (present >= 0) report_.loops[static_cast<std::size_t>(present)].wall += end - begin;
        begin = task.begin;
        end = task.end;
        present = loop;
      }
      end = std::max(end, task.end);
    }
    if (present >= 0) report_.loops[static_cast<std::size_t>(present)].wall += end - begin;
    for (std::size_t l = 0; l < turns_.size(); ++l)
      report_.loops[l].turns = static_cast<std::int64_t>(turns_[l].size());
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

  const TraceLog& log_;
  Workers workers_;
  IdleTime idle_;
  double origin_ = 0, end_ = 0;
  std::vector<std::set<Step>> turns_;  ///< by loop: that were taken
  TraceReport report_;
};

}  // namespace

TraceReport analyse(const TraceLog& log) {
  return Analysis(log).report();
}

}  // namespace lahar
