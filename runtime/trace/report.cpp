/// What an analysis says, for people and for programs.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "runtime/trace/analysis.h"

namespace lahar {

namespace {

using nlohmann::json;

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
  std::string text = fmt::format("{}\n{}: steps {} to {}, {} {} x {} workers, {} tasks in {}\n",
                                 run.title.empty() ? "trace" : run.title, run.executor, run.first,
                                 run.last, run.ranks, run.ranks == 1 ? "rank" : "ranks",
                                 report.workers.size() / static_cast<std::size_t>(run.ranks),
                                 log.tasks.size(), time_text(run.wall));
  if (run.ranks > 1)
    text += fmt::format("clocks of ranks agree within {}\n", time_text(run.clock_bound));
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

std::string stages_text(const TraceReport& report) {
  std::string text = fmt::format(
      "\n  {:<14}{:>9}{:>11}{:>10}{:>10}{:>10}{:>10}{:>8}{:>9}{:>9}{:>12}{:>9}\n", "stage", "tasks",
      "total", "mean", "p50", "p95", "max", "share", "ranks", "threads", "ns/particle", "path");
  for (const StageUse& s : report.stages)
    text += fmt::format(
        "  {:<14}{:>9}{:>11}{:>10}{:>10}{:>10}{:>10}{:>8}{:>9.2f}{:>9.2f}{:>12}{:>9}\n", s.stage,
        s.count, time_text(s.total), time_text(s.mean), time_text(s.p50), time_text(s.p95),
        time_text(s.longest), percent(s.share), s.by_ranks, s.by_threads,
        s.per_particle > 0 ? fmt::format("{:.1f}", s.per_particle * 1e9) : "-",
        time_text(s.on_path));
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

std::string exchange_text(const TraceReport& report) {
  const ExchangeUse& use = report.exchange;
  std::string text = fmt::format("\nPatches were {:.1f} steps apart on average, at most {}.\n",
                                 report.spread.mean, report.spread.largest);
  if (use.messages == 0) return text;
  return text + fmt::format(
                    "{} messages between ranks, {:.1f} MB, {} on their way; workers were idle for "
                    "them {}.\n",
                    use.messages, static_cast<double>(use.bytes) / 1e6, time_text(use.in_flight),
                    time_text(use.exposed));
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
    const std::string what =
        task.kind == TraceKind::dt
            ? fmt::format("time step {}", task.step)
            : fmt::format("{} of patch {}, step {}",
                          log.run.phases[static_cast<std::size_t>(task.phase)].name, task.patch,
                          task.step);
    text += fmt::format("  {:>9}  {} on rank {} for {}\n", time_text(wait.time), what, task.rank,
                        wait.for_what);
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

json task_json(const TraceLog& log, int t) {
  const TraceTask& task = log.tasks[static_cast<std::size_t>(t)];
  return {{"phase", task.kind == TraceKind::dt
                        ? "dt"
                        : log.run.phases[static_cast<std::size_t>(task.phase)].name},
          {"patch", task.patch},
          {"step", task.step},
          {"rank", task.rank},
          {"thread", task.thread},
          {"begin", task.begin},
          {"end", task.end}};
}

json stages_json(const TraceReport& report) {
  json list = json::array();
  for (const StageUse& s : report.stages)
    list.push_back({{"phase", s.phase},
                    {"stage", s.stage},
                    {"count", s.count},
                    {"total", s.total},
                    {"mean", s.mean},
                    {"p50", s.p50},
                    {"p95", s.p95},
                    {"max", s.longest},
                    {"share", s.share},
                    {"imbalance_ranks", s.by_ranks},
                    {"imbalance_threads", s.by_threads},
                    {"per_particle", s.per_particle},
                    {"on_path", s.on_path}});
  return list;
}

json path_json(const TraceReport& report) {
  json kinds = json::object();
  for (std::size_t k = 0; k < report.path.by_kind.size(); ++k)
    kinds[std::string(name_of(static_cast<PathPart::Kind>(k)))] = report.path.by_kind[k];
  return {{"by_kind", kinds},
          {"work", report.path.work},
          {"longest_chain", report.path.longest_chain},
          {"speedup_left", report.path.speedup_left}};
}

}  // namespace

std::string text_of(const TraceLog& log, const TraceReport& report) {
  return head_text(log, report) + losses_text(log, report) + efficiency_text(report) +
         stages_text(report) + path_text(log, report) + exchange_text(report) +
         workers_text(log, report) + lists_text(log, report);
}

std::string json_of(const TraceLog& log, const TraceReport& report) {
  const Efficiencies& e = report.efficiencies;
  json out{{"title", log.run.title},
           {"version", log.run.version},
           {"executor", log.run.executor},
           {"ranks", log.run.ranks},
           {"threads", log.run.threads},
           {"first_step", log.run.first},
           {"last_step", log.run.last},
           {"wall", log.run.wall},
           {"clock_bound", log.run.clock_bound},
           {"tasks", log.tasks.size()},
           {"ideal_time", report.ideal_time},
           {"stages", stages_json(report)},
           {"critical_path", path_json(report)},
           {"steps_apart", {{"mean", report.spread.mean}, {"max", report.spread.largest}}},
           {"exchange",
            {{"messages", report.exchange.messages},
             {"bytes", report.exchange.bytes},
             {"in_flight", report.exchange.in_flight},
             {"exposed", report.exchange.exposed}}},
           {"efficiencies",
            {{"parallel", e.parallel},
             {"load_balance", e.load_balance},
             {"load_balance_ranks", e.by_ranks},
             {"communication", e.communication}}}};
  if (e.replayed) {
    out["efficiencies"]["serialisation"] = e.serialisation;
    out["efficiencies"]["transfer"] = e.transfer;
  }
  for (const Finding& f : report.findings)
    out["findings"].push_back({{"name", f.name}, {"loss", f.loss}, {"text", f.text}});
  for (const WorkerUse& w : report.workers)
    out["workers"].push_back({{"rank", w.rank},
                              {"thread", w.thread},
                              {"useful", w.useful},
                              {"messages", w.messages},
                              {"polling", w.polling},
                              {"runtime", w.runtime},
                              {"other", w.other},
                              {"idle", w.idle}});
  for (const PatchUse& p : report.patches)
    out["slowest_patches"].push_back({{"patch", p.number},
                                      {"rank", p.rank},
                                      {"particles", p.particles},
                                      {"cells", p.cells},
                                      {"total", p.total},
                                      {"over_mean", p.over_mean},
                                      {"per_particle", p.per_particle},
                                      {"why", p.why}});
  for (const Wait& w : report.waits)
    out["longest_waits"].push_back(
        {{"task", task_json(log, w.task)}, {"time", w.time}, {"for", w.for_what}});
  return out.dump(1);
}

}  // namespace lahar
