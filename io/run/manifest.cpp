#include "io/run/manifest.h"

#include <fmt/chrono.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <tuple>

#include "io/base/atomic_file.h"
#include "io/base/sha256.h"
#include "io/json/json_text.h"
#include "io/run/history.h"
#include "physics/base/error.h"
#include "physics/particles/patch_split.h"

namespace lahar {

namespace {

using Json = nlohmann::ordered_json;

constexpr int manifest_format = 1;

std::string host_name() {
  char name[256] = "";
  return gethostname(name, sizeof name - 1) == 0 ? name : "unknown";
}

Json hashes(const std::vector<std::filesystem::path>& files) {
  Json list = Json::array();
  for (const auto& file : files) {
    Json hash = nullptr;
    try {
      hash = sha256_of_file(file);
    } catch (const IoError&) {
      // It was readable when the scenario was read; the results do not depend on it any more.
    }
    list.push_back({{"file", file.string()}, {"sha256", hash}});
  }
  return list;
}

Json history_json() {
  Json columns = Json::array();
  for (const HistoryColumn& column : history_columns())
    columns.push_back({{"name", column.name}, {"unit", column.unit}, {"meaning", column.meaning}});
  return columns;
}

Json columns_json(const std::vector<GaugeColumn>& columns) {
  Json list = Json::array();
  for (const GaugeColumn& column : columns)
    list.push_back({{"name", column.name}, {"unit", column.unit}, {"meaning", column.meaning}});
  return list;
}

Json gauges_json(const std::vector<GaugeTable>& tables) {
  Json list = Json::array();
  for (const GaugeTable& table : tables)
    list.push_back({{"name", table.name},
                    {"file", gauge_file("", table.name).generic_string()},
                    {"columns", columns_json(table.columns)}});
  return list;
}

Json bodies_json(const std::vector<BodyShape>& bodies) {
  Json list = Json::array();
  for (std::size_t i = 0; i < bodies.size(); ++i)
    list.push_back({{"name", bodies[i].name},
                    {"file", body_file("", i, bodies[i].name).generic_string()},
                    {"centre", bodies[i].centre}});
  return list;
}

Json program_json(const RunInfo& info) {
  Json libraries = Json::object();
  for (const auto& [name, version] : info.libraries) libraries[name] = version;
  return {{"name", "lahar"},
          {"version", info.version},
          {"commit", info.commit},
          {"compiler", info.compiler},
          {"libraries", libraries}};
}

/// Text that is not UTF-8 (file names may be anything) is shown with replacement characters.
std::string dump(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace

const char* name_of(RunStatus status) {
  switch (status) {
    case RunStatus::running:
      return "running";
    case RunStatus::finished:
      return "finished";
    case RunStatus::failed:
      return "failed";
    case RunStatus::stopped:
      return "stopped";
  }
  return "unknown";
}

std::string utc_now() {
  const auto seconds = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(seconds));
}

Manifest::Manifest(const RunInfo& info) {
  const Json model = {{"dim", info.dim},
                      {"scheme", info.scheme},
                      {"nodes", info.nodes},
                      {"cells", info.cells},
                      {"particles", info.particles},
                      {"materials", info.materials},
                      {"patches", info.patches},
                      {"steps", info.steps},
                      {"dt", info.dt},
                      {"dt_limit", info.dt_limit},
                      {"patch_particles", info.patch_particles},
                      {"split_steps", info.split_steps},
                      {"split_factor", split_factor}};
  Json json = {
      {"lahar_run", manifest_format},
      {"title", info.title},
      {"program", program_json(info)},
      {"command", info.command},
      {"host", host_name()},
      {"process", static_cast<std::int64_t>(getpid())},
      {"ranks", info.ranks},
      {"threads", info.threads},
      {"model", model},
      {"inputs", hashes(info.inputs)},
      {"history", history_json()},
      {"started", utc_now()},
  };
  if (info.stage > 0) json["stage"] = info.stage;
  if (!info.map_reference.empty() || info.map_origin != std::array<double, 2>{})
    json["map"] = {{"origin", info.map_origin}, {"reference", info.map_reference}};
  if (!info.changes.empty()) json["changes"] = info.changes;
  if (!info.gauges.empty()) json["gauges"] = gauges_json(info.gauges);
  if (!info.maps.empty()) {
    json["maps"] = columns_json(info.maps);
    for (Json& map : json["maps"])
      map["files"] = {"maps/" + map["name"].get<std::string>() + ".asc"};
  }
  if (!info.bodies.empty()) json["rigid_bodies"] = bodies_json(info.bodies);
  start_ = dump(json);
}

Manifest::Manifest(const RunInfo& info, const std::string& earlier, const RunRestart& restart)
    : Manifest(info) {
  const Json before = json_of_text<Json>(earlier);
  Json json = Json::parse(start_);
  // Somebody may have edited it: what is not as it was written is made anew.
  const auto kept = [&](const char* key, Json::value_t type) {
    return before.is_object() && before.contains(key) && before[key].type() == type;
  };
  Json restarts = kept("restarts", Json::value_t::array) ? before["restarts"] : Json::array();
  restarts.push_back({{"step", restart.step},
                      {"time", restart.time},
                      {"checkpoint", restart.checkpoint},
                      {"restarted", json["started"]},
                      {"command", info.command},
                      {"version", info.version},
                      {"commit", info.commit}});
  if (kept("model", Json::value_t::object)) json["model"] = before["model"];
  if (kept("changes", Json::value_t::array)) json["changes"] = before["changes"];
  if (kept("started", Json::value_t::string)) json["started"] = before["started"];
  json["model"]["steps"] = info.steps;
  json["restarts"] = restarts;
  start_ = dump(json);
}

std::string Manifest::with_end(const RunEnd* end) const {
  Json json = Json::parse(start_);
  json["status"] = name_of(end ? end->status : RunStatus::running);
  if (end) {
    json["message"] = end->message;
    json["ended"] = utc_now();
    json["wall_seconds"] = end->wall_seconds;
    json["steps"] = end->steps;
    json["time"] = end->time;
    json["patches"] = end->patches;
    json["splits"] = end->splits;
    json["warnings"] = end->warnings;
  }
  return dump(json);
}

std::optional<nlohmann::json> read_manifest(const std::filesystem::path& folder) {
  try {
    nlohmann::json json = json_of_text(read_text_file(folder / "manifest.json"));
    if (json.is_object() && json.contains("lahar_run")) return json;
  } catch (const IoError&) {
    // There is none.
  }
  return {};
}

bool is_run_folder(const std::filesystem::path& folder) {
  return read_manifest(folder).has_value();
}

namespace {

double number_of_stage(const FolderOfRun& one) {
  return number_in(one.manifest, "stage");
}

}  // namespace

std::vector<FolderOfRun> runs_in(const std::filesystem::path& folder) {
  std::vector<FolderOfRun> folders;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error))
    if (entry.is_directory(error))
      if (auto manifest = read_manifest(entry.path()))
        folders.push_back({entry.path(), std::move(*manifest)});
  // Manifests of older versions do not number stages; `started` counts whole seconds.
  const auto order = [](const FolderOfRun& one) {
    return std::tuple(number_of_stage(one), text_in(one.manifest, "started"), one.folder);
  };
  std::sort(folders.begin(), folders.end(),
            [&](const auto& a, const auto& b) { return order(a) < order(b); });
  return folders;
}

std::vector<FolderOfRun> stages_in(const std::filesystem::path& folder) {
  std::vector<FolderOfRun> stages = runs_in(folder);
  std::erase_if(stages, [](const FolderOfRun& one) { return number_of_stage(one) < 1; });
  if (!stages.empty() && number_of_stage(stages.front()) > 1) stages.clear();
  return stages;
}

std::vector<FolderOfRun> folders_of_run(const std::filesystem::path& run) {
  if (auto manifest = read_manifest(run)) return {{run, std::move(*manifest)}};
  std::vector<FolderOfRun> folders;
  for (FolderOfRun& stage : stages_in(run)) {
    if (!folders.empty() && number_of_stage(folders.back()) == number_of_stage(stage))
      folders.pop_back();
    folders.push_back(std::move(stage));
  }
  if (folders.empty()) folders = runs_in(run);
  if (folders.empty())
    throw InputError({Problem{.message = fmt::format("{} is not a run folder", run.string()),
                              .hint = "name a folder that `lahar run` wrote: it has a "
                                      "manifest.json"}});
  return folders;
}

}  // namespace lahar
