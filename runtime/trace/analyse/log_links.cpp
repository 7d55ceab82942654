#include "runtime/trace/analyse/log_links.h"

#include <algorithm>
#include <limits>
#include <tuple>
#include <unordered_map>

#include "graph/executor.h"

namespace lahar {

namespace {

using Key = std::uint64_t;

/// Tasks by what they are. Own tasks lie densely in steps, phases and patches.
class TaskIndex {
 public:
  explicit TaskIndex(const TraceLog& log) : phases_(log.run.phases.size()) {
    of_rank_.resize(static_cast<std::size_t>(log.run.ranks));
    for (const TraceGraph& graph : log.graphs)
      for (const auto& [number, patch] : graph.patches) patches_ = std::max(patches_, number + 1);
    Step last = 0;
    first_ = std::numeric_limits<Step>::max();
    for (const TraceTask& task : log.tasks) {
      if (task.kind != TraceKind::task) continue;
      first_ = std::min(first_, task.step);
      last = std::max(last, task.step);
    }
    steps_ = std::max<Step>(0, last - first_ + 1);
    tasks_.assign(static_cast<std::size_t>(steps_) * phases_ * static_cast<std::size_t>(patches_),
                  -1);
    for (std::size_t i = 0; i < log.tasks.size(); ++i) {
      const TraceTask& task = log.tasks[i];
      if (task.kind != TraceKind::task)
        of_rank_[static_cast<std::size_t>(task.rank)]
                [key(task.kind, task.step, task.phase, task.patch)] = static_cast<int>(i);
      else if (task.patch >= 0 && task.patch < patches_)
        tasks_[place(task.step, task.phase, task.patch)] = static_cast<int>(i);
    }
  }
  int task(Step step, int phase, int patch) const {
    if (step < first_ || step >= first_ + steps_ || patch < 0 || patch >= patches_) return -1;
    return tasks_[place(step, phase, patch)];
  }
  int unpack(int rank, Step step, int phase, int patch) const {
    return find(rank, key(TraceKind::unpack, step, phase, patch));
  }
  int dt(int rank, Step step) const { return find(rank, key(TraceKind::dt, step, 0, -1)); }

 private:
  std::size_t place(Step step, int phase, int patch) const {
    return (static_cast<std::size_t>(step - first_) * phases_ + static_cast<std::size_t>(phase)) *
               static_cast<std::size_t>(patches_) +
           static_cast<std::size_t>(patch);
  }
  static Key key(TraceKind kind, Step step, int phase, int patch) {
    return static_cast<Key>(step) << 32 | static_cast<Key>(kind == TraceKind::dt) << 31 |
           static_cast<Key>(phase) << 24 | static_cast<Key>(patch + 1);
  }
  int find(int rank, Key key) const {
    const auto& map = of_rank_[static_cast<std::size_t>(rank)];
    const auto found = map.find(key);
    return found == map.end() ? -1 : found->second;
  }

  std::size_t phases_;
  int patches_ = 0;
  Step first_ = 0, steps_ = 0;
  std::vector<int> tasks_;
  std::vector<std::unordered_map<Key, int>> of_rank_;  ///< unpack and dt tasks
};

/// The last two of what a task waits for.
class Inputs {
 public:
  explicit Inputs(std::vector<int>& all) : all_(all) {}
  void add(double time, int task, int message = -1) {
    if (task >= 0) all_.push_back(task);
    if (time > last_) {
      second_ = last_;
      last_ = time;
      task_ = task;
      message_ = message;
    } else {
      second_ = std::max(second_, time);
    }
  }
  void give(TraceTask& task) const {
    // What the first recorded step waited for is not known, nor what came before anything.
    task.known_inputs = last_ > none;
    if (!task.noted) task.ready = task.known_inputs ? last_ : task.begin;
    task.inputs_done = task.known_inputs ? last_ : task.ready;
    task.without_last = second_ > none ? second_ : task.ready;
    task.last_input = task_;
    task.last_message = message_;
  }

 private:
  static constexpr double none = -std::numeric_limits<double>::max();
  std::vector<int>& all_;
  double last_ = none, second_ = none;
  int task_ = -1, message_ = -1;
};

class Linker {
 public:
  explicit Linker(TraceLog& log) : log_(log), index_(log) {}

  void link(MessageEnds ends) {
    join(std::move(ends));
    find_times();
    find_passed_on();
    find_epochs();
    for (std::size_t i = 0; i < log_.tasks.size(); ++i) {
      TraceTask& task = log_.tasks[i];
      log_.first_input.push_back(static_cast<int>(log_.inputs.size()));
      Inputs inputs(log_.inputs);
      switch (task.kind) {
        case TraceKind::task:
          add_inputs(task, inputs);
          break;
        case TraceKind::unpack:
          if (const int m = message_of_unpack_[i]; m >= 0) {
            const TraceMessage& message = log_.messages[static_cast<std::size_t>(m)];
            inputs.add(message.given, message.sender, m);
          }
          break;
        default:
          add_inputs_of_dt(task, inputs);
      }
      inputs.give(task);
      if (const auto begun = epochs_.find(task.step); begun != epochs_.end() && !task.noted)
        task.ready = std::max(task.ready, std::min(begun->second, task.begin));
    }
    log_.first_input.push_back(static_cast<int>(log_.inputs.size()));
  }

 private:
  std::size_t last_phase() const { return log_.run.phases.size() - 1; }
  static Key rank_step(int rank, Step step) {
    return static_cast<Key>(rank) << 40 | static_cast<Key>(step);
  }

  void join(MessageEnds ends) {
    const auto key = [](const TraceMessage& m) {
      return std::tuple(m.step, m.phase, m.patch, m.to);
    };
    const auto before = [&](const TraceMessage& a, const TraceMessage& b) {
      return key(a) < key(b);
    };
    std::sort(ends.sent.begin(), ends.sent.end(), before);
    std::sort(ends.came.begin(), ends.came.end(), before);
    message_of_unpack_.assign(log_.tasks.size(), -1);
    for (TraceTask& task : log_.tasks) task.released = task.end;
    auto came = ends.came.begin();
    for (TraceMessage& m : ends.sent) {
      while (came != ends.came.end() && before(*came, m)) ++came;
      if (came == ends.came.end() || before(m, *came)) continue;  // beyond the recorded steps
      m.arrived = came->arrived;
      m.given = came->given;
      m.posted = std::clamp(came->posted, std::min(m.sent, m.given), m.given);
      m.sender = index_.task(m.step, m.phase, m.patch);
      if (m.sender >= 0) {
        TraceTask& sender = log_.tasks[static_cast<std::size_t>(m.sender)];
        sender.released = std::max(sender.released, m.sent);
      }
      m.unpack = index_.unpack(m.to, m.step, m.phase, m.patch);
      m.there = m.given;
      if (m.unpack >= 0) {
        const double missed = log_.tasks[static_cast<std::size_t>(m.unpack)].missed;
        if (missed != 0) m.there = std::clamp(missed, m.posted, m.given);
        message_of_unpack_[static_cast<std::size_t>(m.unpack)] =
            static_cast<int>(log_.messages.size());
      }
      log_.messages.push_back(m);
    }
  }

  /// When steps were known to be done and time steps agreed.
  void find_times() {
    for (const TraceInterval& i : log_.intervals) {
      if (i.kind == TraceKind::completed) completed_[rank_step(i.rank, i.step)] = i.end;
      if (i.kind == TraceKind::agreement && i.which == static_cast<int>(TraceAgreement::time_step))
        agreed_[rank_step(i.rank, i.step)] = i.end;
    }
  }

  /// When steps begin before which patches were made or moved: with their first task, as all wait.
  void find_epochs() {
    for (const TraceGraph& graph : log_.graphs)
      for (const TraceTask& task : log_.tasks)  // by beginning
        if (task.kind == TraceKind::task && task.step == graph.first && graph.first > 0) {
          epochs_.emplace(task.step, task.begin);
          break;
        }
  }

  /// Successors hear of a task when its messages are posted and, if it ended a step, what is done
  /// then.
  void add_task(int task, Inputs& inputs) const {
    if (task >= 0) inputs.add(passed_on_[static_cast<std::size_t>(task)], task);
  }
  void find_passed_on() {
    passed_on_.reserve(log_.tasks.size());
    for (const TraceTask& task : log_.tasks) passed_on_.push_back(task.released);
    if (log_.run.ranks > 1) return;  // it is not the last task of a step that ends it
    std::unordered_map<int, std::vector<int>> of_thread;
    for (std::size_t t = 0; t < log_.tasks.size(); ++t)
      of_thread[log_.tasks[t].thread].push_back(static_cast<int>(t));
    for (const TraceInterval& i : log_.intervals) {
      if (i.kind != TraceKind::completed) continue;
      const auto& list = of_thread[i.thread];
      const auto next = std::partition_point(list.begin(), list.end(), [&](int t) {
        return log_.tasks[static_cast<std::size_t>(t)].begin < i.begin;
      });
      if (next == list.begin()) continue;
      double& until = passed_on_[static_cast<std::size_t>(*(next - 1))];
      until = std::max(until, i.end);
    }
  }

  void add_inputs(const TraceTask& task, Inputs& inputs) const {
    const auto& phase = log_.run.phases[static_cast<std::size_t>(task.phase)];
    const bool first = task.phase == 0;
    const int before = first ? static_cast<int>(last_phase()) : task.phase - 1;
    const Step step = first ? task.step - 1 : task.step;
    add_task(index_.task(step, before, task.patch), inputs);
    const TraceGraph& graph = log_.graph_at(task.step);
    const auto patch = graph.patches.find(task.patch);
    if (!phase.exchange.empty() && patch != graph.patches.end())
      for (const int q : patch->second.neighbours) {
        const auto other = graph.patches.find(q);
        const bool elsewhere = other != graph.patches.end() && other->second.rank != task.rank;
        add_task(
            elsewhere ? index_.unpack(task.rank, step, before, q) : index_.task(step, before, q),
            inputs);
      }
    if (phase.needs_dt) add_task(index_.dt(task.rank, task.step), inputs);
    if (!first) return;
    const auto permit = completed_.find(rank_step(task.rank, task.step - max_lead));
    if (permit != completed_.end()) inputs.add(permit->second, -1);
  }

  /// On several ranks what all agreed on, else the tasks of the step before that give dt.
  void add_inputs_of_dt(const TraceTask& task, Inputs& inputs) const {
    const auto agreed = agreed_.find(rank_step(task.rank, task.step));
    if (agreed != agreed_.end()) return inputs.add(agreed->second, -1);
    if (log_.run.ranks > 1) return;
    for (std::size_t f = 0; f < log_.run.phases.size(); ++f)
      if (log_.run.phases[f].gives_dt)
        for (const auto& [number, patch] : log_.graph_at(task.step).patches)
          add_task(index_.task(task.step - 1, static_cast<int>(f), number), inputs);
  }

  TraceLog& log_;
  TaskIndex index_;
  std::vector<int> message_of_unpack_;
  std::vector<double> passed_on_;  ///< by task: when its successors heard of it
  std::unordered_map<Step, double> epochs_;
  std::unordered_map<Key, double> completed_, agreed_;
};

}  // namespace

void link(TraceLog& log, MessageEnds ends) {
  // Tasks of empty patches may take no time; what waits for them begins as they do, and comes
  // later.
  std::sort(log.tasks.begin(), log.tasks.end(), [](const TraceTask& a, const TraceTask& b) {
    return std::tuple(a.begin, a.end, a.step, a.phase) <
           std::tuple(b.begin, b.end, b.step, b.phase);
  });
  Linker(log).link(std::move(ends));
  log.run.first = std::numeric_limits<Step>::max();
  log.run.last = 0;
  double end = 0;
  for (const TraceTask& task : log.tasks) {
    end = std::max(end, task.end);
    if (task.kind != TraceKind::task) continue;
    log.run.first = std::min(log.run.first, task.step);
    log.run.last = std::max(log.run.last, task.step);
  }
  log.run.wall = end - log.tasks.front().begin;
}

}  // namespace lahar
