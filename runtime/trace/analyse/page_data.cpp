#include "runtime/trace/analyse/page_data.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "io/base/base64.h"
#include "runtime/trace/analyse/counters.h"

namespace lahar {

namespace {

using nlohmann::json;

/// A table, column by column.
class Table {
 public:
  explicit Table(std::vector<std::string> names)
      : names_(std::move(names)), columns_(names_.size()) {}

  void add(const std::vector<std::int32_t>& row) {
    for (std::size_t c = 0; c < columns_.size(); ++c) columns_[c].push_back(row[c]);
  }
  json finish() const {
    json table{{"count", columns_[0].size()}};
    for (std::size_t c = 0; c < columns_.size(); ++c) table[names_[c]] = packed(columns_[c]);
    return table;
  }

 private:
  std::vector<std::string> names_;
  std::vector<std::vector<std::int32_t>> columns_;
};

/// The part of a log that the timeline shows.
class Timeline {
 public:
  Timeline(const TraceLog& log, std::size_t most_tasks) : log_(log) {
    const std::size_t all = log.tasks.size(), shown = std::min(all, most_tasks);
    first_ = (all - shown) / 2;
    last_ = first_ + shown;
    begin_ = std::numeric_limits<double>::max();
    end_ = std::numeric_limits<double>::lowest();
    for (std::size_t i = first_; i < last_; ++i) {
      begin_ = std::min(begin_, log.tasks[i].begin);
      end_ = std::max(end_, log.tasks[i].end);
    }
    if (shown == all) {
      for (const TraceInterval& i : log.intervals) {
        begin_ = std::min(begin_, i.begin);
        end_ = std::max(end_, i.end);
      }
    }
    // All times of the part fit; a nanosecond where possible.
    unit_ = std::max(1e-9, (end_ - begin_) / std::numeric_limits<std::int32_t>::max());
  }

  json head() const {
    return {{"origin", begin_},
            {"span", end_ - begin_},
            {"unit", unit_},
            {"first_task", first_},
            {"all_tasks", log_.tasks.size()}};
  }
  json tasks() const;
  json messages() const;
  json intervals() const;
  json path(const CriticalPath& path) const;
  json counters() const;

 private:
  std::int32_t ticks(double seconds) const {
    constexpr auto most = static_cast<double>(std::numeric_limits<std::int32_t>::max());
    return static_cast<std::int32_t>(std::lround(std::clamp(seconds / unit_, -most, most)));
  }
  std::int32_t at(double time) const { return ticks(time - begin_); }
  /// Its number on the page, or -1.
  std::int32_t task(int index) const {
    const auto i = static_cast<std::size_t>(index);
    return index >= 0 && first_ <= i && i < last_ ? static_cast<std::int32_t>(i - first_) : -1;
  }
  bool meets(double begin, double end) const { return begin <= end_ && begin_ <= end; }
  bool shows(const TraceMessage& message) const {
    return task(message.sender) >= 0 || task(message.unpack) >= 0;
  }
  std::vector<TraceInterval> merged() const;

  const TraceLog& log_;
  std::size_t first_ = 0, last_ = 0;  ///< tasks
  double begin_ = 0, end_ = 0, unit_ = 1e-9;
};

json Timeline::tasks() const {
  std::size_t stages = 0;
  for (const auto& phase : log_.run.phases) stages = std::max(stages, phase.stages.size());
  stages = std::min(stages, trace_stages);
  std::vector<std::int32_t> message_of(log_.messages.size(), -1);
  std::int32_t shown = 0;
  for (std::size_t m = 0; m < log_.messages.size(); ++m)
    if (shows(log_.messages[m])) message_of[m] = shown++;

  std::vector<std::string> names{"kind",    "step",       "round",       "rank",   "thread",
                                 "phase",   "patch",      "begin",       "length", "lag",
                                 "posting", "last_input", "last_message"};
  for (std::size_t s = 0; s < stages; ++s) names.push_back("stage" + std::to_string(s));
  Table table(std::move(names));
  for (std::size_t i = first_; i < last_; ++i) {
    const TraceTask& t = log_.tasks[i];
    std::vector<std::int32_t> row{
        static_cast<std::int32_t>(t.kind),
        static_cast<std::int32_t>(t.step),
        static_cast<std::int32_t>(t.round),
        t.rank,
        t.thread,
        t.phase,
        t.patch,
        at(t.begin),
        ticks(t.end - t.begin),
        ticks(t.begin - t.ready),
        ticks(std::max(0.0, t.released - t.end)),
        task(t.last_input),
        t.last_message < 0 ? -1 : message_of[static_cast<std::size_t>(t.last_message)]};
    for (std::size_t s = 0; s < stages; ++s)
      row.push_back(t.kind == TraceKind::task ? ticks(t.stage[s]) : 0);
    table.add(row);
  }
  json result = table.finish();
  result["stages"] = stages;
  return result;
}

json Timeline::messages() const {
  Table table({"step", "phase", "patch", "from", "to", "bytes", "packed", "sent", "there", "given",
               "sender", "unpack"});
  constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
  for (const TraceMessage& m : log_.messages)
    if (shows(m))
      table.add({static_cast<std::int32_t>(m.step), m.phase, m.patch, m.from, m.to,
                 static_cast<std::int32_t>(std::min(m.bytes, most)), at(m.packed), at(m.sent),
                 at(m.there), at(m.given), task(m.sender), task(m.unpack)});
  return table.finish();
}

/// Polls that follow each other closely are shown as one: there may be many more than tasks.
std::vector<TraceInterval> Timeline::merged() const {
  std::vector<TraceInterval> polls, others;
  for (const TraceInterval& i : log_.intervals)
    if (meets(i.begin, i.end) && i.kind != TraceKind::rounds)  // tasks are within these
      (i.kind == TraceKind::poll ? polls : others).push_back(i);
  std::sort(polls.begin(), polls.end(), [](const TraceInterval& a, const TraceInterval& b) {
    return std::tuple(a.rank, a.thread, a.begin) < std::tuple(b.rank, b.thread, b.begin);
  });
  constexpr double gap = 1e-6;  // [s]: what a thread needs to come back
  for (const TraceInterval& poll : polls) {
    const bool goes_on = !others.empty() && others.back().kind == TraceKind::poll &&
                         others.back().rank == poll.rank && others.back().thread == poll.thread &&
                         poll.begin - others.back().end < gap;
    if (goes_on)
      others.back().end = std::max(others.back().end, poll.end);
    else
      others.push_back(poll);
  }
  return others;
}

json Timeline::intervals() const {
  Table table({"kind", "step", "rank", "thread", "which", "begin", "length"});
  for (const TraceInterval& i : merged())
    table.add({static_cast<std::int32_t>(i.kind), static_cast<std::int32_t>(i.step), i.rank,
               i.thread, i.which, at(i.begin), ticks(i.end - i.begin)});
  return table.finish();
}

json Timeline::path(const CriticalPath& path) const {
  Table table({"kind", "begin", "length", "task"});
  for (const PathPart& part : path.parts)
    if (meets(part.begin, part.end))
      table.add({static_cast<std::int32_t>(part.kind), at(part.begin), ticks(part.end - part.begin),
                 task(part.task)});
  return table.finish();
}

/// A table for each counter, whose values are multiples of `scale`.
json Timeline::counters() const {
  constexpr std::array<double, trace_counters> scales{1, 1e3, 1e-4};
  json list = json::array();
  for (int c = 0; c < trace_counters; ++c) {
    const auto counter = static_cast<TraceCounter>(c);
    const double scale = scales[static_cast<std::size_t>(c)];
    Table table({"rank", "time", "value"});
    for (const TraceValue& v : log_.counters)
      if (v.counter == counter && meets(v.time, v.time))
        table.add({v.rank, at(v.time),
                   static_cast<std::int32_t>(std::lround(std::min(v.value / scale, 2e9)))});
    list.push_back(table.finish());
    list.back()["name"] = std::string(name_of(counter));
    list.back()["scale"] = scale;
  }
  return list;
}

json run_of(const TraceRun& run) {
  json phases = json::array();
  for (const auto& phase : run.phases)
    phases.push_back({{"name", phase.name}, {"stages", phase.stages}});
  return {
      {"title", run.title},         {"version", run.version},   {"scheme", run.scheme},
      {"ranks", run.ranks},         {"executor", run.executor}, {"threads", run.threads},
      {"hosts", run.hosts},         {"first", run.first},       {"last", run.last},
      {"wall", run.wall},           {"latency", run.latency},   {"clock_bound", run.clock_bound},
      {"phases", std::move(phases)}};
}

}  // namespace

std::string packed(const std::vector<std::int32_t>& values) {
  const std::size_t n = values.size();
  std::string bytes(4 * n, '\0');
  std::uint32_t before = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto value = static_cast<std::uint32_t>(values[i]);
    const std::uint32_t difference = value - before;
    const std::uint32_t folded = difference << 1 ^ (difference >> 31 ? 0xffffffffu : 0u);
    for (std::size_t b = 0; b < 4; ++b)
      bytes[b * n + i] = static_cast<char>(folded >> (8 * b) & 0xffu);
    before = value;
  }
  uLongf size = compressBound(bytes.size());
  std::string deflated(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(deflated.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_BEST_SPEED) != Z_OK)
    throw std::runtime_error("zlib cannot compress the timeline of a trace");
  deflated.resize(size);
  return base64(deflated);
}

std::string timeline_of(const TraceLog& log, const TraceReport& report, std::size_t most_tasks) {
  const Timeline timeline(log, most_tasks);
  json waits = json::array();
  for (const Wait& wait : report.waits) waits.push_back(wait.task);
  json kinds = json::array(), path_kinds = json::array();
  for (int k = 0; k < trace_kinds; ++k) kinds.push_back(name_of(static_cast<TraceKind>(k)));
  for (std::size_t k = 0; k < report.path.by_kind.size(); ++k)
    path_kinds.push_back(name_of(static_cast<PathPart::Kind>(k)));
  return json{{"run", run_of(log.run)},
              {"view", timeline.head()},
              {"kinds", std::move(kinds)},
              {"path_kinds", std::move(path_kinds)},
              {"wait_tasks", std::move(waits)},
              {"tasks", timeline.tasks()},
              {"messages", timeline.messages()},
              {"intervals", timeline.intervals()},
              {"path", timeline.path(report.path)},
              {"counters", timeline.counters()}}
      .dump();
}

}  // namespace lahar
