#include "runtime/trace/analyse/log_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include "io/base/text.h"
#include "io/json/json_text.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

using nlohmann::json;

json parse(const std::string& file, const std::string& text) {
  json value = json_of_text(text);
  if (value.is_discarded()) refuse_trace(file, "the trace is damaged: a description is no JSON");
  return value;
}

void take_section(TraceFile& file, json& tail, TraceSection::Kind kind, const std::string& bytes) {
  switch (kind) {
    case TraceSection::Kind::head:
      file.head = parse(file.name, bytes);
      return;
    case TraceSection::Kind::graph:
      file.graphs.push_back(parse(file.name, bytes));
      return;
    case TraceSection::Kind::tail:
      tail = parse(file.name, bytes);
      return;
    case TraceSection::Kind::records: {
      if (bytes.size() % sizeof(TraceRecord) != 0)
        refuse_trace(file.name, "the trace is damaged: its records have another size");
      const std::size_t before = file.records.size(), n = bytes.size() / sizeof(TraceRecord);
      file.records.resize(before + n);
      if (n > 0) std::memcpy(file.records.data() + before, bytes.data(), bytes.size());
      return;
    }
  }
  refuse_trace(file.name,
               "the trace holds something unknown; it is damaged, or of a newer version");
}

/// Sections to the tail, which is returned.
json read_sections(std::ifstream& in, std::uint64_t size, TraceFile& file) {
  const std::string incomplete =
      "the trace is not complete: the run was ended while it was written";
  json tail;
  for (std::uint64_t left = size - trace_magic.size(); tail.is_null();) {
    TraceSection section{};
    if (!in.read(reinterpret_cast<char*>(&section), sizeof section))
      refuse_trace(file.name, incomplete);
    left -= std::min<std::uint64_t>(left, sizeof section);
    if (section.bytes > left) refuse_trace(file.name, incomplete);  // before memory is taken
    left -= section.bytes;
    std::string bytes(section.bytes, ' ');
    if (!in.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
      refuse_trace(file.name, incomplete);
    const auto crc =
        ::crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    if (crc != section.crc) refuse_trace(file.name, "the trace is damaged: a checksum is wrong");
    take_section(file, tail, section.kind, bytes);
  }
  return tail;
}

/// Any counter of ticks is below, and what differs from another by less is a finite time.
constexpr double most_ticks = 2e19;

void read_clock(TraceFile& file, const json& tail) {
  const TraceFields fields(file.name, tail);
  const json& clock = fields.list("clock");
  if (clock.size() != 2) fields.refuse("clock");
  const TraceFields begin = fields[clock[0]], end = fields[clock[1]];
  file.first_tick = begin.tick("tick");
  file.first_offset = begin.real("offset", -most_ticks, most_ticks);
  const double last_offset = end.real("offset", -most_ticks, most_ticks);
  const double ticks = static_cast<double>(end.tick("tick")) - static_cast<double>(file.first_tick);
  if (ticks > 0) file.drift = (last_offset - file.first_offset) / ticks;
  file.bound = std::max(begin.real("bound", 0, most_ticks), end.real("bound", 0, most_ticks));
  file.per_tick = fields.real("seconds_per_tick", 1e-15, 1);
}

/// What indices and names are made of.
bool is_sound(const TraceRecord& r, const std::vector<std::int64_t>& phases, std::int64_t rank,
              std::int64_t ranks) {
  if (static_cast<int>(r.kind) >= trace_kinds) return false;
  if (r.loop < 0 || r.loop >= static_cast<std::int64_t>(phases.size())) return false;
  if (r.loop == 0 ? r.round != -1 : r.round < 0) return false;
  const bool step = r.step >= 0 && r.step <= most_trace_step;
  const bool place = step && r.phase < phases[static_cast<std::size_t>(r.loop)] && r.patch >= 0 &&
                     r.patch <= most_trace_patches;
  switch (r.kind) {
    case TraceKind::task:
    case TraceKind::unpack:
      return place;
    case TraceKind::send:
    case TraceKind::arrival:
      return place && r.detail.message.peer >= 0 && r.detail.message.peer < ranks &&
             r.detail.message.peer != rank && r.detail.message.bytes >= 0;
    case TraceKind::dt:
      return step && r.patch == -1 && r.phase == 0;
    case TraceKind::counter:
      // `load` is made from tasks.
      return r.phase < static_cast<int>(TraceCounter::load) && std::isfinite(r.detail.value) &&
             std::abs(r.detail.value) < 1e18;
    case TraceKind::agreement:
      return r.phase <= static_cast<int>(TraceAgreement::time_step) && r.step >= -1 &&
             r.step <= most_trace_step;
    default:
      return r.step >= -1 && r.step <= most_trace_step;
  }
}

}  // namespace

void refuse_trace(const std::string& file, const std::string& what, const std::string& hint) {
  throw InputError({Problem{.file = file, .message = what, .hint = hint}});
}

TraceFields::TraceFields(const std::string& file, const json& json) : file_(file), json_(json) {
  if (!json.is_object()) refuse_trace(file, "the trace is damaged: a description is no object");
}

void TraceFields::refuse(const char* key) const {
  refuse_trace(file_, fmt::format("the trace is damaged: '{}' is not what it can be", key));
}

const json& TraceFields::at(const char* key) const {
  const auto found = json_.find(key);
  if (found == json_.end())
    refuse_trace(file_, fmt::format("the trace is damaged: '{}' is missing", key));
  return *found;
}

std::int64_t TraceFields::whole(const char* key, std::int64_t low, std::int64_t high) const {
  const json& value = at(key);
  // What is unsigned and beyond becomes negative, which no key allows.
  if (!value.is_number_integer()) refuse(key);
  const auto number = value.get<std::int64_t>();
  if (number < low || number > high) refuse(key);
  return number;
}

std::uint64_t TraceFields::tick(const char* key) const {
  if (!at(key).is_number_unsigned()) refuse(key);
  return at(key).get<std::uint64_t>();
}

double TraceFields::real(const char* key, double low, double high) const {
  if (!at(key).is_number()) refuse(key);
  const auto number = at(key).get<double>();
  if (!(number >= low && number <= high)) refuse(key);
  return number;
}

bool TraceFields::flag(const char* key) const {
  if (!at(key).is_boolean()) refuse(key);
  return at(key).get<bool>();
}

/// Reports and pages show it as it is.
std::string TraceFields::text(const char* key) const {
  if (!at(key).is_string()) refuse(key);
  return printable(at(key).get<std::string>());
}

const json& TraceFields::list(const char* key) const {
  if (!at(key).is_array()) refuse(key);
  return at(key);
}

TraceFile read_trace_file(const std::filesystem::path& path) {
  TraceFile file{.name = path.string()};
  std::error_code error;
  std::ifstream in;
  if (std::filesystem::is_regular_file(path, error)) in.open(path, std::ios::binary);
  const auto size = std::filesystem::file_size(path, error);
  if (!in.is_open() || error)
    refuse_trace(file.name, "cannot be read",
                 "a trace has one file per rank; copy all of them, or record it again");
  std::string magic(trace_magic.size(), ' ');
  in.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  if (magic != trace_magic)
    refuse_trace(file.name,
                 magic.starts_with("Lahar trace ")
                     ? "is a trace of another version of Lahar, '" + magic.substr(0, 13) + "'"
                     : "is not a trace of Lahar",
                 "traces are the files RUN/trace/rank-N.trace");
  read_clock(file, read_sections(in, size, file));
  const TraceFields head = file.fields();
  const std::int64_t ranks = head.whole("ranks", 1, most_trace_ranks),
                     rank = head.whole("rank", 0, ranks - 1);
  std::vector<std::int64_t> phases;  // of each loop
  for (const json& loop : head.list("loops"))
    phases.push_back(static_cast<std::int64_t>(head[loop].list("phases").size()));
  for (const TraceRecord& record : file.records)
    if (!is_sound(record, phases, rank, ranks))
      refuse_trace(file.name, "the trace is damaged: it has a record of something that cannot be");
  return file;
}

namespace {

TraceRun::PhaseInfo phase_in(const TraceFields& phase, const std::string& prefix) {
  TraceRun::PhaseInfo info{.exchange = phase.text("exchange"),
                           .gives_dt = phase.flag("gives_dt"),
                           .needs_dt = phase.flag("needs_dt")};
  for (const json& stage : phase.list("stages")) {
    if (!stage.is_string()) phase.refuse("stages");
    info.stages.push_back(printable(stage.get<std::string>()));
  }
  const std::size_t n = info.stages.size();
  if (n < 1 || n > trace_stages) phase.refuse("stages");
  info.name = prefix + (n < 3 ? fmt::format("{}", fmt::join(info.stages, ", "))
                              : info.stages.front() + " to " + info.stages.back());
  return info;
}

}  // namespace

int TraceRun::loop_of(int phase) const {
  int loop = 0;
  while (loop + 1 < static_cast<int>(loops.size()) &&
         phase >= loops[static_cast<std::size_t>(loop)].last)
    ++loop;
  return loop;
}

TraceRun run_in(const TraceFile& file) {
  const TraceFields head = file.fields();
  TraceRun run{.id = head.text("run"),
               .version = head.text("version"),
               .title = head.text("title"),
               .scheme = head.text("scheme"),
               .executor = head.text("executor"),
               .ranks = static_cast<int>(head.whole("ranks", 1, most_trace_ranks)),
               .adaptive = head.flag("adaptive"),
               .latency = head.real("latency", 0, 1e9)};
  if (head.list("loops").empty()) head.refuse("loops");
  for (const json& description : head.list("loops")) {
    const TraceFields loop = head[description];
    const json& phases = loop.list("phases");
    if (phases.empty() || run.phases.size() + phases.size() > most_trace_phases)
      head.refuse("phases");
    const std::string name = loop.text("name");
    run.loops.push_back({name, static_cast<int>(run.phases.size()), 0});
    for (const json& phase : phases)
      run.phases.push_back(phase_in(loop[phase], run.loops.size() > 1 ? name + ": " : ""));
    run.loops.back().last = static_cast<int>(run.phases.size());
  }
  return run;
}

TraceGraph graph_in(const std::vector<TraceFile>& files, std::size_t g) {
  TraceGraph graph;
  for (std::size_t r = 0; r < files.size(); ++r) {
    if (g >= files[r].graphs.size())
      refuse_trace(files[r].name, "has fewer partitions than " + files[0].name);
    const TraceFields description(files[r].name, files[r].graphs[g]);
    const Step first = description.whole("first", 0, most_trace_step);
    if (r > 0 && first != graph.first) description.refuse("first");
    graph.first = first;
    for (const json& p : description.list("patches")) {
      const TraceFields patch = description[p];
      const auto number = static_cast<int>(patch.whole("number", 0, most_trace_patches));
      TracePatch& to = graph.patches[number];
      if (!to.neighbours.empty()) patch.refuse("number");  // it is there twice
      to = {.number = number,
            .rank = static_cast<int>(r),
            .cells = patch.whole("cells", 0, INT64_MAX / 2),
            .particles = patch.whole("particles", 0, INT64_MAX / 2)};
      for (const json& q : patch.list("neighbours")) {
        if (!q.is_number_integer() || q < 0 || q > most_trace_patches || q == number)
          patch.refuse("neighbours");
        to.neighbours.push_back(q.get<int>());
      }
    }
  }
  // Messages that only one side expects would be waited for without end.
  for (const auto& [number, patch] : graph.patches)
    for (const int q : patch.neighbours) {
      const auto other = graph.patches.find(q);
      const auto back = [&](const TracePatch& of) {
        return std::count(of.neighbours.begin(), of.neighbours.end(), number);
      };
      if (other == graph.patches.end() || back(other->second) != 1)
        refuse_trace(files[0].name,
                     fmt::format("the trace is damaged: patch {} is a neighbour of {}, but not the "
                                 "other way round",
                                 q, number));
    }
  return graph;
}

}  // namespace lahar
