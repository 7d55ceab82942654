// Traces, with all that `lahar trace` makes of them.
#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "io/scenario/scenario.h"
#include "physics/base/error.h"
#include "runtime/program/trace_session.h"
#include "runtime/step/simulation.h"
#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/chrome.h"
#include "runtime/trace/analyse/page.h"
#include "runtime/trace/analyse/project.h"
#include "runtime/trace/analyse/replay.h"
#include "tests/fuzz/sections.h"
#include "tests/fuzz/targets.h"

namespace lahar::fuzz {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Replays need all tasks; whether a trace has them they say.
void replay_all(const TraceLog& log) {
  try {
    const Replay measured = replay(log, {});
    check_shown(text_of(measured));
    static_cast<void>(json_of(measured));
    for (const bool bulk : {false, true})
      static_cast<void>(replay(
          log,
          {.ranks = 3, .threads = 2, .network = Network::assumed(), .bulk_synchronous = bulk}));
    const ScalingProjection projection = project(log, {.cores = 4, .steady = true});
    check_shown(text_of(projection));
    static_cast<void>(json_of(projection));
  } catch (const InputError&) {
  }
}

// --- inputs to begin with ---------------------------------------------------------------------

/// A run's trace whose times and names are always the same.
SectionedFile recorded(const char* scenario) {
  const Scenario read = read_scenario_text(example(scenario), work_folder());
  Model<2> model = std::get<Model<2>>(read.model);
  model.analysis.patch_particles = 8;
  ExecutionOptions options;
  options.mode = ExecutionOptions::Mode::serial;
  Simulation simulation(std::move(model), options);
  const fs::path run = work_folder() / "recorded";
  fs::create_directories(run);
  TraceAbout about{.version = "0", .title = "a title", .scheme = "usf", .executor = "serial"};
  about.adaptive = std::get<Model<2>>(read.model).analysis.step.adaptive;
  TraceSession session(run, {}, Communicator{}, about, simulation.loops(),
                       simulation.trace_graph());
  simulation.advance(3);
  session.finish();
  SectionedFile file = split_sections(contents(trace_file(run, 0))).front();
  fs::remove_all(run);
  std::uint64_t now = 1'000'000;
  for (Section& section : file) {
    if (section.kind == TraceSection::Kind::records) {
      std::vector<TraceRecord> records(section.bytes.size() / sizeof(TraceRecord));
      std::memcpy(records.data(), section.bytes.data(), section.bytes.size());
      for (TraceRecord& record : records) {
        record.begin = now;
        record.end = now + 900;
        record.ready = record.ready > 0 ? now - 50 : 0;
        now += 1000;
        if (record.kind == TraceKind::task) record.detail = {.stage = {300, 200, 100}};
        if (record.kind == TraceKind::counter) record.detail = {.value = 1e6};
      }
      std::memcpy(section.bytes.data(), records.data(), section.bytes.size());
    } else if (section.kind != TraceSection::Kind::graph) {
      json text = json::parse(section.bytes);
      if (section.kind == TraceSection::Kind::head) {
        text["run"] = "0123456789abcdef";
        text["host"] = "a host";
      } else {
        text = {{"clock",
                 {{{"tick", 999'000}, {"offset", 0.0}, {"bound", 10.0}},
                  {{"tick", now}, {"offset", 5.0}, {"bound", 10.0}}}},
                {"seconds_per_tick", 1e-9}};
      }
      section.bytes = text.dump();
    }
  }
  return file;
}

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// The patches of a run dealt to two ranks, with a message for each phase that takes something from
/// neighbours.
std::vector<SectionedFile> dealt(const SectionedFile& whole) {
  const json head = json::parse(whole.front().bytes);
  std::vector<SectionedFile> files(2);
  const auto rank_of = [](int patch) { return static_cast<std::size_t>(patch % 2); };
  for (const Section& section : whole) {
    for (std::size_t r = 0; r < files.size(); ++r) {
      Section own = section;
      if (section.kind == TraceSection::Kind::records) {
        std::vector<TraceRecord> records(section.bytes.size() / sizeof(TraceRecord)), kept;
        std::memcpy(records.data(), section.bytes.data(), section.bytes.size());
        for (const TraceRecord& record : records) {
          const bool task = record.kind == TraceKind::task;
          if (!task || rank_of(record.patch) == r) kept.push_back(record);
          if (!task) continue;
          const json& phases = head["loops"][static_cast<std::size_t>(record.loop)]["phases"];
          const std::size_t next = (record.phase + 1u) % phases.size();
          if (phases[next]["exchange"] == "") continue;
          TraceRecord message = record;
          message.ready = 0;
          message.detail = {.message = {.bytes = 640, .peer = static_cast<int>(1 - r), .sent = 0}};
          if (rank_of(record.patch) == r) {
            message.kind = TraceKind::send;
            message.begin = record.end;
            message.end = record.end + 20;
            kept.push_back(message);
            continue;
          }
          message.kind = TraceKind::arrival;
          message.begin = record.end + 30;
          message.end = record.end + 40;
          message.detail.message.sent = record.end + 20;
          kept.push_back(message);
          TraceRecord unpack = record;
          unpack.kind = TraceKind::unpack;
          unpack.begin = record.end + 45;
          unpack.end = record.end + 60;
          unpack.detail = {.missed = record.end + 10};
          kept.push_back(unpack);
        }
        own.bytes = bytes_of(kept);
      } else if (section.kind == TraceSection::Kind::head) {
        json text = head;
        text["rank"] = r;
        text["ranks"] = files.size();
        own.bytes = text.dump();
      } else if (section.kind == TraceSection::Kind::graph) {
        json text = json::parse(section.bytes), patches = json::array();
        for (const json& patch : text["patches"])
          if (rank_of(patch["number"]) == r) patches.push_back(patch);
        text["patches"] = patches;
        own.bytes = text.dump();
      }
      files[r].push_back(own);
    }
  }
  return files;
}

}  // namespace

void run_trace(Bytes input) {
  const fs::path run = work_folder() / "run";
  fs::create_directories(trace_folder(run));
  constexpr std::size_t most_ranks = 4;
  const std::vector<std::string_view> files = split_files(text_of(input));
  for (std::size_t r = 0; r < most_ranks; ++r) {
    const fs::path file = trace_file(run, static_cast<int>(r));
    std::error_code error;
    if (r < files.size())
      write(file, files[r]);
    else
      fs::remove(file, error);
  }
  const TraceLog log = read_trace(run);
  static_cast<void>(problems_of(log));
  const TraceReport report = analyse(log);
  check_shown(text_of(log, report));
  static_cast<void>(json_of(log, report));
  static_cast<void>(page_of(log, report));
  write_chrome(log, run / "chrome.json");
  replay_all(log);
}

std::vector<Seed> trace_seeds() {
  const SectionedFile sand = recorded("sand.json"), soil = recorded("soil.json");
  return {{"sand", join_sections({sand})},
          {"soil", join_sections({soil})},
          {"two-ranks", join_sections(dealt(sand))}};
}

}  // namespace lahar::fuzz
