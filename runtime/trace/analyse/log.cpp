#include "runtime/trace/analyse/log.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "runtime/trace/analyse/counters.h"
#include "runtime/trace/analyse/log_file.h"
#include "runtime/trace/analyse/log_links.h"

namespace lahar {

namespace {

std::vector<TraceFile> read_files(const std::filesystem::path& run) {
  if (!std::filesystem::exists(trace_file(run, 0)))
    refuse_trace(run.string(), "has no trace",
                 "name the folder of a run that was started with lahar run --trace");
  std::vector<TraceFile> files{read_trace_file(trace_file(run, 0))};
  const auto ranks = files[0].fields().whole("ranks", 1, most_trace_ranks);
  for (std::int64_t r = 1; r < ranks; ++r)
    files.push_back(read_trace_file(trace_file(run, static_cast<int>(r))));
  for (std::int64_t r = 0; r < ranks; ++r) {
    const TraceFile& file = files[static_cast<std::size_t>(r)];
    const auto head = file.fields();
    if (head.text("run") != files[0].fields().text("run") ||
        head.whole("rank", 0, ranks - 1) != r || head.whole("ranks", 1, most_trace_ranks) != ranks)
      refuse_trace(file.name, "is of another run than " + files[0].name,
                   "put the files of one run together again, or record it again");
  }
  return files;
}

std::vector<TraceGraph> graphs_of(const std::vector<TraceFile>& files) {
  std::vector<TraceGraph> graphs;
  for (std::size_t g = 0; g < files[0].graphs.size(); ++g) {
    graphs.push_back(graph_in(files, g));
    if (g > 0 && graphs[g].first < graphs[g - 1].first)
      refuse_trace(files[0].name, "the trace is damaged: its partitions are in another order");
  }
  if (graphs.empty()) refuse_trace(files[0].name, "the trace is damaged: it names no patches");
  return graphs;
}

bool has_phases_of(const TraceRun& run, const TraceRun& other) {
  return std::ranges::equal(run.loops, other.loops, [](const auto& a, const auto& b) {
    return a.first == b.first && a.last == b.last;
  });
}

/// Tables have a place for each task that a sound trace has. A damaged one could ask for any
/// number.
void check_extent(const TraceLog& log, const std::string& name) {
  constexpr double most_places = 64, few = 1 << 20;
  Turns turns(log.run);
  double tasks = 0, steps = 0;
  for (const TraceTask& task : log.tasks) {
    if (task.step < log.graphs.front().first)
      refuse_trace(name, "the trace is damaged: a task is earlier than its patches");
    if (task.kind != TraceKind::task) continue;
    turns.add(task);
    ++tasks;
    if (task.round < 0) ++steps;
  }
  if (steps == 0)
    refuse_trace(name, "its trace has no task: no step of the run was within --trace-steps");
  int patches = 0;
  for (const TraceGraph& graph : log.graphs)
    if (!graph.patches.empty()) patches = std::max(patches, graph.patches.rbegin()->first + 1);
  if (turns.places() * patches > few + most_places * tasks)
    refuse_trace(name,
                 fmt::format("the trace is damaged: it has {} tasks of {} phases and {} patches",
                             tasks, turns.places(), patches));
}

/// Records of one rank, with times in seconds, to the lists that they belong to.
void distribute(const std::vector<TraceFile>& files, int rank, std::uint64_t origin,
                double per_tick, TraceLog& log, MessageEnds& ends) {
  const TraceFile& file = files[static_cast<std::size_t>(rank)];
  const auto phase_of = [&](const TraceRecord& r) {
    return log.run.loops[static_cast<std::size_t>(r.loop)].first +
           (r.kind == TraceKind::dt ? 0 : r.phase);
  };
  const auto posted = [&](const TraceRecord::Message& message) {
    const auto sender = static_cast<std::size_t>(message.peer);
    return sender < files.size() ? files[sender].seconds(message.sent, origin, per_tick) : 0.0;
  };
  const auto at = [&](std::uint64_t tick) { return file.seconds(tick, origin, per_tick); };
  for (const TraceRecord& r : file.records) {
    const double begin = at(r.begin), end = at(r.end);
    switch (r.kind) {
      case TraceKind::task:
      case TraceKind::unpack:
      case TraceKind::dt: {
        TraceTask task{.kind = r.kind,
                       .step = r.step,
                       .round = r.round,
                       .rank = rank,
                       .thread = r.thread,
                       .phase = phase_of(r),
                       .patch = r.patch,
                       .ready = r.ready > 0 ? at(r.ready) : 0,
                       .begin = begin,
                       .end = end,
                       .noted = r.ready > 0};
        if (r.kind == TraceKind::unpack) {
          if (r.detail.missed > 0) task.missed = at(r.detail.missed);
        } else {
          for (std::size_t s = 0; s < trace_stages; ++s)
            task.stage[s] = static_cast<float>(r.detail.stage[s] * per_tick);
        }
        log.tasks.push_back(task);
        break;
      }
      case TraceKind::send:
        ends.sent.push_back({.step = r.step,
                             .round = r.round,
                             .phase = phase_of(r),
                             .patch = r.patch,
                             .from = rank,
                             .to = r.detail.message.peer,
                             .bytes = r.detail.message.bytes,
                             .packed = begin,
                             .sent = end});
        break;
      case TraceKind::arrival:
        ends.came.push_back({.step = r.step,
                             .round = r.round,
                             .phase = phase_of(r),
                             .patch = r.patch,
                             .from = r.detail.message.peer,
                             .to = rank,
                             .bytes = r.detail.message.bytes,
                             .posted = posted(r.detail.message),
                             .arrived = begin,
                             .given = end});
        break;
      case TraceKind::counter:
        log.counters.push_back({.counter = static_cast<TraceCounter>(r.phase),
                                .rank = rank,
                                .time = begin,
                                .value = r.detail.value});
        break;
      default:
        log.intervals.push_back({.kind = r.kind,
                                 .step = r.step,
                                 .round = r.round,
                                 .loop = r.loop,
                                 .rank = rank,
                                 .thread = r.thread,
                                 .which = r.phase,
                                 .begin = begin,
                                 .end = end});
    }
  }
}

}  // namespace

std::filesystem::path trace_file(const std::filesystem::path& run, int rank) {
  return trace_folder(run) / fmt::format("rank-{}.trace", rank);
}

const TraceGraph& TraceLog::graph_at(Step step) const {
  const auto after = std::upper_bound(graphs.begin(), graphs.end(), step,
                                      [](Step s, const TraceGraph& g) { return s < g.first; });
  return after == graphs.begin() ? graphs.front() : *(after - 1);
}

TraceLog read_trace(const std::filesystem::path& run) {
  std::vector<TraceFile> files = read_files(run);
  TraceLog log{.run = run_in(files[0])};
  log.graphs = graphs_of(files);
  const double per_tick = files[0].per_tick;
  std::uint64_t origin = std::numeric_limits<std::uint64_t>::max();
  MessageEnds ends;
  for (const TraceRecord& record : files[0].records) origin = std::min(origin, record.begin);
  for (std::size_t r = 0; r < files.size(); ++r) {
    if (r > 0 && !has_phases_of(log.run, run_in(files[r])))
      refuse_trace(files[r].name, "has other phases than " + files[0].name);
    log.run.threads.push_back(
        static_cast<int>(files[r].fields().whole("threads", 1, most_trace_threads)));
    log.run.hosts.push_back(files[r].fields().text("host"));
    log.run.clock_bound = std::max(log.run.clock_bound, files[r].bound * per_tick);
    distribute(files, static_cast<int>(r), origin, per_tick, log, ends);
    files[r].records = {};
  }
  check_extent(log, run.string());
  link(log, std::move(ends));
  if (!(log.run.wall > 0))
    refuse_trace(run.string(), "the trace is damaged: its tasks took no time");
  add_load(log);
  return log;
}

}  // namespace lahar
