#include "runtime/trace/analyse/replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "runtime/terminal/console.h"
#include "runtime/trace/analyse/replay_machine.h"

namespace lahar {

namespace {

/// Epochs one after the other: where patches change, all wait for all.
struct Sums {
  double total = 0, pauses = 0, exposed = 0, bytes = 0;
  std::int64_t messages = 0;
  std::vector<double> step_time, useful;
  double before_step = 0;  ///< in loops of the solver

  void add(const ReplayEpoch& epoch, const ReplayResult& result) {
    double before = 0;
    if (epoch.loop > 0) before_step += result.total;
    for (const double end : result.step_end) {
      if (epoch.loop > 0) break;
      step_time.push_back(end - before + std::exchange(before_step, 0.0));
      before = end;
    }
    useful.resize(result.useful.size());
    for (std::size_t w = 0; w < useful.size(); ++w) useful[w] += result.useful[w];
    total += result.total;
    exposed += result.exposed;
    bytes += result.bytes;
    messages += result.messages;
  }
};

/// By graph of the log: the rank of each patch, which keeps it in all epochs.
std::map<std::size_t, std::vector<int>> ranks_of(const ReplayWork& work, int ranks) {
  std::map<std::size_t, std::vector<int>> ranks_of_graph;
  std::map<std::size_t, std::vector<double>> weights;
  for (const ReplayEpoch& epoch : work.epochs) {
    if (ranks == work.ranks) ranks_of_graph[epoch.graph] = epoch.rank;
    auto& of_graph = weights[epoch.graph];
    of_graph.resize(epoch.rank.size());
    for (int p = 0; p < epoch.patches(); ++p)
      of_graph[static_cast<std::size_t>(p)] +=
          epoch.work_of(p, static_cast<int>(work.loop_of(epoch).phases.size()));
  }
  for (const auto& [graph, of_graph] : weights)
    if (ranks != work.ranks) ranks_of_graph[graph] = deal(of_graph, ranks);
  return ranks_of_graph;
}

Sums simulate(const ReplayWork& work, const ReplayMachine& machine, const Network& network) {
  Sums sums;
  const auto ranks = ranks_of(work, machine.ranks);
  for (const ReplayEpoch& epoch : work.epochs) {
    const ReplayCase c = make_case(work, epoch, network, epoch.neighbours, ranks.at(epoch.graph),
                                   machine.ranks, machine.threads, machine.ranks == work.ranks);
    sums.pauses += epoch.pause;
    sums.total += epoch.pause;
    sums.add(epoch, machine.bulk_synchronous ? simulate_bulk(c) : simulate_graph(c));
  }
  return sums;
}

double mean_over_largest(const std::vector<double>& times) {
  const double all = std::accumulate(times.begin(), times.end(), 0.0);
  const double most = *std::max_element(times.begin(), times.end());
  return most > 0 ? all / most / static_cast<double>(times.size()) : 1;
}

std::vector<std::string> notes_of(const ReplayWork& work, const ReplayMachine& machine,
                                  const Network& asked) {
  std::vector<std::string> notes;
  int fewest = work.epochs.front().patches();
  for (const ReplayEpoch& epoch : work.epochs) fewest = std::min(fewest, epoch.patches());
  const int workers = machine.ranks * machine.threads;
  if (workers > fewest)
    notes.push_back(fmt::format("{} workers for {} patches: some have none", workers, fewest));
  if (work.has_solves())
    notes.push_back(
        "what solvers do between their loops takes as long as recorded: decisions, direct solves, "
        "agreements at the ends of loops");
  if (machine.ranks != work.ranks)
    notes.push_back("patches are dealt to ranks in chunks of their order, by their measured work");
  if (machine.ranks > 1 && !work.has_messages)
    notes.push_back(
        "the trace has no messages: their sizes are estimated from the cells of "
        "patches, packing and unpacking as 1 us");
  else if (machine.ranks > 1 && machine.ranks != work.ranks)
    notes.push_back("messages have the mean size per pair of neighbours of those recorded");
  if (machine.ranks > 1 && !work.has_messages && !(asked.latency && asked.bandwidth))
    notes.push_back("what the network does not say is assumed: " + text_of(Network::assumed()));
  if (machine.ranks * machine.threads > work.ranks * work.threads)
    notes.push_back(
        "tasks take as long as recorded: that more cores share memory and caches is "
        "not in a replay");
  return notes;
}

}  // namespace

Replay replay(const TraceLog& log, const ReplayMachine& asked) {
  const ReplayWork work = work_of(log);
  Replay r{.machine = asked,
           .recorded_ranks = work.ranks,
           .recorded_threads = work.threads,
           .recorded = work.wall};
  if (r.machine.ranks <= 0) r.machine.ranks = work.ranks;
  if (r.machine.threads <= 0) r.machine.threads = work.threads;
  r.machine.network = resolved(asked.network, work);
  const Sums sums = simulate(work, r.machine, r.machine.network);
  r.total = sums.total;
  r.pauses = sums.pauses;
  r.step_time = sums.step_time;
  r.exposed = sums.exposed;
  r.messages = sums.messages;
  r.bytes = sums.bytes;
  const auto threads = static_cast<std::size_t>(r.machine.threads);
  r.useful.assign(static_cast<std::size_t>(r.machine.ranks), 0);
  for (std::size_t w = 0; w < sums.useful.size(); ++w) r.useful[w / threads] += sums.useful[w];
  const double all = std::accumulate(r.useful.begin(), r.useful.end(), 0.0);
  const double most = *std::max_element(sums.useful.begin(), sums.useful.end());
  r.ideal_total = r.machine.ranks == 1
                      ? r.total
                      : simulate(work, r.machine, resolved(Network::ideal(), work)).total;
  r.efficiency = all / (r.total * static_cast<double>(sums.useful.size()));
  r.load_balance = mean_over_largest(sums.useful);
  r.by_ranks = mean_over_largest(r.useful);
  r.communication = r.efficiency / r.load_balance;
  r.serialisation = most / r.ideal_total;
  r.transfer = r.ideal_total / r.total;
  r.notes = notes_of(work, r.machine, asked.network);
  return r;
}

std::string text_of(const Replay& r) {
  const auto machine = [](int ranks, int threads) {
    return fmt::format("{} rank{} x {} thread{}", ranks, ranks == 1 ? "" : "s", threads,
                       threads == 1 ? "" : "s");
  };
  const auto line = [](const char* name, const std::string& value) {
    return fmt::format("{:<16}{}\n", name, value);
  };
  std::string text = fmt::format("Replay of {} steps on {}\n", r.step_time.size(),
                                 machine(r.machine.ranks, r.machine.threads));
  if (r.machine.bulk_synchronous) text += line("steps", "a barrier after each phase");
  if (r.machine.ranks > 1) text += line("network", text_of(r.machine.network));
  text +=
      line("time",
           fmt::format("{}, {} per step; recorded were {} on {}: {:.2f} times as fast",
                       short_time(r.total), short_time(r.time_per_step()), short_time(r.recorded),
                       machine(r.recorded_ranks, r.recorded_threads), r.recorded / r.total));
  text += line("efficiency",
               fmt::format("{:.1f} % = load balance {:.1f} % x communication {:.1f} %",
                           100 * r.efficiency, 100 * r.load_balance, 100 * r.communication));
  if (r.machine.ranks > 1) {
    text += line("communication",
                 fmt::format("{:.1f} % = serialisation {:.1f} % x transfer {:.1f} %",
                             100 * r.communication, 100 * r.serialisation, 100 * r.transfer));
    text += line("messages", fmt::format("{}, {}; workers idle for them {}",
                                         format_count(static_cast<Index>(r.messages)),
                                         format_bytes(r.bytes), short_time(r.exposed)));
  }
  for (const std::string& note : r.notes) text += line("note", note);
  return text;
}

std::string json_of(const Replay& r) {
  const Network& network = r.machine.network;
  // JSON has no infinity: a bandwidth without limit is null.
  const nlohmann::json bandwidth =
      std::isinf(*network.bandwidth) ? nlohmann::json() : nlohmann::json(*network.bandwidth);
  return nlohmann::json{
      {"ranks", r.machine.ranks},
      {"threads", r.machine.threads},
      {"bulk_synchronous", r.machine.bulk_synchronous},
      {"network",
       {{"latency", *network.latency},
        {"bandwidth", bandwidth},
        {"overhead", *network.overhead},
        {"ideal", !network.packing}}},
      {"recorded",
       {{"ranks", r.recorded_ranks}, {"threads", r.recorded_threads}, {"time", r.recorded}}},
      {"time", r.total},
      {"time_per_step", r.time_per_step()},
      {"pauses", r.pauses},
      {"step_time", r.step_time},
      {"useful", r.useful},
      {"efficiency", r.efficiency},
      {"load_balance", r.load_balance},
      {"load_balance_of_ranks", r.by_ranks},
      {"communication", r.communication},
      {"serialisation", r.serialisation},
      {"transfer", r.transfer},
      {"ideal_time", r.ideal_total},
      {"exposed", r.exposed},
      {"messages", r.messages},
      {"bytes", r.bytes},
      {"notes", r.notes}}
      .dump(2);
}

}  // namespace lahar
