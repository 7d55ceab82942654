/// \file What an analysis says, for people.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/terminal/console.h"
#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/analysis_parts.h"
#include "runtime/trace/analyse/counters.h"

namespace lahar {

namespace {

/// 1.23 s, 4.56 ms, 7.89 us.
std::string time_text(double seconds) {
  const double size = std::abs(seconds);
  if (size >= 1) return fmt::format("{:.3g} s", seconds);
  if (size >= 1e-3) return fmt::format("{:.3g} ms", seconds * 1e3);
  return fmt::format("{:.3g} us", seconds * 1e6);
}

std::string percent(double share) {
  return fmt::format("{:.1f} %", 100 * share);
}

std::string head_text(const TraceLog& log, const TraceReport& report) {
  const TraceRun& run = log.run;
  std::string text = fmt::format(
      "{}\n{}: steps {} to {}, {} {} x {} workers, {} tasks in {}, {} per step\n",
      run.title.empty() ? "trace" : run.title, run.executor, run.first, run.last, run.ranks,
      run.ranks == 1 ? "rank" : "ranks",
      report.workers.size() / static_cast<std::size_t>(run.ranks), log.tasks.size(),
      time_text(run.wall), time_text(run.wall / static_cast<double>(run.last - run.first + 1)));
  if (run.ranks > 1)
    text += run.clock_bound > 0
                ? fmt::format("clocks of ranks agree within {}\n", time_text(run.clock_bound))
                : "ranks share a clock\n";
  if (report.disturbance > disturbed)
    text += fmt::format(
        "note: tasks took {:.1f} times their median on average. Where work is even, something else "
        "ran on these cores, and losses are not the program's alone.\n",
        report.disturbance);
  return text;
}

std::string losses_text(const TraceLog& log, const TraceReport& report) {
  std::string text = fmt::format("\nWhere the time went ({} = {} of even work + losses)\n",
                                 time_text(log.run.wall), time_text(report.ideal_time));
  for (const Finding& finding : report.findings)
    if (finding.loss > 0.001 * log.run.wall)
      text += fmt::format("  {:<16}{:>8}  {}\n", finding.name, percent(finding.loss / log.run.wall),
                          finding.text);
  return text;
}

std::string efficiency_text(const TraceReport& report) {
  const Efficiencies& e = report.efficiencies;
  std::string text = fmt::format(
      "\nEfficiencies (POP)\n  parallel efficiency        {:>8}\n    load balance             {:>8}"
      "   (of ranks {})\n    communication efficiency {:>8}\n",
      percent(e.parallel), percent(e.load_balance), percent(e.by_ranks), percent(e.communication));
  if (e.replayed)
    text += fmt::format("      serialisation          {:>8}\n      transfer               {:>8}\n",
                        percent(e.serialisation), percent(e.transfer));
  return text;
}

/// How often solvers' loops were taken.
std::string loops_text(const TraceLog& log, const TraceReport& report) {
  if (!log.run.has_solves()) return "";
  const auto steps = static_cast<double>(log.run.last - log.run.first + 1);
  std::string text = "\nLoops of a step, each a graph that drains before another one begins\n";
  text += fmt::format("  {:<14}{:>9}{:>14}{:>11}{:>14}{:>8}\n", "loop", "rounds", "per step",
                      "wall time", "per round", "share");
  for (const LoopUse& loop : report.loops)
    text += fmt::format("  {:<14}{:>9}{:>14.1f}{:>11}{:>14}{:>8}\n", loop.name, loop.turns,
                        static_cast<double>(loop.turns) / steps, time_text(loop.wall),
                        time_text(loop.turns > 0 ? loop.wall / static_cast<double>(loop.turns) : 0),
                        percent(loop.wall / log.run.wall));
  return text;
}

std::string stages_text(const TraceLog& log, const TraceReport& report) {
  std::string text = fmt::format(
      "\n  {:<14}{:>9}{:>11}{:>10}{:>10}{:>10}{:>10}{:>8}{:>9}{:>9}{:>12}{:>9}\n", "stage", "tasks",
      "total", "mean", "p50", "p95", "max", "share", "ranks", "threads", "ns/particle", "path");
  std::string loop;
  for (const StageUse& s : report.stages) {
    if (log.run.has_solves() && s.loop != loop) text += fmt::format(" {}\n", loop = s.loop);
    text += fmt::format(
        "  {:<14}{:>9}{:>11}{:>10}{:>10}{:>10}{:>10}{:>8}{:>9.2f}{:>9.2f}{:>12}{:>9}\n", s.stage,
        s.count, time_text(s.total), time_text(s.mean), time_text(s.p50), time_text(s.p95),
        time_text(s.longest), percent(s.share), s.by_ranks, s.by_threads,
        s.per_particle > 0 ? fmt::format("{:.1f}", s.per_particle * 1e9) : "-",
        time_text(s.on_path));
  }
  return text +
         "  ranks, threads: the most that one had over the mean; path: of the critical path\n";
}

std::string path_text(const TraceLog& log, const TraceReport& report) {
  const CriticalPath& path = report.path;
  std::string text = "\nCritical path\n";
  for (std::size_t k = 0; k < path.by_kind.size(); ++k)
    if (path.by_kind[k] > 0)
      text += fmt::format("  {:<28}{:>10}{:>9}\n", name_of(static_cast<PathPart::Kind>(k)),
                          time_text(path.by_kind[k]), percent(path.by_kind[k] / log.run.wall));
  text += fmt::format(
      "  longest chain of tasks {}: more cores could make the run at most {:.1f} times faster\n",
      time_text(path.longest_chain), path.speedup_left);
  return text;
}

std::string exchange_text(const TraceLog& log, const TraceReport& report) {
  const ExchangeUse& use = report.exchange;
  std::string text = fmt::format("\nPatches were {:.1f} steps apart on average, at most {}.\n",
                                 report.spread.mean, report.spread.largest);
  if (use.messages == 0) return text;
  const auto n = static_cast<double>(use.messages);
  return text +
         fmt::format(
             "{} messages between ranks, {:.1f} MB: each {} on its way and {} until somebody "
             "looked, on average.\nWorkers were idle for messages {} in all ({} of their time).\n",
             use.messages, static_cast<double>(use.bytes) / 1e6, time_text(use.in_flight / n),
             time_text(use.unseen / n), time_text(use.exposed),
             percent(use.exposed / (log.run.wall * static_cast<double>(report.workers.size()))));
}

/// A line per rank: how its counters went.
std::string counters_text(const TraceLog& log) {
  std::string text = "\nCounters: active particles, memory, load (share of the time in tasks)\n";
  const auto least_and_most = [&](TraceCounter counter, int rank, auto write) {
    const std::vector<TraceValue> values = values_of(log, counter, rank);
    if (values.empty()) return std::string("-");
    const auto [least, most] = std::minmax_element(
        values.begin(), values.end(),
        [](const TraceValue& a, const TraceValue& b) { return a.value < b.value; });
    const std::string low = write(least->value), high = write(most->value);
    return low == high ? low : low + " to " + high;
  };
  for (int r = 0; r < log.run.ranks; ++r)
    text += fmt::format(
        "  rank {:<4}{:>24}{:>26}{:>22}\n", r,
        least_and_most(TraceCounter::particles, r,
                       [](double v) { return format_count(static_cast<Index>(v)); }),
        least_and_most(TraceCounter::memory, r, [](double v) { return format_bytes(v); }),
        least_and_most(TraceCounter::load, r,
                       [](double v) { return fmt::format("{:.0f} %", 100 * v); }));
  return text;
}

std::string lists_text(const TraceLog& log, const TraceReport& report) {
  std::string text = "\nSlowest patches\n";
  for (std::size_t k = 0; k < std::min<std::size_t>(5, report.patches.size()); ++k) {
    const PatchUse& p = report.patches[k];
    text += fmt::format("  patch {:<6} rank {:<4}{:>8} particles{:>10}  {:.2f} of the mean: {}\n",
                        p.number, p.rank, p.particles, time_text(p.total), p.over_mean, p.why);
  }
  text += "\nLongest waits of idle workers, and what came last\n";
  for (std::size_t k = 0; k < std::min<std::size_t>(5, report.waits.size()); ++k) {
    const Wait& wait = report.waits[k];
    const TraceTask& task = log.tasks[static_cast<std::size_t>(wait.task)];
    text += fmt::format("  {:>9}  {} on rank {} for {}\n", time_text(wait.time),
                        task_name(log, task), task.rank, wait.for_what);
  }
  return text;
}

std::string workers_text(const TraceLog& log, const TraceReport& report) {
  std::string text = fmt::format("\n  {:<20}{:>9}{:>10}{:>9}{:>9}{:>9}{:>9}\n", "worker", "useful",
                                 "messages", "polling", "runtime", "other", "idle");
  const auto share = [&](double time) { return percent(time / log.run.wall); };
  for (const WorkerUse& w : report.workers)
    text +=
        fmt::format("  {:<20}{:>9}{:>10}{:>9}{:>9}{:>9}{:>9}\n",
                    fmt::format("rank {} thread {}", w.rank,
                                w.thread < (1 << 20) ? std::to_string(w.thread) : "without task"),
                    share(w.useful), share(w.messages), share(w.polling), share(w.runtime),
                    share(w.other), share(w.idle));
  return text;
}

}  // namespace

std::string text_of(const TraceLog& log, const TraceReport& report) {
  return head_text(log, report) + losses_text(log, report) + efficiency_text(report) +
         loops_text(log, report) + stages_text(log, report) + path_text(log, report) +
         exchange_text(log, report) + workers_text(log, report) + counters_text(log) +
         lists_text(log, report);
}

}  // namespace lahar
