#include "io/run/checkpoint_header.h"

#include <fmt/format.h>

#include <cmath>

#include "io/base/sha256.h"
#include "io/json/json_text.h"
#include "io/run/manifest.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

using Json = nlohmann::ordered_json;

/// JSON has no infinity.
Json or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

double or_infinity(const Json& value) {
  return value.is_null() ? std::numeric_limits<double>::infinity() : value.get<double>();
}

/// What runs without a watchdog may come to: "inf", "-inf" or "nan" where it is no finite number.
Json any_number(double value) {
  return std::isfinite(value) ? Json(value) : Json(fmt::format("{}", value));
}

double number_of(const Json& value) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double one : {HUGE_VAL, -HUGE_VAL, nan, -nan})
    if (value == any_number(one)) return one;
  return value.get<double>();
}

WatchdogAlarm::Kind kind_of(const Json& value) {
  const int kind = value;
  if (kind < 0 || kind > static_cast<int>(WatchdogAlarm::Kind::volume))
    throw IoError("its watchdog has an alarm of an unknown kind");
  return static_cast<WatchdogAlarm::Kind>(kind);
}

Json splits_json(const std::vector<PatchSplit>& splits) {
  Json list = Json::array();
  for (const PatchSplit& split : splits) list.push_back({split.patch, split.axis, split.at});
  return list;
}

std::vector<PatchSplit> splits_of(const Json& list) {
  std::vector<PatchSplit> splits;
  for (const Json& split : list) splits.push_back({split.at(0), split.at(1), split.at(2)});
  return splits;
}

Json watchdog_json(const WatchdogState& state) {
  const WatchdogAlarm& alarm = state.alarm;
  return {{"stored", any_number(state.stored)},
          {"put_in", any_number(state.put_in)},
          {"speed", any_number(state.speed)},
          {"first_step", any_number(state.first_step)},
          {"end_step", state.end_step},
          {"alarm",
           {{"kind", static_cast<int>(alarm.kind)},
            {"step", alarm.step},
            {"time", alarm.time},
            {"value", or_null(alarm.value)},
            {"text", alarm.text}}}};
}

WatchdogState watchdog_of(const Json& run) {
  if (!run.contains("watchdog")) return {};  // before there was one
  const Json& json = run.at("watchdog");
  const Json& alarm = json.at("alarm");
  return {.stored = number_of(json.at("stored")),
          .put_in = number_of(json.at("put_in")),
          .speed = number_of(json.at("speed")),
          .first_step = number_of(json.at("first_step")),
          .end_step = json.at("end_step"),
          .alarm = {.kind = kind_of(alarm.at("kind")),
                    .step = alarm.at("step"),
                    .time = alarm.at("time"),
                    .value = or_infinity(alarm.at("value")),
                    .text = alarm.at("text")}};
}

/// Members of RigidBodyState by name.
template <class State, class Visit>
void for_members(State& body, Visit visit) {
  visit("origin", body.origin);
  visit("velocity", body.velocity);
  visit("spin", body.spin);
  visit("axes", body.axes);
  visit("force", body.force);
  visit("torque", body.torque);
  visit("moved", body.moved);
  visit("turned", body.turned);
}

Json rigid_bodies_json(const std::vector<RigidBodyState>& bodies) {
  Json list = Json::array();
  for (const RigidBodyState& body : bodies) {
    Json& entry = list.emplace_back(Json::object());
    entry["name"] = body.name;
    for_members(body, [&](const char* key, const auto& values) {
      Json& numbers = entry[key] = Json::array();
      for (const double value : values) numbers.push_back(any_number(value));
    });
  }
  return list;
}

std::vector<RigidBodyState> rigid_bodies_of(const Json& run) {
  std::vector<RigidBodyState> bodies;
  if (!run.contains("rigid_bodies")) return bodies;  // before there were any
  for (const Json& entry : run.at("rigid_bodies")) {
    RigidBodyState& body = bodies.emplace_back();
    body.name = entry.at("name").get<std::string>();
    for_members(body, [&](const char* key, auto& values) {
      const Json& numbers = entry.at(key);
      if (!numbers.is_array() || numbers.size() != values.size())
        throw IoError(fmt::format("'{}' of a rigid body is not {} numbers", key, values.size()));
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = number_of(numbers[i]);
    });
  }
  return bodies;
}

Json rest_json(const RestState& rest) {
  return {{"reached", rest.reached},
          {"imbalance", any_number(rest.imbalance)},
          {"kinetic", any_number(rest.kinetic)}};
}

RestState rest_of(const Json& run) {
  if (!run.contains("rest")) return {};  // before there was a test of equilibrium
  const Json& json = run.at("rest");
  return {.reached = json.at("reached"),
          .imbalance = number_of(json.at("imbalance")),
          .kinetic = number_of(json.at("kinetic"))};
}

Json numbers_json(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(any_number(value));
  return list;
}

std::vector<double> numbers_of(const Json& list) {
  std::vector<double> values;
  for (const Json& value : list) values.push_back(number_of(value));
  return values;
}

Json gauges_json(const GaugeState& state) {
  return {{"time", state.time},
          {"beyond", numbers_json(state.beyond)},
          {"removed", state.removed},
          {"maps", numbers_json(state.maps)}};
}

GaugeState gauges_of(const Json& run) {
  if (!run.contains("gauges")) return {};  // before there were any
  const Json& json = run.at("gauges");
  return {.time = json.at("time"),
          .beyond = numbers_of(json.at("beyond")),
          .removed = json.at("removed").get<std::vector<Index>>(),
          .maps = numbers_of(json.at("maps"))};
}

Json run_json(const RunState& run) {
  return {{"dim", run.dim},
          {"step", run.step},
          {"time", run.time},
          {"dt", run.dt},
          {"dt_limit", or_null(run.dt_limit)},
          {"particles", run.particles},
          {"removed", run.removed},
          {"next_id", run.next_id},
          {"history_steps", run.history_steps},
          {"work",
           {{"internal", any_number(run.work.internal)},
            {"external", any_number(run.work.external)},
            {"damping", any_number(run.work.damping)},
            {"friction", any_number(run.work.friction)},
            {"divided", run.work.divided}}},
          {"kinetic_at_start", any_number(run.kinetic_at_start)},
          {"cells_per_patch", run.cells_per_patch},
          {"least_mass", run.least_mass},
          {"columns", run.columns},
          {"splits", splits_json(run.splits)},
          {"split_step", run.split_step},
          {"watchdog", watchdog_json(run.watchdog)},
          {"rigid_bodies", rigid_bodies_json(run.rigid_bodies)},
          {"rest", rest_json(run.rest)},
          {"gauges", gauges_json(run.gauges)}};
}

/// A number that steps are counted by, or memory is asked for.
Index whole(const Json& json, const char* key, Index low, Index high = INT64_MAX / 4) {
  const Json& value = json.at(key);
  const Index number = value.is_number_integer() ? value.get<Index>() : low - 1;
  if (number < low || number > high)
    throw IoError(fmt::format("its '{}' cannot be {}", key, value.dump()));
  return number;
}

RunState run_of(const Json& json) {
  const Json& work = json.at("work");
  return {
      .dim = static_cast<int>(whole(json, "dim", 0, 3)),
      .step = whole(json, "step", 0),
      .time = json.at("time"),
      .dt = json.at("dt"),
      .dt_limit = or_infinity(json.at("dt_limit")),
      .particles = whole(json, "particles", 0),
      .removed = whole(json, "removed", 0),
      // Before there were injections: not needed.
      .next_id = json.contains("next_id") ? whole(json, "next_id", 0) : 0,
      .history_steps = whole(json, "history_steps", 0),
      .work = {number_of(work.at("internal")), number_of(work.at("external")),
               number_of(work.at("damping")), number_of(work.at("friction")), work.at("divided")},
      .kinetic_at_start = number_of(json.at("kinetic_at_start")),
      .cells_per_patch = whole(json, "cells_per_patch", 0),
      .least_mass = json.at("least_mass"),
      .columns = json.at("columns"),
      .splits = splits_of(json.at("splits")),
      .split_step = whole(json, "split_step", -1),
      .watchdog = watchdog_of(json),
      .rigid_bodies = rigid_bodies_of(json),
      .rest = rest_of(json),
      .gauges = gauges_of(json)};
}

}  // namespace

std::string header_text(const CheckpointHeader& header) {
  Json side_files = Json::array();
  for (const SideFileHash& side : header.side_files)
    side_files.push_back({{"file", side.file}, {"sha256", side.sha256}});
  const Json json = {{"lahar_checkpoint", checkpoint_format},
                     {"program",
                      {{"name", "lahar"},
                       {"version", header.version},
                       {"commit", header.commit},
                       {"compiler", header.compiler}}},
                     {"run", run_json(header.run)},
                     {"side_files", side_files},
                     {"scenario", header.scenario}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace);
}

CheckpointHeader read_header(const std::string& text) {
  try {
    const Json json = json_of_text<Json>(text);
    if (json.is_discarded()) throw IoError("its header is no JSON");
    if (const int format = json.at("lahar_checkpoint"); format != checkpoint_format)
      throw IoError(fmt::format(
          "it has format {}, this version of Lahar reads format {}: continue with the version that "
          "wrote it",
          format, checkpoint_format));
    const Json& program = json.at("program");
    CheckpointHeader header{.version = program.at("version"),
                            .commit = program.at("commit"),
                            .compiler = program.at("compiler"),
                            .run = run_of(json.at("run")),
                            .scenario = json.at("scenario"),
                            .side_files = {}};
    for (const Json& side : json.at("side_files"))
      header.side_files.push_back({side.at("file"), side.at("sha256")});
    return header;
  } catch (const Json::exception& error) {
    throw IoError(fmt::format("its header is not one of a checkpoint ({})", error.what()));
  }
}

std::vector<SideFileHash> hashes_of(const std::vector<std::filesystem::path>& files) {
  std::vector<SideFileHash> hashes;
  for (const auto& file : files) hashes.push_back({file.string(), sha256_of_file(file)});
  return hashes;
}

}  // namespace lahar
