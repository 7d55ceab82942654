#include "runtime/patches/rank_balance.h"

#include <algorithm>
#include <numeric>
#include <random>

namespace lahar {

namespace {

/// Weights that make patches change their ranks, the same on all ranks.
void scatter(std::vector<Index>& weight, Step step) {
  std::mt19937_64 random(static_cast<std::uint64_t>(step) + 1);
  for (Index& w : weight) w = 1000 + static_cast<Index>(random() % 4000);
}

}  // namespace

template <int Dim>
void RankBalance<Dim>::begin(const PatchSet<Dim>& patches) {
  const auto n = static_cast<std::size_t>(patches.size());
  for (auto& works : of_step_) works.assign(n, {});
  since_.assign(n, {});
  particles_.assign(n, 0);
  ids_.clear();
  for (int p = 0; p < patches.size(); ++p) {
    ids_.push_back(patches[p].topology.patch);
    particles_[static_cast<std::size_t>(p)] = patches[p].count;
  }
}

template <int Dim>
void RankBalance<Dim>::renumber(const PatchRenumbering& ids) {
  std::map<Index, WorkRate> rates;
  for (const auto& [id, rate] : rates_)
    for (Index part = ids.first(id); part < ids.first(id + 1); ++part) rates[part] = rate;
  rates_ = std::move(rates);
  edges_of_.clear();
}

/// One of each `sampled` steps, at random: what happens again and again after a fixed number of
/// steps, such as particles in rows that cross the sides of cells, is neither always seen nor
/// never.
template <int Dim>
bool RankBalance<Dim>::samples(Step step, int patch) const {
  if (!ranks_.several()) return false;
  const auto id = static_cast<std::uint64_t>(ids_[static_cast<std::size_t>(patch)]);
  auto x = id * 0x9e3779b97f4a7c15 + static_cast<std::uint64_t>(step / sampled);
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;  // the mixing of splitmix64 (Steele et al. 2014)
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return static_cast<Step>((x ^ (x >> 31)) % sampled) == step % sampled;
}

template <int Dim>
void RankBalance<Dim>::add(Step step, int patch, std::int64_t nanoseconds, Index particles) {
  Work& work =
      of_step_[static_cast<std::size_t>(step) % of_step_.size()][static_cast<std::size_t>(patch)];
  work.nanoseconds += nanoseconds;
  work.particles = particles;
}

template <int Dim>
void RankBalance<Dim>::finish(Step step) {
  auto& works = of_step_[static_cast<std::size_t>(step) % of_step_.size()];
  for (std::size_t p = 0; p < works.size(); ++p) {
    if (!samples(step, static_cast<int>(p))) continue;
    since_[p].nanoseconds += works[p].nanoseconds;
    ++since_[p].steps;
    particles_[p] = works[p].particles;
    works[p] = {};
  }
  if ((step + 1) % window != 0) return;
  for (std::size_t p = 0; p < since_.size(); ++p) {
    if (since_[p].steps > 0 && particles_[p] > 0)
      rates_[ids_[p]].add(
          1e-9 * static_cast<double>(since_[p].nanoseconds) / static_cast<double>(since_[p].steps),
          particles_[p]);
    since_[p] = {};
  }
}

template <int Dim>
auto RankBalance<Dim>::load() const -> Load {
  std::vector<double> rates;
  for (const Index id : ids_) {
    const auto rate = rates_.find(id);
    rates.push_back(rate == rates_.end() ? 0.0 : rate->second.value());
  }
  const std::vector<Index> work = work_of(particles_, rates);
  return {std::accumulate(work.begin(), work.end(), Index{0}),
          std::accumulate(particles_.begin(), particles_.end(), Index{0})};
}

template <int Dim>
bool RankBalance<Dim>::is_uneven(Load largest, Load all) {
  ++report_.windows;
  const auto take = [&](Imbalance& imbalance, Index most, Index sum) {
    const double now =
        static_cast<double>(most) * ranks_.size() / static_cast<double>(std::max<Index>(1, sum));
    imbalance.mean += (now - imbalance.mean) / static_cast<double>(report_.windows);
    imbalance.worst = std::max(imbalance.worst, now);
    return now;
  };
  take(report_.particles, largest.particles, all.particles);
  return trigger_.is_due(take(report_.work, largest.work, all.work));
}

/// What a rank knows of one of its patches.
template <int Dim>
struct RankBalance<Dim>::Known {
  Index patch, particles, bytes;
  double rate;
};

template <int Dim>
PatchGraph RankBalance<Dim>::graph_of_all(const PatchSet<Dim>& patches, std::vector<Known>& all) {
  std::vector<Known> own;
  for (int p = 0; p < patches.size(); ++p) {
    const Patch<Dim>& patch = patches[p];
    const Index id = patch.topology.patch;
    const auto rate = rates_.find(id);
    const auto bytes = static_cast<Index>(patch.count > 0 ? patch.particles.bytes() : 0);
    own.push_back({id, patch.count, bytes, rate == rates_.end() ? 0.0 : rate->second.value()});
  }
  all = ranks_.gather_all(std::span<const Known>(own));
  std::sort(all.begin(), all.end(),
            [](const Known& a, const Known& b) { return a.patch < b.patch; });
  std::vector<Index> particles;
  std::vector<double> rates;
  for (const Known& known : all) {
    particles.push_back(known.particles);
    rates.push_back(known.rate);
  }
  PatchGraph graph;
  graph.weight = work_of(particles, rates);
  std::vector<Index> ids;
  for (const Known& patch : all) ids.push_back(patch.patch);
  if (ids != edges_of_) {
    edges_ = edges_of_all(patches, ids);
    edges_of_ = std::move(ids);
  }
  graph.edges = edges_;
  return graph;
}

/// `ids` of all patches, ascending.
template <int Dim>
auto RankBalance<Dim>::edges_of_all(const PatchSet<Dim>& patches,
                                    const std::vector<Index>& ids) const -> Edges {
  struct Shared {
    Index patch, other, nodes;
  };
  std::vector<Shared> own;
  for (int p = 0; p < patches.size(); ++p) {
    const auto& topology = patches[p].topology;
    const std::vector<Index> nodes = shared_nodes(topology);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      own.push_back({topology.patch, topology.neighbours[k], nodes[k]});
  }
  const auto place = [&](Index id) {
    return std::lower_bound(ids.begin(), ids.end(), id) - ids.begin();
  };
  Edges all(ids.size());
  for (const Shared& edge : ranks_.gather_all(std::span<const Shared>(own)))
    all[static_cast<std::size_t>(place(edge.patch))].push_back(
        {static_cast<int>(place(edge.other)), edge.nodes});
  for (auto& edges : all)
    std::sort(edges.begin(), edges.end(),
              [](const auto& a, const auto& b) { return a.patch < b.patch; });
  return all;
}

/// Who gets a patch also gets what was measured of it.
template <int Dim>
void RankBalance<Dim>::take_over_rates(const std::vector<Known>& known,
                                       const std::vector<int>& before,
                                       const std::vector<int>& after) {
  for (std::size_t p = 0; p < known.size(); ++p)
    if (after[p] == ranks_.rank() && before[p] != after[p] && known[p].rate > 0)
      rates_.insert_or_assign(known[p].patch, WorkRate(known[p].rate));
}

template <int Dim>
bool RankBalance<Dim>::share(PatchSet<Dim>& patches, Step step) {
  if (!ranks_.several() || options_.partitioner == Partitioner::curve) return false;
  std::vector<Known> known;
  const PatchGraph graph = graph_of_all(patches, known);
  patches.give_to(partition(options_.partitioner, graph, ranks_.size()), step);
  return true;
}

template <int Dim>
bool RankBalance<Dim>::remap(PatchSet<Dim>& patches, Step step, Index steps_left) {
  busiest_.reset();
  std::vector<Known> known;
  PatchGraph graph = graph_of_all(patches, known);
  std::vector<Index> bytes;
  for (const Known& patch : known) bytes.push_back(patch.bytes);
  const bool forced = options_.when == BalanceOptions::When::forced;
  if (forced) scatter(graph.weight, step);
  BalanceTerms terms{.partitioner = options_.partitioner,
                     .steps = static_cast<double>(std::min<Index>(steps_left, 10 * window)),
                     .threads = threads_,
                     .forced = forced,
                     .move = move_};
  if (forced) {
    terms.threshold = 0;
  } else if (trigger_.is_small()) {  // what has lasted so long will last as long again
    terms.threshold = 0.5 * BalanceTrigger::small;
    terms.slack = 0.5 * BalanceTrigger::small;
    terms.steps = std::min(terms.steps, static_cast<double>(trigger_.lasting() * window));
  }
  const auto plan = decide(graph, patches.owners(), bytes, ranks_.size(), terms);
  if (!plan || plan->owner == patches.owners()) {
    trigger_.refused();
    return false;
  }
  Index moved = 0, all = 0;
  for (std::size_t p = 0; p < known.size(); ++p) {
    all += known[p].particles;
    if (plan->owner[p] != patches.owners()[p]) moved += known[p].particles;
  }
  take_over_rates(known, patches.owners(), plan->owner);
  patches.give_to(plan->owner, step);
  const double share = static_cast<double>(moved) / static_cast<double>(std::max<Index>(1, all));
  report_.moved = (report_.moved * static_cast<double>(report_.remaps) + share) /
                  static_cast<double>(report_.remaps + 1);
  report_.most_moved = std::max(report_.most_moved, share);
  ++report_.remaps;
  trigger_.moved();
  busiest_ = plan->busiest;
  return true;
}

template <int Dim>
void RankBalance<Dim>::remap_took(double seconds) {
  seconds = ranks_.max(seconds);
  report_.seconds += seconds;
  if (busiest_) move_.measured(seconds, *busiest_);
}

template class RankBalance<2>;
template class RankBalance<3>;

}  // namespace lahar
