#include "runtime/trace/analyse/replay_work.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "physics/base/error.h"

namespace lahar {

namespace {

double median(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class WorkReader {
 public:
  explicit WorkReader(const TraceLog& log) : log_(log) {}

  ReplayWork read() {
    for (const TraceRun::Loop& loop : log_.run.loops) {
      const auto begin = log_.run.phases.begin();
      const std::vector<TraceRun::PhaseInfo> phases(begin + loop.first, begin + loop.last);
      const auto any = [&](bool TraceRun::PhaseInfo::*has) {
        return std::ranges::any_of(phases, has);
      };
      work_.loops.push_back(
          {phases, any(&TraceRun::PhaseInfo::gives_dt) && any(&TraceRun::PhaseInfo::needs_dt)});
    }
    work_.ranks = log_.run.ranks;
    for (const int threads : log_.run.threads) work_.threads = std::max(work_.threads, threads);
    work_.wall = log_.run.wall;
    make_epochs();
    order_epochs();
    read_tasks();
    read_messages();
    estimate_latency();
    return std::move(work_);
  }

 private:
  /// Null where a damaged trace has none.
  ReplayEpoch* epoch_of(int loop, Step turn) {
    const auto& list = of_loop_[static_cast<std::size_t>(loop)];
    const auto after = list.upper_bound(turn);
    if (after == list.begin()) return nullptr;
    ReplayEpoch& epoch = work_.epochs[std::prev(after)->second];
    return turn < epoch.first + epoch.steps ? &epoch : nullptr;
  }
  ReplayEpoch* epoch_of(const auto& task_or_message) {
    return epoch_of(log_.run.loop_of(task_or_message.phase), task_or_message.turn());
  }
  /// Its phase in its loop.
  int phase_of(const auto& task_or_message) const {
    const int loop = log_.run.loop_of(task_or_message.phase);
    return task_or_message.phase - log_.run.loops[static_cast<std::size_t>(loop)].first;
  }
  std::size_t phases_of(const ReplayEpoch& epoch) const {
    return work_.loop_of(epoch).phases.size();
  }
  std::size_t place(const ReplayEpoch& epoch, Step turn, int phase, int patch) const {
    return (static_cast<std::size_t>(turn - epoch.first) * phases_of(epoch) +
            static_cast<std::size_t>(phase)) *
               epoch.rank.size() +
           static_cast<std::size_t>(patch);
  }
  int index_of(const ReplayEpoch& epoch, int number) const {
    const auto& index = index_[static_cast<std::size_t>(&epoch - work_.epochs.data())];
    const auto found = index.find(number);
    return found == index.end() ? -1 : found->second;
  }

  void make_epochs() {
    if (log_.run.has_solves()) return make_epochs_of_solves();
    for (std::size_t g = 0; g < log_.graphs.size(); ++g) {
      const TraceGraph& graph = log_.graphs[g];
      const Step end = g + 1 < log_.graphs.size() ? log_.graphs[g + 1].first : log_.run.last + 1;
      const Step first = std::max(graph.first, log_.run.first);
      const Step last = std::min(end - 1, log_.run.last);
      if (first <= last) make_epoch(0, first, last, graph);
    }
  }

  /// Where steps begin with a solve: whatever begins from rest, in the order of time.
  void make_epochs_of_solves() {
    std::vector<std::map<Step, Step>> last(log_.run.loops.size());  // turn by first turn
    std::vector<const TraceTask*> begins;
    for (const TraceTask& task : log_.tasks)
      if (task.from_rest && last[static_cast<std::size_t>(log_.run.loop_of(task.phase))]
                                .try_emplace(task.turn(), task.turn())
                                .second)
        begins.push_back(&task);
    for (const TraceTask& task : log_.tasks) {
      auto& list = last[static_cast<std::size_t>(log_.run.loop_of(task.phase))];
      const auto after = list.upper_bound(task.turn());
      if (task.kind == TraceKind::task && after != list.begin())
        std::prev(after)->second = std::max(std::prev(after)->second, task.turn());
    }
    for (const TraceTask* first : begins) {
      const int loop = log_.run.loop_of(first->phase);
      make_epoch(loop, first->turn(), last[static_cast<std::size_t>(loop)].at(first->turn()),
                 log_.graph_at(first->step));
    }
  }

  void make_epoch(int loop, Step first, Step last, const TraceGraph& graph) {
    ReplayEpoch& epoch = work_.epochs.emplace_back();
    epoch.loop = loop;
    epoch.graph = static_cast<std::size_t>(&graph - log_.graphs.data());
    epoch.first = first;
    epoch.steps = static_cast<int>(last - first + 1);
    auto& index = index_.emplace_back();
    for (const auto& [number, patch] : graph.patches)
      index.emplace(number, static_cast<int>(index.size()));
    for (const auto& [number, patch] : graph.patches) {
      epoch.rank.push_back(patch.rank);
      epoch.cells.push_back(patch.cells);
      auto& list = epoch.neighbours.emplace_back();
      for (const int q : patch.neighbours)
        if (const auto found = index.find(q); found != index.end()) list.push_back(found->second);
    }
    const auto steps = static_cast<std::size_t>(epoch.steps);
    epoch.duration.assign(steps * phases_of(epoch) * epoch.rank.size(), -1);
    epoch.gap.assign(epoch.duration.size(), -1);
    epoch.completion.assign(steps, 0);
    epoch.dt.assign(steps, 0);
  }

  void order_epochs() {
    of_loop_.resize(work_.loops.size());
    std::size_t most = 0;
    for (std::size_t e = 0; e < work_.epochs.size(); ++e) {
      const ReplayEpoch& epoch = work_.epochs[e];
      of_loop_[static_cast<std::size_t>(epoch.loop)].emplace(epoch.first, e);
      for (const auto& list : epoch.neighbours) most = std::max(most, list.size());
    }
    // In a plane, chunks of a Hilbert curve seldom touch more than eight others.
    constexpr std::size_t most_in_a_plane = 10;
    work_.dimensions = most > most_in_a_plane ? 3 : 2;
  }

  /// When each thread was last busy with a task, a message or the end of a step.
  double& busy_until(int rank, int thread) {
    return busy_.try_emplace(thread_key(rank, thread), none).first->second;
  }
  static std::uint64_t thread_key(int rank, int thread) {
    return static_cast<std::uint64_t>(rank) << 16 | static_cast<std::uint64_t>(thread);
  }

  void read_tasks() {
    find_completions();
    std::vector<double> gaps;
    std::vector<double> ends(work_.epochs.size(), none), begins(work_.epochs.size(), -none);
    double unpack = 0;
    std::int64_t unpacks = 0;
    for (const TraceTask& task : log_.tasks) {
      if (task.step < log_.run.first || task.step > log_.run.last) continue;
      ReplayEpoch* const of = epoch_of(task);
      if (!of) continue;
      ReplayEpoch& epoch = *of;
      const auto duration = static_cast<float>(std::max(0.0, task.end - task.begin));
      double& busy = busy_until(task.rank, task.thread);
      pass_completions(task, busy);
      const double gap = gap_before(task, busy);
      const double before = std::max(busy, task.ready);
      if (before > none && task.ready < task.begin) gaps.push_back(task.begin - before);
      busy = std::max(task.end, task.released);
      const auto e = static_cast<std::size_t>(&epoch - work_.epochs.data());
      begins[e] = std::min(begins[e], task.begin);
      ends[e] = std::max(ends[e], task.end);
      if (task.kind == TraceKind::task) {
        const int patch = index_of(epoch, task.patch);
        if (patch < 0) continue;
        const std::size_t at = place(epoch, task.turn(), phase_of(task), patch);
        epoch.duration[at] = duration;
        epoch.gap[at] = static_cast<float>(gap);
      } else if (task.kind == TraceKind::dt) {
        float& longest = epoch.dt[static_cast<std::size_t>(task.turn() - epoch.first)];
        longest = std::max(longest, duration);
      } else {
        unpack += duration;
        ++unpacks;
      }
    }
    work_.gap = median(gaps);
    if (unpacks > 0) work_.unpack = unpack / static_cast<double>(unpacks);
    for (std::size_t e = 1; e < work_.epochs.size(); ++e)
      work_.epochs[e].pause = std::max(0.0, begins[e] - ends[e - 1]);
    fill_in();
  }

  /// The time before a task in which its worker was neither busy nor without a task, or -1 if it
  /// had none.
  static double gap_before(const TraceTask& task, double busy) {
    return task.ready > busy || busy == none ? -1 : std::max(0.0, task.begin - busy);
  }

  /// What is done when a step is complete keeps a worker busy like a task.
  void find_completions() {
    for (const TraceInterval& i : log_.intervals) {
      if (i.kind != TraceKind::completed) continue;
      completions_[thread_key(i.rank, i.thread)].emplace_back(i.begin, i.end);
      // Each rank does it, at about the same time.
      if (ReplayEpoch* const epoch = epoch_of(0, i.step))
        epoch->completion[static_cast<std::size_t>(i.step - epoch->first)] +=
            static_cast<float>((i.end - i.begin) / work_.ranks);
    }
    for (auto& [thread, list] : completions_)  // the first at the end
      std::sort(list.begin(), list.end(), std::greater<>());
  }
  void pass_completions(const TraceTask& next, double& busy) {
    const auto found = completions_.find(thread_key(next.rank, next.thread));
    if (found == completions_.end()) return;
    auto& list = found->second;
    for (; !list.empty() && list.back().first <= next.begin; list.pop_back())
      busy = std::max(busy, list.back().second);
  }

  void fill_in() {
    for (ReplayEpoch& epoch : work_.epochs)
      for (std::size_t i = 0; i < epoch.duration.size(); ++i) {
        if (epoch.gap[i] < 0) epoch.gap[i] = static_cast<float>(work_.gap);
        if (epoch.duration[i] >= 0) continue;
        const std::size_t of_step = epoch.rank.size() * phases_of(epoch);
        throw InputError(
            {Problem{.message = fmt::format(
                         "the trace cannot be replayed: a task of step {} is missing ('{}')",
                         epoch.first + static_cast<Step>(i / of_step),
                         work_.loop_of(epoch).phases[i % of_step / epoch.rank.size()].name),
                     .hint = "record it again: lahar run --trace"}});
      }
  }

  void read_messages() {
    std::vector<double> bytes(log_.run.phases.size()), pairs(bytes), packing(bytes), count(bytes);
    std::unordered_map<int, double> packed_until;  // by sending task
    std::map<std::tuple<int, int, int>, std::int64_t> counts;
    std::vector<const TraceMessage*> sent;
    for (const TraceMessage& m : log_.messages)
      if (m.sender >= 0) sent.push_back(&m);
    std::sort(sent.begin(), sent.end(), [](auto* a, auto* b) { return a->packed < b->packed; });
    work_.has_messages = !sent.empty();
    for (const TraceMessage* m : sent) {
      ReplayEpoch* const of = epoch_of(*m);
      if (!of) continue;
      ReplayEpoch& epoch = *of;
      const int patch = index_of(epoch, m->patch);
      if (patch < 0) continue;
      const auto& list = epoch.neighbours[static_cast<std::size_t>(patch)];
      const auto shared = std::count_if(list.begin(), list.end(), [&](int q) {
        return epoch.rank[static_cast<std::size_t>(q)] == m->to;
      });
      double& until =
          packed_until.try_emplace(m->sender, log_.tasks[static_cast<std::size_t>(m->sender)].end)
              .first->second;
      const double took = std::max(0.0, m->sent - until);
      until = m->sent;
      const auto f = static_cast<std::size_t>(m->phase);
      bytes[f] += static_cast<double>(m->bytes);
      pairs[f] += static_cast<double>(std::max<std::ptrdiff_t>(1, shared));
      packing[f] += took;
      count[f] += 1;
      auto& mean = epoch.messages[{phase_of(*m), patch, m->to}];
      mean.bytes += static_cast<double>(m->bytes) / epoch.steps;
      mean.packing += took / epoch.steps;
    }
    for (std::size_t f = 0; f < bytes.size(); ++f) {
      const int l = log_.run.loop_of(static_cast<int>(f));
      ReplayLoop& loop = work_.loops[static_cast<std::size_t>(l)];
      const std::size_t own = loop.packing.size();  // phase of the loop
      loop.packing.push_back(count[f] > 0 ? packing[f] / count[f] : assumed_packing);
      loop.bytes_of_pair.push_back(pairs[f] > 0 ? bytes[f] / pairs[f] : assumed_bytes(loop, own));
    }
    if (!work_.has_messages) work_.unpack = assumed_packing;
  }

  /// For a trace without messages: half of a patch's border nodes, shared among its neighbours, a
  /// line of 64 bytes each; where particles go, a few of them.
  double assumed_bytes(const ReplayLoop& loop, std::size_t phase) const {
    const auto& next = loop.phases[(phase + 1) % loop.phases.size()];
    constexpr double line = 64, particle = 300;
    if (next.exchange == "particles") return line + 2 * particle;
    double nodes = 0, pairs = 0;
    for (const ReplayEpoch& epoch : work_.epochs)
      for (std::size_t p = 0; p < epoch.rank.size(); ++p) {
        const auto cells = static_cast<double>(epoch.cells[p]);
        nodes += work_.dimensions == 2 ? 4 * std::sqrt(cells) : 6 * std::pow(cells, 2.0 / 3.0);
        pairs += static_cast<double>(epoch.neighbours[p].size());
      }
    return line * (1 + nodes / std::max(1.0, pairs));
  }

  /// Half of a fast message there and a fast one back: what the clocks of two ranks differ by
  /// cancels. The fastest tenth, because the others were there before anybody looked.
  void estimate_latency() {
    std::map<std::pair<int, int>, std::vector<double>> times;
    for (const TraceMessage& m : log_.messages) times[{m.from, m.to}].push_back(m.given - m.posted);
    const auto fast = [](std::vector<double>& list) {
      const auto tenth = list.begin() + static_cast<std::ptrdiff_t>(list.size() / 10);
      std::nth_element(list.begin(), tenth, list.end());
      return *tenth;
    };
    std::vector<double> latencies;
    for (auto& [ranks, there] : times) {
      const auto back = times.find({ranks.second, ranks.first});
      if (ranks.first < ranks.second && back != times.end())
        latencies.push_back(0.5 * (fast(there) + fast(back->second)));
    }
    work_.latency = std::max(0.0, median(latencies));
  }

  static constexpr double none = -std::numeric_limits<double>::max();
  static constexpr double assumed_packing = 1e-6;  // [s], what it takes on machines of today

  const TraceLog& log_;
  ReplayWork work_;
  std::vector<std::map<Step, std::size_t>> of_loop_;  ///< epochs by their first turn
  std::vector<std::unordered_map<int, int>> index_;   ///< by epoch: patches by number
  std::unordered_map<std::uint64_t, double> busy_;
  std::unordered_map<std::uint64_t, std::vector<std::pair<double, double>>> completions_;
};

}  // namespace

double ReplayEpoch::work_of(int patch, int phases) const {
  double sum = 0;
  for (std::size_t row = 0;
       row < static_cast<std::size_t>(steps) * static_cast<std::size_t>(phases); ++row)
    sum += duration[row * rank.size() + static_cast<std::size_t>(patch)];
  return sum;
}

ReplayWork work_of(const TraceLog& log) {
  return WorkReader(log).read();
}

std::vector<int> deal(const std::vector<double>& weights, int ranks) {
  double all = 0;
  for (const double w : weights) all += w;
  const auto n = static_cast<int>(weights.size());
  std::vector<int> dealt(weights.size(), 0);
  double before = 0;
  for (int i = 0; i < n; ++i) {
    const double weight = weights[static_cast<std::size_t>(i)];
    const double middle = before + 0.5 * weight;
    before += weight;
    int rank = all > 0 ? static_cast<int>(middle / all * ranks) : 0;
    rank = std::min(rank, ranks - 1);
    const int previous = i == 0 ? -1 : dealt[static_cast<std::size_t>(i - 1)];
    // No rank is left out, and enough patches are left for those to come.
    if (n >= ranks) rank = std::clamp(rank, std::max(0, ranks - (n - i)), previous + 1);
    dealt[static_cast<std::size_t>(i)] = std::max(rank, previous);
  }
  return dealt;
}

}  // namespace lahar
