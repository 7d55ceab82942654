#include "runtime/trace/analyse/project.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "graph/executor.h"
#include "physics/base/error.h"
#include "runtime/trace/analyse/replay_machine.h"

namespace lahar {

namespace {

/// Steps that are simulated, of which the first max_lead count as the start.
constexpr int simulated_steps = 16;
/// What keeps a projection below some seconds.
constexpr double most_tasks = 2e5;

/// The value below which a standard normal deviate is with probability p; by bisection.
double normal_quantile(double p) {
  double low = -40, high = 40;
  for (int k = 0; k < 100; ++k) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
  }
  return low;
}

/// Expected largest of n standard normal deviates (Blom 1958, alpha = 3/8).
double largest_of(double n) {
  return n > 1 ? normal_quantile((n - 0.375) / (n + 0.25)) : 0;
}

/// Numbers that look random but are the same in every run (splitmix64, Steele et al. 2014).
std::uint64_t scrambled(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Every task of a row that repeats each step gets its median over steps.
void make_steady(std::vector<float>& table, std::size_t of_step) {
  std::vector<float> values;
  for (std::size_t i = 0; i < of_step; ++i) {
    values.clear();
    for (std::size_t at = i; at < table.size(); at += of_step) values.push_back(table[at]);
    const float middle = median(values);
    for (std::size_t at = i; at < table.size(); at += of_step) table[at] = middle;
  }
}

class Projector {
 public:
  Projector(const ReplayWork& work, const ProjectionAsk& ask)
      : work_(work),
        epoch_(*std::max_element(
            work.epochs.begin(), work.epochs.end(),
            [](const ReplayEpoch& a, const ReplayEpoch& b) { return a.steps <= b.steps; })),
        threads_(ask.threads > 0 ? ask.threads : work.threads),
        network_(resolved(ask.network, work)),
        most_(std::max(1.0, ask.cores)) {
    if (!ask.steady) return;
    const std::size_t tasks = epoch_.rank.size() * work_.loops[0].phases.size();
    make_steady(epoch_.duration, tasks);
    make_steady(epoch_.gap, tasks);
    make_steady(epoch_.dt, 1);
    make_steady(epoch_.completion, 1);
  }

  const ReplayEpoch& epoch() const { return epoch_; }
  const Network& network() const { return network_; }
  int threads() const { return threads_; }

  std::vector<ProjectionPoint> weak() const {
    const double cores = work_.ranks * work_.threads;
    std::vector<ProjectionPoint> points;
    for (double copies = 1; copies * cores < most_; copies *= copies < 4 ? 2 : 4)
      if (copies * cores >= threads_) points.push_back(point(copies, copies * cores));
    if (most_ >= threads_) points.push_back(point(std::max(1.0, most_ / cores), most_));
    return points;
  }

  /// With the recorded patches.
  std::vector<ProjectionPoint> strong() const {
    std::vector<ProjectionPoint> points;
    const double most = std::min<double>(most_, epoch_.patches());
    for (double cores = threads_; cores < most; cores *= 2) points.push_back(point(1, cores));
    if (most >= threads_) points.push_back(point(1, most));
    return points;
  }

  /// With one patch per core of the largest machine.
  std::vector<ProjectionPoint> largest() const {
    std::vector<ProjectionPoint> points;
    for (double per_core = 256; per_core >= 1; per_core /= 4) {
      const double cores = most_ / per_core;
      if (cores >= threads_) points.push_back(point(most_ / epoch_.patches(), cores));
    }
    return points;
  }

 private:
  ProjectionPoint point(double copies, double cores) const {
    const double ranks = std::max(1.0, std::floor(cores / threads_));
    const double tasks = static_cast<double>(epoch_.patches()) *
                         static_cast<double>(work_.loops[0].phases.size()) * simulated_steps;
    double part = 1;
    while (2 * part <= copies && 2 * part * tasks <= most_tasks) part *= 2;
    // A rank at least, however many copies it has.
    while (part * ranks < copies && part < copies) part *= 2;
    const auto n = std::max(1, static_cast<int>(std::lround(ranks * std::min(1.0, part / copies))));
    ReplayCase c = tiled(static_cast<int>(part), n);
    c.reduction = network_.reduction(ranks);
    c.barrier.assign(work_.loops[0].phases.size(), c.reduction);
    const double excess = largest_of(ranks) - largest_of(n);
    ReplayResult graph = simulate_graph(c), bulk = simulate_bulk(c);
    if (n < ranks && n > 1) {
      for (std::size_t f = 0; f < c.barrier.size(); ++f) c.barrier[f] += excess * bulk.spread[f];
      bulk = simulate_bulk(c);
      c.reduction += excess * graph.spread[0];
      graph = simulate_graph(c);
    }
    ProjectionPoint p{.cores = std::llround(ranks * threads_),
                      .ranks = std::llround(ranks),
                      .simulated = n,
                      .patches = copies * epoch_.patches() / (ranks * threads_),
                      .graph = step_time(graph),
                      .bulk = step_time(bulk)};
    p.graph_efficiency = useful_of(graph) / p.graph;
    p.bulk_efficiency = useful_of(bulk) / p.bulk;
    return p;
  }

  static double step_time(const ReplayResult& result) {
    constexpr auto start = static_cast<std::size_t>(max_lead) - 1;
    return (result.step_end.back() - result.step_end[start]) /
           static_cast<double>(result.step_end.size() - 1 - start);
  }
  /// [s] per core and step.
  static double useful_of(const ReplayResult& result) {
    return std::accumulate(result.useful.begin(), result.useful.end(), 0.0) /
           static_cast<double>(result.useful.size()) / simulated_steps;
  }

  /// A power of two of copies on some ranks.
  ReplayCase tiled(int copies, int ranks) const {
    std::vector<double> weights;
    for (int p = 0; p < epoch_.patches(); ++p)
      weights.push_back(epoch_.work_of(p, static_cast<int>(work_.loops[0].phases.size())));
    std::vector<double> all;
    for (int k = 0; k < copies; ++k) all.insert(all.end(), weights.begin(), weights.end());
    const bool recorded = copies == 1 && ranks == work_.ranks;
    ReplayCase c = make_case(work_, epoch_, network_, links_of(copies),
                             recorded ? epoch_.rank : deal(all, ranks), ranks, threads_, recorded);
    c.steps = simulated_steps;
    c.source.resize(static_cast<std::size_t>(copies) * simulated_steps);
    // The first steps of a run are slow: memory is touched for the first time.
    const int first = epoch_.steps > 4 * max_lead ? static_cast<int>(max_lead) : 0;
    const auto choice = static_cast<std::uint64_t>(epoch_.steps - first);
    for (std::size_t i = 0; i < c.source.size(); ++i)
      c.source[i] = first + static_cast<int>(scrambled(i) % choice);
    return c;
  }

  /// Neighbours of all patches of copies that form a torus. Bits of a copy's number are those of
  /// its coordinates in turn (Morton order), so that consecutive ones are near each other.
  std::vector<std::vector<int>> links_of(int copies) const {
    const int n = epoch_.patches(), dimensions = work_.dimensions;
    std::vector<std::set<int>> links(static_cast<std::size_t>(copies * n));
    for (int k = 0; k < copies; ++k)
      for (int p = 0; p < n; ++p)
        for (const int q : epoch_.neighbours[static_cast<std::size_t>(p)])
          links[static_cast<std::size_t>(k * n + p)].insert(k * n + q);
    const std::vector<int> outer = by_neighbours();
    const int face =
        std::max(1, static_cast<int>(std::lround(std::pow(n, (dimensions - 1.0) / dimensions))));
    for (int k = 0; k < copies; ++k)
      for (int d = 0; d < dimensions; ++d) {
        const int next = following(k, d, copies);
        if (next == k) continue;
        for (int j = 0; j < face; ++j) {
          const int from = k * n + outer[static_cast<std::size_t>((2 * d * face + j) % n)];
          const int to = next * n + outer[static_cast<std::size_t>(((2 * d + 1) * face + j) % n)];
          links[static_cast<std::size_t>(from)].insert(to);
          links[static_cast<std::size_t>(to)].insert(from);
        }
      }
    std::vector<std::vector<int>> lists;
    for (const auto& set : links) lists.emplace_back(set.begin(), set.end());
    return lists;
  }

  /// Patches, those with the fewest neighbours first: they are at the border of the mesh.
  std::vector<int> by_neighbours() const {
    std::vector<int> order(epoch_.rank.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return epoch_.neighbours[static_cast<std::size_t>(a)].size() <
             epoch_.neighbours[static_cast<std::size_t>(b)].size();
    });
    return order;
  }

  /// The copy after `k` along an axis, on a torus of 2^m copies.
  int following(int k, int axis, int copies) const {
    int bits = 0;
    while ((1 << bits) < copies) ++bits;
    // Adding one to the coordinate is a carry through its bits.
    for (int b = axis; b < bits; b += work_.dimensions) {
      k ^= 1 << b;
      if (k >> b & 1) return k;
    }
    return k;
  }

  const ReplayWork& work_;
  ReplayEpoch epoch_;
  int threads_;
  Network network_;
  double most_;
};

/// How much longer tasks took on average than their median [1].
double disturbance(const ReplayEpoch& epoch, std::size_t of_step) {
  std::vector<float> steady = epoch.duration;
  make_steady(steady, of_step);
  const double all = std::accumulate(epoch.duration.begin(), epoch.duration.end(), 0.0);
  const double medians = std::accumulate(steady.begin(), steady.end(), 0.0);
  return medians > 0 ? all / medians : 1;
}

}  // namespace

ScalingProjection project(const TraceLog& log, const ProjectionAsk& ask) {
  // The number of rounds of a solve depends on the size of the model.
  if (log.run.has_solves())
    throw InputError({Problem{
        .message = "the steps of this run begin with a solve: they cannot be projected, as how "
                   "many rounds a larger model needs is not in a trace",
        .hint = "replay the run as it is on other ranks and threads: --replay NETWORK --ranks N"}});
  const ReplayWork work = work_of(log);
  const Projector projector(work, ask);
  ScalingProjection p{.threads = projector.threads(),
                      .network = projector.network(),
                      .steady = ask.steady,
                      .patches = projector.epoch().patches(),
                      .cores = work.ranks * work.threads};
  p.weak = projector.weak();
  p.strong = projector.strong();
  p.largest = projector.largest();
  if (!work.has_messages)
    p.notes.push_back(
        "the trace has no messages: their sizes are estimated from the cells of "
        "patches, packing and unpacking as 1 us");
  if (!work.has_messages && !(ask.network.latency && ask.network.bandwidth))
    p.notes.push_back("what the network does not say is assumed: " + text_of(Network::assumed()));
  if (projector.epoch().steps < 2 * simulated_steps)
    p.notes.push_back(fmt::format("{} recorded steps are few: what varies is taken from them",
                                  projector.epoch().steps));
  constexpr double disturbed = 1.2;
  const double mean =
      disturbance(projector.epoch(), projector.epoch().rank.size() * work.loops[0].phases.size());
  if (mean > disturbed)
    p.notes.push_back(
        fmt::format("recorded tasks took {:.1f} times their median on average: the "
                    "machine was disturbed, and so is every core here",
                    mean));
  p.notes.push_back(
      "that cores share memory and caches, and messages links, is in it only as far "
      "as it was recorded; copies vary independently of each other");
  p.notes.push_back(
      "not validated: nothing beyond two cores was compared with runs "
      "(tests/verification/results.md)");
  return p;
}

}  // namespace lahar
