/// \file Lists and sums of an analysis: waits, patches, messages, and how far patches were apart.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "graph/executor.h"
#include "runtime/trace/analyse/analysis_parts.h"

namespace lahar {

std::string task_name(const TraceLog& log, const TraceTask& task) {
  const std::string round = task.round >= 0
                                ? fmt::format("round {} of step {}", task.round, task.step)
                                : fmt::format("step {}", task.step);
  if (task.kind == TraceKind::dt)
    return (task.round >= 0 ? "the sums for " : "the time step of ") + round;
  return fmt::format("{} of patch {}, {}",
                     log.run.phases[static_cast<std::size_t>(task.phase)].name, task.patch, round);
}

namespace {

std::string awaited(const TraceLog& log, const TraceTask& task) {
  if (task.last_input < 0)
    return task.kind == TraceKind::dt
               ? std::string("the ranks' agreement on ") +
                     (task.round >= 0 ? "the sums of a round" : "the time step")
               : fmt::format("step {} to be finished everywhere", task.step - max_lead);
  const TraceTask& input = log.tasks[static_cast<std::size_t>(task.last_input)];
  if (task.from_rest) return task_name(log, input) + ", and what a solver did then";
  if (input.kind == TraceKind::unpack && input.last_message >= 0)
    return fmt::format("{}, from rank {}", task_name(log, input),
                       log.messages[static_cast<std::size_t>(input.last_message)].from);
  return task_name(log, input);
}

}  // namespace

std::int64_t particles_of(const TraceLog& log, const TraceTask& task) {
  const TraceGraph& graph = log.graph_at(task.step);
  const auto patch = graph.patches.find(task.patch);
  return patch == graph.patches.end() ? 0 : patch->second.particles;
}

std::vector<Wait> longest_waits(const TraceLog& log, const IdleTime& idle) {
  constexpr std::size_t kept = 10;
  std::vector<Wait> waits;
  for (std::size_t t = 0; t < log.tasks.size(); ++t) {
    const TraceTask& task = log.tasks[t];
    if (task.ready <= task.without_last || task.kind == TraceKind::unpack) continue;
    const double time = idle.within(task.rank, task.without_last, task.ready);
    if (waits.size() == kept && time <= waits.back().time) continue;
    // One of the tasks of a rank that wait at the same time is enough.
    const auto same = std::find_if(waits.begin(), waits.end(), [&](const Wait& wait) {
      const TraceTask& other = log.tasks[static_cast<std::size_t>(wait.task)];
      return other.rank == task.rank && other.without_last < task.ready &&
             task.without_last < other.ready;
    });
    if (same != waits.end()) {
      if (same->time >= time) continue;
      waits.erase(same);
    }
    waits.push_back({.task = static_cast<int>(t), .time = time, .for_what = {}});
    std::sort(waits.begin(), waits.end(),
              [](const Wait& a, const Wait& b) { return a.time > b.time; });
    if (waits.size() > kept) waits.pop_back();
  }
  for (Wait& wait : waits)
    wait.for_what = awaited(log, log.tasks[static_cast<std::size_t>(wait.task)]);
  return waits;
}

std::vector<PatchUse> slowest_patches(const TraceLog& log) {
  constexpr std::size_t kept = 10;
  std::map<int, PatchUse> uses;
  double particles = 0, total = 0;
  for (const TraceTask& task : log.tasks) {
    if (task.kind != TraceKind::task) continue;
    PatchUse& use = uses[task.patch];
    use.rank = task.rank;
    use.total += duration(task);
    total += duration(task);
    if (task.phase == 0) {
      const auto n = static_cast<double>(particles_of(log, task));
      use.per_particle += n;  // so far: particle-steps
      particles += n;
    }
  }
  const double mean = total / static_cast<double>(uses.size());
  const double mean_particles = particles / static_cast<double>(uses.size());
  const auto& last = log.graphs.back().patches;
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
  return all;
}

ExchangeUse exchange_of(const TraceLog& log, const IdleTime& idle) {
  ExchangeUse use;
  for (const TraceMessage& m : log.messages) {
    ++use.messages;
    use.bytes += m.bytes;
    use.in_flight += std::max(0.0, m.there - m.posted);
    use.unseen += m.given - m.there;
  }
  // When the last thing that a task waited for was a message; each moment counts once.
  std::vector<std::vector<std::pair<double, double>>> windows(
      static_cast<std::size_t>(log.run.ranks));
  for (const TraceTask& task : log.tasks) {
    if (task.last_input < 0) continue;
    const TraceTask& input = log.tasks[static_cast<std::size_t>(task.last_input)];
    if (input.kind == TraceKind::unpack && task.ready > task.without_last)
      windows[static_cast<std::size_t>(task.rank)].push_back({task.without_last, task.ready});
  }
  for (std::size_t r = 0; r < windows.size(); ++r) {
    std::sort(windows[r].begin(), windows[r].end());
    double until = log.tasks.front().begin;
    for (const auto& [begin, end] : windows[r]) {
      use.exposed += idle.within(static_cast<int>(r), std::max(begin, until), end);
      until = std::max(until, end);
    }
  }
  return use;
}

/// Steps of the patch that is furthest ahead and of the last one, over time.
StepSpread spread_of(const TraceLog& log) {
  StepSpread result;
  std::map<int, Step> at;
  std::map<Step, int> count;
  double weighted = 0, previous = log.tasks.front().begin, time = 0;
  const TraceGraph* graph = nullptr;
  for (const TraceTask& task : log.tasks) {
    if (task.kind != TraceKind::task || task.phase != 0) continue;
    if (const TraceGraph* now = &log.graph_at(task.step); now != graph) {
      graph = now;  // all have done the same steps, and some patches may be no more
      at.clear();
      count.clear();
    }
    if (!count.empty()) {
      const auto spread = static_cast<int>(count.rbegin()->first - count.begin()->first);
      weighted += spread * (task.begin - previous);
      time += task.begin - previous;
      result.largest = std::max(result.largest, spread);
    }
    previous = task.begin;
    const auto [patch, is_new] = at.emplace(task.patch, task.step);
    if (!is_new) {
      if (--count[patch->second] == 0) count.erase(patch->second);
      patch->second = task.step;
    }
    ++count[task.step];
  }
  if (time > 0) result.mean = weighted / time;
  return result;
}

double disturbance_of(const TraceLog& log) {
  std::map<std::pair<int, int>, std::vector<double>> durations;  // by patch and phase
  for (const TraceTask& task : log.tasks)
    if (task.kind == TraceKind::task) durations[{task.patch, task.phase}].push_back(duration(task));
  double all = 0, medians = 0;
  for (auto& [which, list] : durations) {
    for (const double time : list) all += time;
    const auto middle = list.begin() + static_cast<std::ptrdiff_t>(list.size() / 2);
    std::nth_element(list.begin(), middle, list.end());
    medians += *middle * static_cast<double>(list.size());
  }
  return medians > 0 ? all / medians : 1;
}

}  // namespace lahar
