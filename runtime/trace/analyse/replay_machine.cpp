#include "runtime/trace/analyse/replay_machine.h"

#include <algorithm>
#include <numeric>

namespace lahar {

Network resolved(const Network& network, const ReplayWork& work) {
  Network all = network;
  const Network assumed = Network::assumed();
  if (!all.latency) all.latency = work.has_messages ? work.latency : *assumed.latency;
  // A message that was measured has its transfer in the latency, and its overheads in packing.
  if (!all.bandwidth)
    all.bandwidth = work.has_messages ? *Network::ideal().bandwidth : *assumed.bandwidth;
  if (!all.overhead) all.overhead = work.has_messages ? 0.0 : *assumed.overhead;
  return all;
}

namespace {

/// Times of a message of a patch of the epoch, by phase.
void fill(ReplayCase::Link& link, const ReplayWork& work, const ReplayEpoch& epoch,
          const Network& network, int patch, bool recorded) {
  const ReplayLoop& loop = work.loop_of(epoch);
  for (std::size_t f = 0; f < loop.phases.size(); ++f) {
    ReplayEpoch::Message message{
        .bytes = loop.bytes_of_pair[f] * static_cast<double>(link.neighbours.size()),
        .packing = loop.packing[f]};
    if (recorded) {
      const auto found = epoch.messages.find({static_cast<int>(f), patch, link.rank});
      if (found != epoch.messages.end()) message = found->second;
    }
    const double packing = network.packing ? message.packing + *network.overhead : 0;
    link.time.push_back(static_cast<float>(*network.latency + message.bytes / *network.bandwidth));
    link.packing.push_back(static_cast<float>(packing));
    link.bytes.push_back(static_cast<float>(message.bytes));
  }
}

}  // namespace

ReplayCase make_case(const ReplayWork& work, const ReplayEpoch& epoch, const Network& network,
                     const std::vector<std::vector<int>>& neighbours, const std::vector<int>& rank,
                     int ranks, int threads, bool recorded) {
  ReplayCase c{.work = &work,
               .epoch = &epoch,
               .loop = &work.loop_of(epoch),
               .ranks = ranks,
               .threads = threads,
               .steps = epoch.steps,
               .patches = {},
               .source = {},
               .unpacking = network.packing ? work.gap + work.unpack + *network.overhead : 0,
               .reduction = network.reduction(ranks),
               .barrier = {}};
  c.barrier.assign(c.loop->phases.size(), c.reduction);
  c.source.resize(static_cast<std::size_t>(epoch.steps));
  std::iota(c.source.begin(), c.source.end(), 0);
  for (std::size_t p = 0; p < rank.size(); ++p) {
    ReplayCase::Patch& patch = c.patches.emplace_back();
    patch.rank = rank[p];
    for (const int q : neighbours[p]) {
      const int other = rank[static_cast<std::size_t>(q)];
      if (other == patch.rank) {
        patch.neighbours.push_back(q);
        continue;
      }
      auto link = std::find_if(patch.links.begin(), patch.links.end(),
                               [&](const auto& l) { return l.rank == other; });
      if (link == patch.links.end())
        link = patch.links.insert(link, ReplayCase::Link{.rank = other});
      link->neighbours.push_back(q);
    }
    for (auto& link : patch.links)
      fill(link, work, epoch, network, static_cast<int>(p % epoch.rank.size()), recorded);
  }
  return c;
}

}  // namespace lahar
