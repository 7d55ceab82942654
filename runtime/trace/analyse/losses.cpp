/// \file What costs most, in words.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "graph/executor.h"
#include "runtime/trace/analyse/analysis_parts.h"

namespace lahar {

namespace {

double on_path(const TraceReport& report, PathPart::Kind kind) {
  return report.path.by_kind[static_cast<std::size_t>(kind)];
}

std::string imbalance_text(const TraceLog& log, const TraceReport& report, double tasks) {
  std::map<int, double> by_patch;
  std::map<int, double> by_rank;
  for (const PathPart& part : report.path.parts) {
    if (part.kind != PathPart::Kind::task) continue;
    const TraceTask& task = log.tasks[static_cast<std::size_t>(part.task)];
    by_rank[task.rank] += part.end - part.begin;
    if (task.kind == TraceKind::task) by_patch[task.patch] += part.end - part.begin;
  }
  const auto less = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto patch = std::max_element(by_patch.begin(), by_patch.end(), less);
  const auto rank = std::max_element(by_rank.begin(), by_rank.end(), less);
  std::string text =
      fmt::format("tasks on the path take {:.1f} % of the time, an even share of all work {:.1f} %",
                  100 * tasks / log.run.wall, 100 * report.ideal_time / log.run.wall);
  if (patch != by_patch.end() && patch->second > 0.4 * tasks) {
    text +=
        fmt::format("; {:.0f} % of them are patch {}", 100 * patch->second / tasks, patch->first);
    for (const PatchUse& use : report.patches)
      if (use.number == patch->first) text += " (" + use.why + ")";
  } else if (log.run.ranks > 1 && rank != by_rank.end()) {
    text +=
        fmt::format("; {:.0f} % of them are on rank {}", 100 * rank->second / tasks, rank->first);
  }
  return text;
}

std::string late_text(const TraceLog& log, const TraceReport& report) {
  std::map<int, double> by_rank;
  for (const PathPart& part : report.path.parts)
    if (part.kind == PathPart::Kind::posting)
      by_rank[log.tasks[static_cast<std::size_t>(part.task)].rank] += part.end - part.begin;
  const std::string text = "the path waits for messages that are ready and not yet posted";
  if (by_rank.empty()) return text;
  const auto worst = std::max_element(by_rank.begin(), by_rank.end(),
                                      [](auto& a, auto& b) { return a.second < b.second; });
  return text + fmt::format(", most of them of rank {}", worst->first);
}

}  // namespace

/// The run's time is the path's: what its tasks take beyond an even share of all work is lost to
/// imbalance, and the rest of it to what the other parts are.
std::vector<Finding> losses_of(const TraceLog& log, const TraceReport& report) {
  std::vector<Finding> losses;
  const auto add = [&](const char* name, PathPart::Kind kind, const std::string& text) {
    losses.push_back({name, on_path(report, kind), text});
  };
  const double tasks = on_path(report, PathPart::Kind::task);
  losses.push_back(
      {"imbalance", std::max(0.0, tasks - report.ideal_time), imbalance_text(log, report, tasks)});
  add("late sender", PathPart::Kind::posting, late_text(log, report));
  add("messages", PathPart::Kind::transit,
      "the path waits for messages between ranks that are on their way");
  add("late receiver", PathPart::Kind::unseen,
      "the path waits for messages that may have come, but all threads of the receiver were in "
      "tasks and "
      "did not look");
  add("serial section", PathPart::Kind::step,
      fmt::format(
          "the path is in what one thread does when a step is finished, or in making and moving "
          "patches, or waits for that: patches may be at most {} steps ahead",
          max_lead));
  add("time step", PathPart::Kind::time_step,
      "the path waits for the ranks to agree on the time step");
  add("reductions", PathPart::Kind::sums,
      "the path waits for the ranks to add up the sums of a solver's round");
  add("direct solves", PathPart::Kind::direct,
      "the path is in a linear system that one thread solves");
  add("between graphs", PathPart::Kind::between,
      "the path is between two graphs of a step that begins with a solve, where nothing runs: "
      "decisions of solvers, agreements of ranks");
  add("barriers", PathPart::Kind::barrier, "the path waits for all patches to finish a phase");
  add("runtime", PathPart::Kind::start, "the path waits for tasks to begin that are ready");
  std::stable_sort(losses.begin(), losses.end(),
                   [](const Finding& a, const Finding& b) { return a.loss > b.loss; });
  return losses;
}

}  // namespace lahar
