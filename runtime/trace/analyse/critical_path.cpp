#include "runtime/trace/analyse/critical_path.h"

#include <algorithm>
#include <array>
#include <map>

#include "graph/executor.h"

namespace lahar {

namespace {

class PathFinder {
 public:
  PathFinder(const TraceLog& log, const Workers& workers)
      : log_(log),
        workers_(workers),
        origin_(log.tasks.front().begin),
        waiting_(log.run.executor == bulk_executor_name ? PathPart::Kind::barrier
                                                        : PathPart::Kind::start) {}

  CriticalPath find() {
    find_path();
    find_longest_chain();
    return std::move(path_);
  }

 private:
  /// Backwards from the last task: what it waited for last, or, where it was ready and waited for
  /// its worker, what that did before.
  void find_path() {
    find_latest();
    find_serial();
    const std::vector<int> before = task_before_on_worker();
    std::vector<PathPart> parts;
    const auto add = [&](PathPart::Kind kind, double begin, double end, int task) {
      if (end > begin) parts.push_back({kind, begin, end, task});
    };
    int t = last_task();
    // In a damaged trace tasks may wait for each other.
    std::vector<bool> passed(log_.tasks.size(), false);
    while (t >= 0 && !passed[static_cast<std::size_t>(t)]) {
      passed[static_cast<std::size_t>(t)] = true;
      const TraceTask& task = log_.tasks[static_cast<std::size_t>(t)];
      add(PathPart::Kind::task, task.begin, task.end, t);
      const int on_worker = before[static_cast<std::size_t>(t)];
      const TraceTask* other =
          on_worker >= 0 ? &log_.tasks[static_cast<std::size_t>(on_worker)] : nullptr;
      const double free = other ? other->released : origin_;
      if (free > task.ready || !task.known_inputs) {
        const double serial = serial_between(task, free, task.begin);
        add(waiting_, free + serial, task.begin, t);
        add(PathPart::Kind::step, free, free + serial, t);
        if (other) add(PathPart::Kind::posting, other->end, free, on_worker);
        t = on_worker;
        continue;
      }
      const double serial = serial_between(task, task.ready, task.begin);
      add(waiting_, task.ready + serial, task.begin, t);
      add(PathPart::Kind::step, task.ready, task.ready + serial, t);
      t = follow_input(task, t, add);
    }
    std::reverse(parts.begin(), parts.end());
    CriticalPath& path = path_;
    path.by_kind.assign(path_kinds, 0.0);
    for (const PathPart& part : parts)
      path.by_kind[static_cast<std::size_t>(part.kind)] += part.end - part.begin;
    path.parts = std::move(parts);
  }

  /// [s] of some time in which a task's worker did what is done when a step is finished.
  double serial_between(const TraceTask& task, double begin, double end) const {
    const auto of_worker = serial_.find({task.rank, task.thread});
    if (of_worker == serial_.end()) return 0;
    const auto& list = of_worker->second;  // ascending, apart
    auto i = std::partition_point(list.begin(), list.end(),
                                  [&](const auto& interval) { return interval.second <= begin; });
    double sum = 0;
    for (; i != list.end() && i->first < end; ++i)
      sum += std::min(end, i->second) - std::max(begin, i->first);
    return sum;
  }
  void find_serial() {
    for (const TraceInterval& i : log_.intervals)
      if (i.kind == TraceKind::completed) serial_[{i.rank, i.thread}].push_back({i.begin, i.end});
    for (auto& [worker, list] : serial_) std::sort(list.begin(), list.end());
    for (const TraceInterval& i : log_.intervals)
      if (i.kind == TraceKind::direct) direct_.push_back({i.begin, i.end});
  }

  /// What lies between the end of what a task waited for last and its being ready.
  template <class Add>
  int follow_input(const TraceTask& task, int t, Add add) const {
    if (task.last_message >= 0) {
      const TraceMessage& m = log_.messages[static_cast<std::size_t>(task.last_message)];
      const double done =
          m.sender >= 0 ? log_.tasks[static_cast<std::size_t>(m.sender)].end : m.packed;
      add(waiting_, m.given, task.ready, t);
      add(PathPart::Kind::unseen, m.there, m.given, t);
      add(PathPart::Kind::transit, m.posted, m.there, t);
      add(PathPart::Kind::posting, done, m.posted, m.sender >= 0 ? m.sender : t);
      return m.sender;
    }
    if (task.last_input >= 0) {
      // Its body ends with posting messages and, where it ends a step, with what is done then.
      const TraceTask& input = log_.tasks[static_cast<std::size_t>(task.last_input)];
      if (task.from_rest) {
        const double direct = direct_between(input.released, task.ready);
        add(PathPart::Kind::between, input.released + direct, task.ready, t);
        add(PathPart::Kind::direct, input.released, input.released + direct, t);
        add(PathPart::Kind::posting, input.end, input.released, task.last_input);
        return task.last_input;
      }
      // Between two sets of patches nothing else is done.
      const double serial = log_.graph_at(task.step).first > input.step
                                ? std::max(0.0, task.ready - input.released)
                                : serial_between(input, input.released, task.ready);
      add(waiting_, input.released + serial, task.ready, t);
      add(PathPart::Kind::step, input.released, input.released + serial, t);
      add(PathPart::Kind::posting, input.end, input.released, task.last_input);
      return task.last_input;
    }
    // A permit, or an agreement on the time step: the last task that it depended on.
    const bool dt = task.kind == TraceKind::dt;
    const auto& latest = dt ? latest_limit_ : latest_end_;
    const auto found =
        latest.find({log_.run.loop_of(task.phase), dt ? task.turn() - 1 : task.turn() - max_lead});
    if (found == latest.end()) return -1;
    const double done = log_.tasks[static_cast<std::size_t>(found->second)].end;
    if (done > task.ready) return -1;  // clocks of two ranks
    const auto agreement = task.round >= 0 ? PathPart::Kind::sums : PathPart::Kind::time_step;
    add(dt ? agreement : PathPart::Kind::step, done, task.ready, t);
    return found->second;
  }

  /// [s] of some time in which ranks solved a system directly, all at about the same time.
  double direct_between(double begin, double end) const {
    double longest = 0;
    for (const auto& [from, to] : direct_)
      longest = std::max(longest, std::min(end, to) - std::max(begin, from));
    return longest;
  }

  /// By step: the task that ends last of all, and of those that give the time step.
  void find_latest() {
    const auto later = [&](std::map<Turn, int>& map, int t) {
      const TraceTask& task = log_.tasks[static_cast<std::size_t>(t)];
      const auto [at, is_new] = map.emplace(Turn(log_.run.loop_of(task.phase), task.turn()), t);
      if (!is_new && log_.tasks[static_cast<std::size_t>(t)].end >
                         log_.tasks[static_cast<std::size_t>(at->second)].end)
        at->second = t;
    };
    for (std::size_t t = 0; t < log_.tasks.size(); ++t) {
      const TraceTask& task = log_.tasks[t];
      if (task.kind != TraceKind::task) continue;
      if (task.phase + 1 == log_.run.loops.front().last) later(latest_end_, static_cast<int>(t));
      if (log_.run.phases[static_cast<std::size_t>(task.phase)].gives_dt)
        later(latest_limit_, static_cast<int>(t));
    }
  }

  int last_task() const {
    int last = 0;
    for (std::size_t t = 0; t < log_.tasks.size(); ++t)
      if (log_.tasks[t].end > log_.tasks[static_cast<std::size_t>(last)].end)
        last = static_cast<int>(t);
    return last;
  }

  std::vector<int> task_before_on_worker() const {
    std::vector<int> before(log_.tasks.size(), -1), latest(workers_.list.size(), -1);
    for (std::size_t t = 0; t < log_.tasks.size(); ++t) {
      int& at = latest[workers_.place(log_.tasks[t].rank, log_.tasks[t].thread)];
      before[t] = at;
      at = static_cast<int>(t);
    }
    return before;
  }

  /// Tasks lie in the order of their beginning, so that inputs come before what waits for them.
  void find_longest_chain() {
    CriticalPath& path = path_;
    std::vector<double> chain(log_.tasks.size());
    for (std::size_t t = 0; t < chain.size(); ++t) {
      const TraceTask& task = log_.tasks[t];
      double longest = 0;
      for (int k = log_.first_input[t]; k < log_.first_input[t + 1]; ++k)
        longest = std::max(
            longest, chain[static_cast<std::size_t>(log_.inputs[static_cast<std::size_t>(k)])]);
      chain[t] = longest + (task.end - task.begin);
      path.longest_chain = std::max(path.longest_chain, chain[t]);
      if (task.kind == TraceKind::task) path.work += (task.end - task.begin);
    }
    if (path.longest_chain > 0) path.speedup_left = log_.run.wall / path.longest_chain;
  }

  const TraceLog& log_;
  const Workers& workers_;
  double origin_;
  PathPart::Kind waiting_;  ///< what it is when a task does not begin that could
  CriticalPath path_;
  using Turn = std::pair<int, Step>;  ///< of a loop
  std::map<Turn, int> latest_end_, latest_limit_;
  std::vector<std::pair<double, double>> direct_;                                 ///< solves
  std::map<std::pair<int, int>, std::vector<std::pair<double, double>>> serial_;  ///< by worker
};

}  // namespace

std::string_view name_of(PathPart::Kind kind) {
  constexpr std::array<std::string_view, path_kinds> names{"tasks",
                                                           "posting of messages",
                                                           "messages on their way",
                                                           "messages not looked for",
                                                           "end of steps",
                                                           "agreement on the time step",
                                                           "reductions of solvers",
                                                           "direct solves",
                                                           "between graphs",
                                                           "start of ready tasks",
                                                           "barriers"};
  return names[static_cast<std::size_t>(kind)];
}

CriticalPath critical_path(const TraceLog& log, const Workers& workers) {
  return PathFinder(log, workers).find();
}

}  // namespace lahar
