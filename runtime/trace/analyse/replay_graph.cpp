/// \file Simulation of the step graph. Every task counts what it still waits for, as in the
/// executor, but for several steps at once, so that nothing has to be proved about tokens here.
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <queue>

#include "graph/executor.h"
#include "runtime/trace/analyse/replay_machine.h"

namespace lahar {

namespace {

class GraphSimulator {
 public:
  explicit GraphSimulator(const ReplayCase& c)
      : c_(c),
        phases_(c.phases()),
        patches_(static_cast<int>(c.patches.size())),
        ranks_(static_cast<std::size_t>(c.ranks)) {}

  ReplayResult run() {
    prepare();
    begin();
    while (!events_.empty()) {
      const Event event = events_.top();
      events_.pop();
      now_ = event.time;
      take(event);
      for (const int rank : touched_) start_tasks(rank);
      touched_.clear();
    }
    result_.total = result_.step_end.empty() ? 0 : result_.step_end.back();
    for (double& spread : result_.spread) spread = std::sqrt(spread / std::max(1.0, reductions_));
    for (std::size_t r = 0; r < ranks_.size(); ++r)
      for (const double useful : ranks_[r].useful) result_.useful.push_back(useful);
    return std::move(result_);
  }

 private:
  /// Steps whose counts are kept: those that patches may be in, and a power of two.
  static constexpr int kept = 8;
  static_assert(kept > max_lead + 1);

  struct Task {
    enum class Kind : std::uint8_t { patch, unpack, dt, completion } kind = Kind::patch;
    std::uint8_t phase = 0;
    std::int32_t step = 0, patch = -1;
  };
  struct Event {
    enum class Kind : std::uint8_t { end, message, dt_agreed, step_agreed } kind = Kind::end;
    std::uint16_t worker = 0;
    std::int32_t rank = 0;  ///< agreements: of all
    Task task;
    double time = 0;
    std::uint64_t number = 0;  ///< of equal times, the earlier made comes first
    bool operator<(const Event& other) const {
      return time != other.time ? time > other.time : number > other.number;
    }
  };
  /// By urgency: what others wait for, what only this rank does, and the same of rests, which can
  /// wait until the time step is agreed on.
  enum Queue : std::uint8_t { urgent, ready, urgent_rests, rests, queues };
  struct Rank {
    std::array<std::deque<Task>, queues> tasks;
    std::deque<std::uint16_t> idle;  ///< workers, the longest idle first
    std::vector<Task> came;          ///< messages and agreements that nobody has looked at
    std::vector<double> useful;
    std::array<int, kept> dt_missing{}, step_missing{};
    int patches = 0, givers = 0;
    int under_way = 0;  ///< messages to it
    double since = 0;   ///< exposed time is summed up to here
  };
  struct Reduction {
    int given = 0;
    double sum = 0, squares = 0;
  };

  std::size_t slot(int step) const { return static_cast<std::size_t>(step % kept); }
  std::uint16_t& missing(int step, int phase, int patch) {
    return missing_[(slot(step) * static_cast<std::size_t>(phases_) +
                     static_cast<std::size_t>(phase)) *
                        c_.patches.size() +
                    static_cast<std::size_t>(patch)];
  }
  const TraceRun::PhaseInfo& phase_info(int phase) const {
    return c_.loop->phases[static_cast<std::size_t>(phase)];
  }
  Rank& rank(int r) { return ranks_[static_cast<std::size_t>(r)]; }
  const ReplayCase::Patch& patch(int p) const { return c_.patches[static_cast<std::size_t>(p)]; }

  void prepare() {
    int gives = 0;
    for (int f = 0; f < phases_; ++f) gives += phase_info(f).gives_dt ? 1 : 0;
    patches_of_.resize(ranks_.size());
    for (int p = 0; p < patches_; ++p) {
      patches_of_[static_cast<std::size_t>(patch(p).rank)].push_back(p);
      rank(patch(p).rank).patches += 1;
      boundary_.push_back(!patch(p).links.empty());
    }
    for (Rank& r : ranks_) {
      r.givers = gives * r.patches;
      r.dt_missing.fill(r.givers);
      r.step_missing.fill(r.patches);
      r.useful.assign(static_cast<std::size_t>(c_.threads), 0);
      for (int w = 0; w < c_.threads; ++w) r.idle.push_back(static_cast<std::uint16_t>(w));
      if (r.patches > 0) ++working_;
    }
    for (int f = 0; f < phases_; ++f)
      for (int p = 0; p < patches_; ++p) needs_.push_back(needs(f, p));
    for (int s = 0; s < kept; ++s) missing_.insert(missing_.end(), needs_.begin(), needs_.end());
    result_.step_end.assign(static_cast<std::size_t>(c_.steps), 0);
    result_.spread.assign(1, 0);
  }

  std::uint16_t needs(int phase, int p) const {
    std::size_t n = 1;  // its own phase before
    if (c_.exchanges(phase)) {
      n += patch(p).neighbours.size();
      for (const auto& link : patch(p).links) n += link.neighbours.size();
    }
    if (phase == 0) ++n;  // the permit
    if (c_.loop->has_dt && phase_info(phase).needs_dt) ++n;
    return static_cast<std::uint16_t>(n);
  }

  /// Before the first step everything is there; steps that may be taken at once have permits.
  void begin() {
    for (int p = 0; p < patches_; ++p) {
      push({.phase = 0, .step = 0, .patch = p});
      for (int s = 1; s < std::min<int>(max_lead, c_.steps); ++s) signal(s, 0, p);
    }
    if (c_.loop->has_dt) {
      for (int f = 1; f < phases_; ++f)
        if (phase_info(f).needs_dt)
          for (int p = 0; p < patches_; ++p) signal(0, f, p);
    }
    for (const int r : touched_) start_tasks(r);
    touched_.clear();
  }

  // --- tasks ------------------------------------------------------------------------------------

  void push(const Task& task) {
    const bool boundary = boundary_[static_cast<std::size_t>(task.patch)];
    const Queue queue =
        is_rest(task.phase) ? (boundary ? urgent_rests : rests) : (boundary ? urgent : ready);
    push_at(patch(task.patch).rank, task, queue);
  }
  void push_at(int r, const Task& task, Queue queue) {
    rank(r).tasks[queue].push_back(task);
    touch(r);
  }
  /// What follows the phase that gives the time step, and waits for nothing else.
  bool is_rest(int phase) const {
    return c_.loop->has_dt && phase > 0 && phase_info(phase - 1).gives_dt &&
           !phase_info(phase).needs_dt && !c_.exchanges(phase);
  }
  void touch(int r) {
    if (touched_.empty() || touched_.back() != r) touched_.push_back(r);
  }

  void signal(int step, int phase, int p) {
    if (step >= c_.steps) return;
    std::uint16_t& count = missing(step, phase, p);
    if (--count > 0) return;
    count =
        needs_[static_cast<std::size_t>(phase) * c_.patches.size() + static_cast<std::size_t>(p)];
    push({.phase = static_cast<std::uint8_t>(phase), .step = step, .patch = p});
  }

  void start_tasks(int r) {
    Rank& on = rank(r);
    // A worker without a task looks for messages all the time.
    if (!on.idle.empty() && !on.came.empty()) look(r);
    while (!on.idle.empty()) {
      const auto queue = std::find_if(on.tasks.begin(), on.tasks.end(),
                                      [](const auto& tasks) { return !tasks.empty(); });
      if (queue == on.tasks.end()) break;
      const Task task = queue->front();
      queue->pop_front();
      sum_exposed(on);
      const std::uint16_t worker = on.idle.front();
      on.idle.pop_front();
      add({.kind = Event::Kind::end,
           .worker = worker,
           .rank = r,
           .task = task,
           .time = now_ + time_of(task, on.useful[worker])});
    }
  }
  void add(Event event) {
    event.number = ++made_;
    events_.push(event);
  }

  double time_of(const Task& task, double& useful) const {
    const auto step = static_cast<std::size_t>(task.step);
    switch (task.kind) {
      case Task::Kind::patch: {
        const std::size_t at = c_.place(task.step, task.phase, task.patch);
        useful += c_.epoch->duration[at];
        double time = static_cast<double>(c_.epoch->gap[at]) + c_.epoch->duration[at];
        if (c_.sends(task.phase))
          for (const auto& link : patch(task.patch).links) time += link.packing[task.phase];
        return time;
      }
      case Task::Kind::unpack:
        return c_.unpacking;
      case Task::Kind::dt:
        return c_.work->gap + c_.epoch->dt[step % c_.epoch->dt.size()];
      case Task::Kind::completion:
        return c_.epoch->completion[step % c_.epoch->completion.size()];
    }
    return 0;
  }

  // --- what happens -----------------------------------------------------------------------------

  void take(const Event& event) {
    switch (event.kind) {
      case Event::Kind::end:
        sum_exposed(rank(event.rank));
        finish(event);
        rank(event.rank).idle.push_back(event.worker);
        // At the end of every task there is a look.
        if (!rank(event.rank).came.empty()) look(event.rank);
        touch(event.rank);
        break;
      case Event::Kind::message:
        rank(event.rank).came.push_back(event.task);
        touch(event.rank);
        break;
      case Event::Kind::dt_agreed:
      case Event::Kind::step_agreed:
        for (int r = 0; r < c_.ranks; ++r) {
          if (rank(r).patches == 0) continue;
          rank(r).came.push_back(event.task);
          touch(r);
        }
    }
  }

  void look(int r) {
    Rank& at = rank(r);
    for (const Task& task : at.came) {
      if (task.kind == Task::Kind::unpack) {
        sum_exposed(at);
        --at.under_way;
      }
      at.tasks[urgent].push_back(task);
    }
    at.came.clear();
  }

  void finish(const Event& event) {
    const Task& task = event.task;
    switch (task.kind) {
      case Task::Kind::patch:
        finish_patch(task);
        break;
      case Task::Kind::unpack:
        finish_unpack(event.rank, task);
        break;
      case Task::Kind::dt:
        for (int f = 0; f < phases_; ++f)
          if (phase_info(f).needs_dt)
            for (const int p : patches_of_[static_cast<std::size_t>(event.rank)])
              signal(task.step, f, p);
        break;
      case Task::Kind::completion:
        for (const int p : patches_of_[static_cast<std::size_t>(event.rank)])
          signal(task.step + static_cast<int>(max_lead), 0, p);
    }
  }

  void finish_patch(const Task& task) {
    const int next = c_.following(task.phase);
    const int step = next == 0 ? task.step + 1 : task.step;
    const ReplayCase::Patch& from = patch(task.patch);
    signal(step, next, task.patch);
    if (c_.exchanges(next)) {
      for (const int q : from.neighbours) signal(step, next, q);
      if (step < c_.steps) send(task, from);
    }
    Rank& on = rank(from.rank);
    if (c_.loop->has_dt && phase_info(task.phase).gives_dt && task.step + 1 < c_.steps) {
      int& left = on.dt_missing[slot(task.step + 1)];
      if (--left == 0) {
        left = on.givers;
        give(Task::Kind::dt, task.step + 1, from.rank);
      }
    }
    if (next != 0) return;
    int& left = on.step_missing[slot(task.step)];
    if (--left > 0) return;
    left = on.patches;
    result_.step_end[static_cast<std::size_t>(task.step)] = now_;
    give(Task::Kind::completion, task.step, from.rank);
  }

  void send(const Task& task, const ReplayCase::Patch& from) {
    double posted = now_;  // the last message is posted at the task's end, others before
    for (const auto& link : from.links) posted -= link.packing[task.phase];
    for (const auto& link : from.links) {
      posted += link.packing[task.phase];
      Rank& to = rank(link.rank);
      sum_exposed(to);
      ++to.under_way;
      ++result_.messages;
      result_.bytes += link.bytes[task.phase];
      Task unpack = task;
      unpack.kind = Task::Kind::unpack;
      add({.kind = Event::Kind::message,
           .rank = link.rank,
           .task = unpack,
           .time = std::max(now_, posted + link.time[task.phase])});
    }
  }

  void finish_unpack(int r, const Task& task) {
    const int next = c_.following(task.phase);
    const int step = next == 0 ? task.step + 1 : task.step;
    for (const auto& link : patch(task.patch).links)
      if (link.rank == r)
        for (const int q : link.neighbours) signal(step, next, q);
  }

  /// A rank's part of a reduction; the last one completes it.
  void give(Task::Kind kind, int step, int r) {
    const Task task{.kind = kind, .phase = 0, .step = step, .patch = -1};
    if (c_.ranks == 1) return push_at(r, task, urgent);
    const bool of_dt = kind == Task::Kind::dt;
    Reduction& reduction = (of_dt ? dt_ : completed_)[slot(step)];
    // Relative to something near, for digits.
    if (reduction.given == 0) (of_dt ? dt_begin_ : completed_begin_)[slot(step)] = now_;
    const double since = now_ - (of_dt ? dt_begin_ : completed_begin_)[slot(step)];
    reduction.sum += since;
    reduction.squares += since * since;
    if (++reduction.given < working_) return;
    if (of_dt == c_.loop->has_dt) {
      const double mean = reduction.sum / working_;
      result_.spread[0] += std::max(0.0, reduction.squares / working_ - mean * mean);
      reductions_ += 1;
    }
    reduction = {};
    add({.kind = of_dt ? Event::Kind::dt_agreed : Event::Kind::step_agreed,
         .task = task,
         .time = now_ + c_.reduction});
  }

  /// Whenever idle workers or messages under way of a rank change.
  void sum_exposed(Rank& at) {
    if (at.under_way > 0)
      result_.exposed += (now_ - at.since) * static_cast<double>(at.idle.size());
    at.since = now_;
  }

  const ReplayCase& c_;
  int phases_, patches_;
  std::vector<Rank> ranks_;
  std::vector<std::vector<int>> patches_of_;
  std::vector<char> boundary_;
  std::vector<std::uint16_t> needs_, missing_;
  std::priority_queue<Event> events_;
  std::vector<int> touched_;
  std::array<Reduction, kept> dt_{}, completed_{};
  std::array<double, kept> dt_begin_{}, completed_begin_{};
  int working_ = 0;  ///< ranks with patches
  double reductions_ = 0;
  double now_ = 0;
  std::uint64_t made_ = 0;
  ReplayResult result_;
};

}  // namespace

ReplayResult simulate_graph(const ReplayCase& c) {
  return GraphSimulator(c).run();
}

}  // namespace lahar
