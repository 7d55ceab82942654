#include "runtime/trace/log.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <unordered_map>

#include "io/text.h"
#include "physics/error.h"
#include "runtime/trace/counters.h"
#include "runtime/trace/log_links.h"

namespace lahar {

namespace {

using nlohmann::json;

/// The sections of one rank's file.
struct RankFile {
  std::string name;
  json head = {}, tail = {};
  std::vector<json> graphs = {};
  std::vector<TraceRecord> records = {};

  /// [s] of a tick on rank 0's clock, from `origin` on: a straight line through the two readings.
  double seconds(std::uint64_t tick, std::uint64_t origin, double per_tick) const {
    const auto since = static_cast<double>(static_cast<std::int64_t>(tick - first_tick));
    const double offset = first_offset + since * drift;
    return (static_cast<double>(static_cast<std::int64_t>(tick - origin)) + offset) * per_tick;
  }
  std::uint64_t first_tick = 0;
  double first_offset = 0, drift = 0, bound = 0, per_tick = 0;
};

[[noreturn]] void refuse(const std::string& file, const std::string& what,
                         const std::string& hint) {
  throw InputError({Problem{.file = file, .message = what, .hint = hint}});
}

const char* const run_again = "record it again: lahar run --trace";

json parse(const std::string& file, const std::string& text) {
  json value = json::parse(text, nullptr, false);
  if (value.is_discarded())
    refuse(file, "the trace is damaged: a description is no JSON", run_again);
  return value;
}

void take_section(RankFile& file, TraceSection::Kind kind, const std::string& bytes) {
  switch (kind) {
    case TraceSection::Kind::head:
      file.head = parse(file.name, bytes);
      return;
    case TraceSection::Kind::graph:
      file.graphs.push_back(parse(file.name, bytes));
      return;
    case TraceSection::Kind::tail:
      file.tail = parse(file.name, bytes);
      return;
    case TraceSection::Kind::records: {
      if (bytes.size() % sizeof(TraceRecord) != 0)
        refuse(file.name, "the trace is damaged: its records have another size", run_again);
      const std::size_t before = file.records.size(), n = bytes.size() / sizeof(TraceRecord);
      file.records.resize(before + n);
      std::memcpy(file.records.data() + before, bytes.data(), bytes.size());
      return;
    }
  }
  refuse(file.name, "the trace holds something unknown; it is damaged, or of a newer version",
         run_again);
}

RankFile read_file(const std::filesystem::path& path) {
  RankFile file{.name = path.string()};
  std::ifstream in(path, std::ios::binary);
  if (!in)
    refuse(file.name, "cannot be read",
           "a trace has one file per rank; copy all of them, or record it again");
  std::string magic(trace_magic.size(), ' ');
  in.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (magic != trace_magic)
    refuse(file.name,
           magic.starts_with("Lahar trace ")
               ? "is a trace of another version of Lahar, '" + magic.substr(0, 13) + "'"
               : "is not a trace of Lahar",
           "traces are the files RUN/trace/rank-N.trace");
  const std::string incomplete =
      "the trace is not complete: the run was ended while it was written";
  while (file.tail.is_null()) {
    TraceSection section{};
    if (!in.read(reinterpret_cast<char*>(&section), sizeof section))
      refuse(file.name, incomplete, run_again);
    constexpr std::uint64_t most = std::uint64_t{1} << 32;
    if (section.bytes > most) refuse(file.name, "the trace is damaged", run_again);
    std::string bytes(section.bytes, ' ');
    if (!in.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
      refuse(file.name, incomplete, run_again);
    const auto crc = ::crc32(0, reinterpret_cast<const unsigned char*>(bytes.data()),
                             static_cast<uInt>(bytes.size()));
    if (crc != section.crc)
      refuse(file.name, "the trace is damaged: a checksum is wrong", run_again);
    take_section(file, section.kind, bytes);
  }
  const json& clock = file.tail.at("clock");
  file.first_tick = clock[0].at("tick");
  file.first_offset = clock[0].at("offset");
  const auto last_tick = clock[1].at("tick").get<std::uint64_t>();
  const double ticks = static_cast<double>(last_tick - file.first_tick);
  if (ticks > 0) file.drift = (clock[1].at("offset").get<double>() - file.first_offset) / ticks;
  file.bound = std::max(clock[0].at("bound").get<double>(), clock[1].at("bound").get<double>());
  file.per_tick = file.tail.at("seconds_per_tick");
  return file;
}

/// Text that reports and pages show as it is.
std::string text_in(const json& head, const char* key) {
  return printable(head.at(key).get<std::string>());
}

TraceRun run_of(const json& head) {
  TraceRun run{.id = head.at("run"),
               .version = text_in(head, "version"),
               .title = text_in(head, "title"),
               .scheme = text_in(head, "scheme"),
               .executor = text_in(head, "executor"),
               .ranks = head.at("ranks"),
               .adaptive = head.at("adaptive"),
               .latency = head.at("latency")};
  for (const json& phase : head.at("phases"))
    run.phases.push_back({.name = "",
                          .exchange = phase.at("exchange"),
                          .gives_dt = phase.at("gives_dt"),
                          .needs_dt = phase.at("needs_dt"),
                          .stages = phase.at("stages")});
  for (TraceRun::PhaseInfo& phase : run.phases)
    phase.name = phase.stages.size() < 3 ? fmt::format("{}", fmt::join(phase.stages, ", "))
                                         : phase.stages.front() + " to " + phase.stages.back();
  return run;
}

std::vector<RankFile> read_files(const std::filesystem::path& run) {
  if (!std::filesystem::exists(trace_file(run, 0)))
    refuse(run.string(), "has no trace",
           "name the folder of a run that was started with lahar run --trace");
  std::vector<RankFile> files{read_file(trace_file(run, 0))};
  const int ranks = files[0].head.at("ranks");
  for (int r = 1; r < ranks; ++r) files.push_back(read_file(trace_file(run, r)));
  for (int r = 0; r < ranks; ++r) {
    const RankFile& file = files[static_cast<std::size_t>(r)];
    if (file.head.at("run") != files[0].head.at("run") || file.head.at("rank") != r)
      refuse(file.name, "is of another run than " + files[0].name,
             "put the files of one run together again, or record it again");
  }
  return files;
}

std::vector<TraceGraph> graphs_of(const std::vector<RankFile>& files) {
  std::vector<TraceGraph> graphs;
  for (std::size_t g = 0; g < files[0].graphs.size(); ++g) {
    TraceGraph& graph = graphs.emplace_back();
    graph.first = files[0].graphs[g].at("first");
    for (std::size_t r = 0; r < files.size(); ++r) {
      if (g >= files[r].graphs.size())
        refuse(files[r].name, "has fewer partitions than " + files[0].name, run_again);
      for (const json& p : files[r].graphs[g].at("patches")) {
        const int number = p.at("number");
        graph.patches[number] = {.number = number,
                                 .rank = static_cast<int>(r),
                                 .cells = p.at("cells"),
                                 .particles = p.at("particles"),
                                 .neighbours = p.at("neighbours")};
      }
    }
  }
  return graphs;
}

/// Records of one rank, with times in seconds, to the lists that they belong to.
void distribute(const std::vector<RankFile>& files, int rank, std::uint64_t origin,
                double per_tick, TraceLog& log, MessageEnds& ends) {
  const RankFile& file = files[static_cast<std::size_t>(rank)];
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
                       .rank = rank,
                       .thread = r.thread,
                       .phase = r.phase,
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
                             .phase = r.phase,
                             .patch = r.patch,
                             .from = rank,
                             .to = r.detail.message.peer,
                             .bytes = r.detail.message.bytes,
                             .packed = begin,
                             .sent = end});
        break;
      case TraceKind::arrival:
        ends.came.push_back({.step = r.step,
                             .phase = r.phase,
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
  std::vector<RankFile> files = read_files(run);
  TraceLog log{.run = run_of(files[0].head)};
  log.graphs = graphs_of(files);
  const double per_tick = files[0].per_tick;
  std::uint64_t origin = std::numeric_limits<std::uint64_t>::max();
  MessageEnds ends;
  for (const TraceRecord& record : files[0].records) origin = std::min(origin, record.begin);
  for (std::size_t r = 0; r < files.size(); ++r) {
    log.run.threads.push_back(files[r].head.at("threads"));
    log.run.hosts.push_back(files[r].head.at("host"));
    log.run.clock_bound = std::max(log.run.clock_bound, files[r].bound * per_tick);
    distribute(files, static_cast<int>(r), origin, per_tick, log, ends);
    files[r].records = {};
  }
  if (log.tasks.empty())
    refuse(run.string(), "its trace has no task: no step of the run was within --trace-steps",
           run_again);
  link(log, std::move(ends));
  add_load(log);
  return log;
}

}  // namespace lahar
