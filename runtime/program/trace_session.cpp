#include "runtime/program/trace_session.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <random>

#include "physics/base/error.h"
#include "runtime/trace/analyse/log.h"

namespace lahar {

namespace {

using nlohmann::json;

/// Round trips with rank 0, of which the shortest counts.
constexpr int round_trips = 100;

std::string random_id() {
  std::random_device random;
  std::string id;
  for (int k = 0; k < 16; ++k) id += "0123456789abcdef"[random() % 16];
  return id;
}

std::string host_name() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

json phase_list(const StageLoop& loop) {
  json list = json::array();
  for (const Phase& phase : loop.phases) {
    json names = json::array();
    for (std::size_t s = phase.first; s < phase.last; ++s) names.push_back(loop.stages[s].name);
    if (names.size() > trace_stages)
      throw std::logic_error("a phase has more stages than a trace's records hold");
    list.push_back({{"name", phase.task.name},
                    {"exchange", phase.task.exchange},
                    {"gives_dt", phase.task.gives_dt},
                    {"needs_dt", phase.task.needs_dt},
                    {"stages", names}});
  }
  return list;
}

json loop_list(const std::vector<StageLoop>& loops) {
  json list = json::array();
  for (const StageLoop& loop : loops)
    list.push_back({{"name", loop.name}, {"phases", phase_list(loop)}});
  return list;
}

}  // namespace

ClockReading read_clock(const Communicator& ranks) {
  ClockReading best{.tick = ticks()};
  if (!ranks.several()) return best;
  // Ranks of a machine count the same ticks. On a busy one round trips would take
  // milliseconds, as the two are seldom awake together.
  const std::vector<int> machines = ranks.machines();
  if (std::ranges::all_of(machines, [&](int m) { return m == machines.front(); })) return best;
  Communicator own = ranks.duplicate();
  const MPI_Comm group = own.communicator();
  for (int r = 1; r < own.size(); ++r) {
    for (int k = 0; k < round_trips; ++k) {
      std::uint64_t theirs = 0;
      if (own.rank() == 0) {
        MPI_Recv(&theirs, 1, MPI_UINT64_T, r, 0, group, MPI_STATUS_IGNORE);
        theirs = ticks();
        MPI_Send(&theirs, 1, MPI_UINT64_T, r, 0, group);
      } else if (own.rank() == r) {
        const std::uint64_t before = ticks();
        MPI_Send(&before, 1, MPI_UINT64_T, 0, 0, group);
        MPI_Recv(&theirs, 1, MPI_UINT64_T, 0, 0, group, MPI_STATUS_IGNORE);
        const std::uint64_t after = ticks();
        const double bound = 0.5 * static_cast<double>(after - before);
        if (k > 0 && bound >= best.bound) continue;
        best.tick = before + (after - before) / 2;
        best.offset = static_cast<double>(static_cast<std::int64_t>(theirs - best.tick));
        best.bound = bound;
      }
    }
    own.wait_for_all();
  }
  own.release();
  const auto own_machine = static_cast<std::size_t>(ranks.rank());
  if (machines[own_machine] == machines.front()) return {.tick = ticks()};
  return best;
}

TraceSession::TraceSession(const std::filesystem::path& run, TraceWindow window,
                           const Communicator& ranks, const TraceAbout& about,
                           const std::vector<StageLoop>& loops, const std::string& graph)
    : ranks_(ranks) {
  seconds_per_tick();  // begins to measure
  std::string id = ranks.rank() == 0 ? random_id() : "";
  ranks.broadcast(id);
  if (ranks.rank() == 0) {
    std::filesystem::remove_all(trace_folder(run));
    std::filesystem::create_directories(trace_folder(run));
  }
  ranks.wait_for_all();
  const json head{{"run", id},
                  {"version", about.version},
                  {"title", about.title},
                  {"scheme", about.scheme},
                  {"executor", about.executor},
                  {"adaptive", about.adaptive},
                  {"rank", ranks.rank()},
                  {"ranks", ranks.size()},
                  {"threads", about.threads},
                  {"host", host_name()},
                  {"latency", about.latency},
                  {"loops", loop_list(loops)}};
  recorder_ = std::make_unique<TraceRecorder>(trace_file(run, ranks.rank()), window, head.dump());
  recorder_->add_graph(graph);
  begin_ = read_clock(ranks);
  TraceRecorder::activate(recorder_.get());
}

TraceSession::~TraceSession() {
  TraceRecorder::activate(nullptr);
}

Index TraceSession::finish() {
  TraceRecorder::activate(nullptr);
  const auto text = [](const ClockReading& reading) {
    return json{{"tick", reading.tick}, {"offset", reading.offset}, {"bound", reading.bound}};
  };
  const ClockReading end = read_clock(ranks_);
  const json tail{{"clock", {text(begin_), text(end)}}, {"seconds_per_tick", seconds_per_tick()}};
  recorder_->finish(tail.dump());
  return ranks_.sum(recorder_->records());
}

}  // namespace lahar
