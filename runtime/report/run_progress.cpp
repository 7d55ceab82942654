#include "runtime/report/run_progress.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>

#include "io/base/atomic_file.h"
#include "io/json/json_text.h"
#include "io/run/manifest.h"
#include "physics/base/error.h"
#include "runtime/report/table.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json json_in(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error) ? json_of_text(read_text_file(file)) : json{};
}

std::string text_in(const json& object, const char* key) {
  return object.is_object() && object.contains(key) && object[key].is_string()
             ? object[key].get<std::string>()
             : "";
}

double number_in(const json& object, const char* key) {
  return object.is_object() && object.contains(key) && object[key].is_number()
             ? object[key].get<double>()
             : 0;
}

/// False if the process that writes is of this machine and does not exist any more.
bool may_be_alive(const json& manifest) {
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) != 0 || text_in(manifest, "host") != host.data())
    return true;
  const auto process = static_cast<pid_t>(number_in(manifest, "process"));
  return process <= 0 || kill(process, 0) == 0 || errno != ESRCH;
}

/// The run itself, or the stage that began last.
fs::path folder_of(const fs::path& run) {
  std::error_code error;
  if (is_run_folder(run)) return run;
  std::pair<std::string, fs::path> latest;
  if (fs::is_directory(run, error))
    for (const auto& entry : fs::directory_iterator(run, error))
      if (entry.is_directory(error) && is_run_folder(entry.path()))
        latest = std::max(
            latest, {text_in(json_in(entry.path() / "manifest.json"), "started"), entry.path()});
  if (latest.second.empty())
    throw InputError(
        {Problem{.message = fmt::format("{} is not a run folder", run.string()),
                 .hint = "name a folder that `lahar run` writes: it has a manifest.json"}});
  return latest.second;
}

}  // namespace

double RunProgress::share() const {
  if (status == "finished") return 1;
  double most = 0;
  if (steps > 0) most = step / steps;
  if (end_time > 0) most = std::max(most, time / end_time);
  return std::clamp(most, 0.0, 1.0);
}

RunProgress read_progress(const fs::path& run) {
  const fs::path folder = folder_of(run);
  const json manifest = json_in(folder / "manifest.json");
  RunProgress progress;
  if (folder != run) progress.stage = folder.filename().string();
  progress.status = text_in(manifest, "status");
  progress.message = text_in(manifest, "message");
  progress.started = text_in(manifest, "started");
  progress.wall_seconds = number_in(manifest, "wall_seconds");
  if (progress.status == "running" && !may_be_alive(manifest)) progress.status = "lost";
  const json model =
      manifest.is_object() && manifest.contains("model") ? manifest["model"] : json{};
  progress.steps = number_in(model, "steps");
  progress.particles = number_in(model, "particles");
  const json scenario = json_in(folder / "scenario.full.json");
  if (scenario.is_object() && scenario.contains("analysis"))
    progress.end_time = number_in(scenario["analysis"], "end_time");
  std::error_code error;
  if (fs::is_regular_file(folder / "history.csv", error)) {
    const Table history = read_table(folder / "history.csv");
    const auto last = [&](const char* column, double otherwise) {
      const TableColumn* found = history.find(column);
      return found && !found->values.empty() ? found->values.back() : otherwise;
    };
    progress.step = last("step", 0);
    progress.time = last("time", 0);
    progress.particles = last("particles", progress.particles);
    progress.max_speed = last("max_speed", 0);
  }
  return progress;
}

}  // namespace lahar
