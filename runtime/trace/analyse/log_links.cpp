#include "runtime/trace/analyse/log_links.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>
#include <unordered_map>

#include "graph/executor.h"

namespace lahar {

namespace {

using Key = std::uint64_t;

/// Tasks by what they are. Own tasks lie densely in turns, phases and patches, loop by loop.
class TaskIndex {
 public:
  explicit TaskIndex(const TraceLog& log) : run_(log.run), turns_(log.run) {
    of_rank_.resize(static_cast<std::size_t>(log.run.ranks));
    for (const TraceGraph& graph : log.graphs)
      for (const auto& [number, patch] : graph.patches) patches_ = std::max(patches_, number + 1);
    for (const TraceTask& task : log.tasks)
      if (task.kind == TraceKind::task) turns_.add(task);
    std::size_t rows = 0;
    for (int l = 0; l < static_cast<int>(run_.loops.size()); ++l) {
      first_row_.push_back(rows);
      rows += static_cast<std::size_t>(turns_.count(l) * loop(l).phases());
    }
    tasks_.assign(rows * static_cast<std::size_t>(patches_), -1);
    for (std::size_t i = 0; i < log.tasks.size(); ++i) {
      const TraceTask& task = log.tasks[i];
      if (task.kind != TraceKind::task)
        of_rank_[static_cast<std::size_t>(task.rank)]
                [key(task.kind, task.turn(), task.phase, task.patch)] = static_cast<int>(i);
      else if (task.patch >= 0 && task.patch < patches_)
        tasks_[place(task.turn(), task.phase, task.patch)] = static_cast<int>(i);
    }
  }
  int task(Step turn, int phase, int patch) const {
    const int l = run_.loop_of(phase);
    if (turn < turns_.first(l) || turn >= turns_.first(l) + turns_.count(l)) return -1;
    return patch < 0 || patch >= patches_ ? -1 : tasks_[place(turn, phase, patch)];
  }
  int unpack(int rank, Step turn, int phase, int patch) const {
    return find(rank, key(TraceKind::unpack, turn, phase, patch));
  }
  /// Of the loop that begins with a phase.
  int dt(int rank, Step turn, int first_phase) const {
    return find(rank, key(TraceKind::dt, turn, first_phase, -1));
  }

 private:
  const TraceRun::Loop& loop(int l) const { return run_.loops[static_cast<std::size_t>(l)]; }
  std::size_t place(Step turn, int phase, int patch) const {
    const int l = run_.loop_of(phase);
    const Step row = (turn - turns_.first(l)) * loop(l).phases() + phase - loop(l).first;
    return (first_row_[static_cast<std::size_t>(l)] + static_cast<std::size_t>(row)) *
               static_cast<std::size_t>(patches_) +
           static_cast<std::size_t>(patch);
  }
  static Key key(TraceKind kind, Step turn, int phase, int patch) {
    return static_cast<Key>(turn) << 32 | static_cast<Key>(kind == TraceKind::dt) << 31 |
           static_cast<Key>(phase) << 24 | static_cast<Key>(patch + 1);
  }
  int find(int rank, Key key) const {
    const auto& map = of_rank_[static_cast<std::size_t>(rank)];
    const auto found = map.find(key);
    return found == map.end() ? -1 : found->second;
  }

  const TraceRun& run_;
  Turns turns_;
  int patches_ = 0;
  std::vector<std::size_t> first_row_;  ///< by loop, of tasks_
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
    find_graphs();
    for (std::size_t i = 0; i < log_.tasks.size(); ++i) {
      TraceTask& task = log_.tasks[i];
      log_.first_input.push_back(static_cast<int>(log_.inputs.size()));
      Inputs inputs(log_.inputs);
      switch (task.kind) {
        case TraceKind::task:
          task.from_rest = waits_for_graph(i);
          if (!task.from_rest)
            add_inputs(task, inputs);
          else if (graph_of_[i] > 0)
            add_task(graph_last_[graph_of_[i] - 1], inputs);
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
      if (task.from_rest && !task.noted)
        task.ready = std::max(task.ready, std::min(graph_begin_[graph_of_[i]], task.begin));
    }
    log_.first_input.push_back(static_cast<int>(log_.inputs.size()));
  }

 private:
  const TraceRun::Loop& loop_of(const TraceTask& task) const {
    return log_.run.loops[static_cast<std::size_t>(log_.run.loop_of(task.phase))];
  }
  static Key rank_step(int rank, Step step) {
    return static_cast<Key>(rank) << 40 | static_cast<Key>(step);
  }

  void join(MessageEnds ends) {
    const auto key = [](const TraceMessage& m) {
      return std::tuple(m.turn(), m.phase, m.patch, m.to);
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
      m.sender = index_.task(m.turn(), m.phase, m.patch);
      if (m.sender >= 0) {
        TraceTask& sender = log_.tasks[static_cast<std::size_t>(m.sender)];
        sender.released = std::max(sender.released, m.sent);
      }
      m.unpack = index_.unpack(m.to, m.turn(), m.phase, m.patch);
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
    agreed_.resize(log_.run.loops.size());
    for (const TraceInterval& i : log_.intervals) {
      if (i.kind == TraceKind::completed) completed_[rank_step(i.rank, i.step)] = i.end;
      if (i.kind == TraceKind::agreement && i.which == static_cast<int>(TraceAgreement::time_step))
        agreed_[static_cast<std::size_t>(i.loop)]
               [rank_step(i.rank, i.round >= 0 ? i.round : i.step)] = i.end;
    }
  }

  /// Where steps begin with a solve: the rounds that a loop takes without a stop, and a time step,
  /// are a graph each, which begins when the one before is drained.
  void find_graphs() {
    if (!log_.run.has_solves()) return;
    std::vector<std::vector<Step>> first_rounds(log_.run.loops.size());
    for (const TraceInterval& i : log_.intervals)
      if (i.kind == TraceKind::rounds)
        first_rounds[static_cast<std::size_t>(i.loop)].push_back(i.round);
    for (auto& list : first_rounds) std::sort(list.begin(), list.end());
    std::map<std::pair<int, Step>, std::size_t> graphs;    // by loop and first turn
    for (std::size_t t = 0; t < log_.tasks.size(); ++t) {  // by beginning
      const TraceTask& task = log_.tasks[t];
      const int loop = log_.run.loop_of(task.phase);
      const auto& list = first_rounds[static_cast<std::size_t>(loop)];
      const auto after = std::upper_bound(list.begin(), list.end(), task.turn());
      const Step first = loop == 0 || after == list.begin() ? task.turn() : *(after - 1);
      const std::size_t g = graphs.try_emplace({loop, first}, graphs.size()).first->second;
      if (g == graph_begin_.size()) {
        graph_begin_.push_back(task.begin);
        graph_first_.push_back(first);
        graph_last_.push_back(static_cast<int>(t));
      }
      graph_of_.push_back(g);
      int& last = graph_last_[g];
      if (passed_on_[t] > passed_on_[static_cast<std::size_t>(last)]) last = static_cast<int>(t);
    }
  }
  /// Its graph had been drained before: it waited for the one before as a whole.
  bool waits_for_graph(std::size_t t) const {
    if (!log_.run.has_solves()) return false;
    const TraceTask& task = log_.tasks[t];
    return task.kind == TraceKind::task && task.phase == loop_of(task).first &&
           task.turn() == graph_first_[graph_of_[t]];
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
    const TraceRun::Loop& loop = loop_of(task);
    const bool first = task.phase == loop.first;
    const int before = first ? loop.last - 1 : task.phase - 1;
    const Step turn = first ? task.turn() - 1 : task.turn();
    add_task(index_.task(turn, before, task.patch), inputs);
    const TraceGraph& graph = log_.graph_at(task.step);
    const auto patch = graph.patches.find(task.patch);
    if (!phase.exchange.empty() && patch != graph.patches.end())
      for (const int q : patch->second.neighbours) {
        const auto other = graph.patches.find(q);
        const bool elsewhere = other != graph.patches.end() && other->second.rank != task.rank;
        add_task(
            elsewhere ? index_.unpack(task.rank, turn, before, q) : index_.task(turn, before, q),
            inputs);
      }
    if (phase.needs_dt) add_task(index_.dt(task.rank, task.turn(), loop.first), inputs);
    if (!first || task.round >= 0) return;
    const auto permit = completed_.find(rank_step(task.rank, task.step - max_lead));
    if (permit != completed_.end()) inputs.add(permit->second, -1);
  }

  /// On several ranks what all agreed on, else the tasks of the step before that give dt.
  void add_inputs_of_dt(const TraceTask& task, Inputs& inputs) const {
    const auto& agreed_of_loop = agreed_[static_cast<std::size_t>(log_.run.loop_of(task.phase))];
    const auto agreed = agreed_of_loop.find(rank_step(task.rank, task.turn()));
    if (agreed != agreed_of_loop.end()) return inputs.add(agreed->second, -1);
    if (log_.run.ranks > 1) return;
    const TraceRun::Loop& loop = loop_of(task);
    for (int f = loop.first; f < loop.last; ++f)
      if (log_.run.phases[static_cast<std::size_t>(f)].gives_dt)
        for (const auto& [number, patch] : log_.graph_at(task.step).patches)
          add_task(index_.task(task.turn() - 1, f, number), inputs);
  }

  TraceLog& log_;
  TaskIndex index_;
  std::vector<int> message_of_unpack_;
  std::vector<double> passed_on_;  ///< by task: when its successors heard of it
  std::unordered_map<Step, double> epochs_;
  std::unordered_map<Key, double> completed_;
  std::vector<std::unordered_map<Key, double>> agreed_;  ///< by loop
  // Where steps begin with a solve, in the order in which they begin:
  std::vector<double> graph_begin_;
  std::vector<Step> graph_first_;      ///< turn
  std::vector<int> graph_last_;        ///< task that ends last
  std::vector<std::size_t> graph_of_;  ///< by task
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
