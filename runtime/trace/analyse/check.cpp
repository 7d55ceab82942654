/// \file What cannot be in a sound trace.
#include <fmt/format.h>

#include <map>
#include <set>

#include "runtime/trace/analyse/analysis.h"

namespace lahar {

namespace {

/// [s] by which processors of one machine may read their clocks differently.
constexpr double clocks_of_cores = 1e-6;

/// Collects problems, of each kind the first few and the number of all.
class Problems {
 public:
  void add(const std::string& kind, const std::string& text) {
    constexpr int shown = 3;
    if (++count_[kind] <= shown) list_.push_back(kind + ": " + text);
  }
  std::vector<std::string> list() {
    for (const auto& [kind, n] : count_)
      if (n > 3) list_.push_back(fmt::format("{}: {} in all", kind, n));
    return std::move(list_);
  }

 private:
  std::map<std::string, int> count_;
  std::vector<std::string> list_;
};

}  // namespace

std::vector<std::string> problems_of(const TraceLog& log) {
  Problems problems;
  const auto name = [&](const TraceTask& t) {
    return fmt::format("phase {} of patch {}, step {}, rank {}{}", t.phase, t.patch, t.step, t.rank,
                       t.round >= 0 ? fmt::format(", round {}", t.round) : "");
  };
  std::map<std::tuple<Step, int, int>, int> count;  // by turn, phase and patch
  std::map<std::pair<int, Step>, Step> rounds;      // of solvers' loops: the step of each
  for (const TraceTask& task : log.tasks) {
    if (task.end < task.begin) problems.add("negative duration", name(task));
    if (task.ready < task.inputs_done - clocks_of_cores)
      problems.add("ready before what it waited for had ended",
                   fmt::format("{}: {:.3g} us", name(task), 1e6 * (task.inputs_done - task.ready)));
    if (task.ready > task.begin + log.run.clock_bound)
      problems.add("began before what it waited for",
                   fmt::format("{}: {:.3g} us", name(task), 1e6 * (task.ready - task.begin)));
    if (task.kind != TraceKind::task) continue;
    ++count[{task.turn(), task.phase, task.patch}];
    if (task.round >= 0) rounds[{log.run.loop_of(task.phase), task.round}] = task.step;
  }
  const auto check_turn = [&](int loop, Step turn, Step step) {
    const TraceRun::Loop& of = log.run.loops[static_cast<std::size_t>(loop)];
    for (const auto& [number, patch] : log.graph_at(step).patches)
      for (int f = of.first; f < of.last; ++f) {
        const auto found = count.find({turn, f, number});
        const int n = found == count.end() ? 0 : found->second;
        if (n != 1)
          problems.add("task not exactly once",
                       fmt::format("phase {} of patch {}, step {}{}: {} times", f, number, step,
                                   loop > 0 ? fmt::format(", round {}", turn) : "", n));
      }
  };
  for (Step step = log.run.first; step <= log.run.last; ++step) check_turn(0, step, step);
  for (const auto& [round, step] : rounds) check_turn(round.first, round.second, step);
  // Nobody takes what a list sends at its end, for a turn that is not taken.
  const auto is_last_of_loop = [&](const TraceMessage& m) {
    const TraceRun::Loop& loop = log.run.loops[static_cast<std::size_t>(log.run.loop_of(m.phase))];
    return log.run.has_solves() && m.phase + 1 == loop.last;
  };
  std::set<std::tuple<int, Step, int, int>> with_message;
  for (const TraceMessage& m : log.messages) {
    with_message.insert({m.to, m.turn(), m.phase, m.patch});
    if (m.arrived + 2 * log.run.clock_bound < m.packed)
      problems.add("message came before it was sent",
                   fmt::format("phase {} of patch {}, step {}, rank {} to {}", m.phase, m.patch,
                               m.step, m.from, m.to));
    if (m.unpack < 0 && m.step < log.run.last && !is_last_of_loop(m))
      problems.add("message that nobody took",
                   fmt::format("phase {} of patch {}, step {}", m.phase, m.patch, m.step));
  }
  for (const TraceTask& task : log.tasks)
    if (task.kind == TraceKind::unpack &&
        !with_message.contains({task.rank, task.turn(), task.phase, task.patch}))
      problems.add("receive without a send", name(task));
  return problems.list();
}

}  // namespace lahar
