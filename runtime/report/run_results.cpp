#include "runtime/report/run_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "io/base/atomic_file.h"
#include "io/json/json_text.h"
#include "physics/base/error.h"
#include "runtime/picture/run_facts.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string text_of(const json& object, const char* key) {
  return object.is_object() && object.contains(key) && object[key].is_string()
             ? object[key].get<std::string>()
             : "";
}

double number_of(const json& object, const char* key) {
  return object.is_object() && object.contains(key) && object[key].is_number()
             ? object[key].get<double>()
             : 0;
}

/// Objects of an array of the manifest.
std::vector<json> list_of(const json& manifest, const char* key) {
  std::vector<json> list;
  if (manifest.is_object() && manifest.contains(key) && manifest[key].is_array())
    for (const json& item : manifest[key]) list.push_back(item);
  return list;
}

/// Rows "name  calls  total  ...  share %" below the last head of such a table.
std::vector<StageShare> stages_in(const std::string& log) {
  std::vector<StageShare> stages;
  std::istringstream in(log);
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("  task  ")) {
      stages.clear();
      inside = true;
      continue;
    }
    if (!inside) continue;
    constexpr std::size_t name_width = 14;
    const std::string name = line.substr(0, line.find_last_not_of(' ') + 1).size() > name_width
                                 ? line.substr(2, line.find("  ", 2) - 2)
                                 : "";
    if (name.empty() || !line.ends_with(" %")) {
      inside = false;
      continue;
    }
    std::istringstream numbers(line.substr(2 + name.size()));
    std::vector<double> values;
    for (std::string word; numbers >> word;) {
      std::erase(word, ',');
      if (word != "%") values.push_back(std::strtod(word.c_str(), nullptr));
    }
    if (values.size() < 2) continue;
    const bool counted = values.size() > 2;  // "idle" has no calls
    stages.push_back({name, values[counted ? 1 : 0], values.back() / 100});
  }
  return stages;
}

void read_maps_and_gauges(RunPart& part) {
  for (const json& item : list_of(part.manifest, "gauges")) {
    const fs::path file = part.folder / text_of(item, "file");
    if (fs::is_regular_file(file)) part.gauges.push_back({text_of(item, "name"), read_table(file)});
  }
  for (const json& item : list_of(part.manifest, "maps")) {
    std::vector<std::string> files;
    for (const json& name : list_of(item, "files"))
      if (name.is_string()) files.push_back(name.get<std::string>());
    for (const std::string& name : files)
      if (name.ends_with(".asc") && fs::is_regular_file(part.folder / name))
        part.maps.push_back({text_of(item, "name"), text_of(item, "unit"), text_of(item, "meaning"),
                             part.folder / name});
  }
}

RunPart read_part(const fs::path& folder, const std::string& name) {
  RunPart part;
  part.name = name;
  part.folder = folder;
  part.manifest = json_of_text(read_text_file(folder / "manifest.json"));
  if (!part.manifest.is_object())
    throw IoError(
        fmt::format("cannot read {}: it is not JSON", (folder / "manifest.json").string()));
  const auto there = [&](const char* file) { return fs::is_regular_file(folder / file); };
  if (there("scenario.json")) part.scenario = read_text_file(folder / "scenario.json");
  if (there("history.csv")) part.history = read_table(folder / "history.csv");
  if (there("rigid_bodies.csv")) part.bodies = read_table(folder / "rigid_bodies.csv");
  if (there("removed.csv")) part.removed = read_table(folder / "removed.csv").rows();
  if (there("log.txt")) part.stages = stages_in(read_text_file(folder / "log.txt"));
  for (const json& warning : list_of(part.manifest, "warnings"))
    if (warning.is_string()) part.warnings.push_back(warning.get<std::string>());
  part.axisymmetric = run_facts(folder).axisymmetric;
  if (fs::is_directory(frames_folder(folder))) part.frames = frames_of_run(folder);
  read_maps_and_gauges(part);
  return part;
}

/// Stages of a scenario have folders of their own, in the order in which they began.
std::vector<fs::path> stage_folders(const fs::path& folder) {
  std::vector<std::pair<std::string, fs::path>> found;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && is_run_folder(entry.path())) {
      const json manifest = json_of_text(read_text_file(entry.path() / "manifest.json"));
      found.emplace_back(text_of(manifest, "started"), entry.path());
    }
  std::sort(found.begin(), found.end());
  std::vector<fs::path> folders;
  for (auto& [started, path] : found) folders.push_back(std::move(path));
  return folders;
}

}  // namespace

std::string RunPart::text(const char* key) const {
  return text_of(manifest, key);
}

double RunPart::number(const char* key) const {
  return number_of(manifest, key);
}

double RunPart::model(const char* key) const {
  return manifest.contains("model") ? number_of(manifest["model"], key) : 0;
}

double RunPart::end_time() const {
  if (manifest.contains("time")) return number("time");
  const std::vector<double> times = history.values("time");
  return times.empty() ? 0 : times.back();
}

double RunResults::steps() const {
  double sum = 0;
  for (const RunPart& part : parts) {
    const std::vector<double> steps = part.history.values("step");
    sum += part.manifest.contains("steps") ? part.number("steps")
           : steps.empty()                 ? 0
                                           : steps.back();
  }
  return sum;
}

double RunResults::wall_seconds() const {
  double sum = 0;
  for (const RunPart& part : parts) sum += part.number("wall_seconds");
  return sum;
}

double RunResults::end_time() const {
  return last().begin + last().end_time();
}

double RunResults::particle_steps() const {
  double sum = 0;
  for (const RunPart& part : parts) {
    const std::vector<double> step = part.history.values("step"),
                              n = part.history.values("particles");
    for (std::size_t k = 1; k < step.size(); ++k) sum += (step[k] - step[k - 1]) * n[k];
  }
  return sum;
}

RunResults read_run(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw InputError(fmt::format("{} is not a run folder", folder.string()));
  RunResults run;
  if (is_run_folder(folder))
    run.parts.push_back(read_part(folder, ""));
  else
    for (const fs::path& stage : stage_folders(folder))
      run.parts.push_back(read_part(stage, stage.filename().string()));
  if (run.parts.empty())
    throw InputError(
        {Problem{.message = fmt::format("{} is not a run folder", folder.string()),
                 .hint = "name a folder that `lahar run` wrote: it has a manifest.json"}});
  for (std::size_t k = 1; k < run.parts.size(); ++k)
    run.parts[k].begin = run.parts[k - 1].begin + run.parts[k - 1].end_time();
  run.title = run.last().text("title");
  const fs::path name = fs::absolute(folder).lexically_normal();
  run.label = (name.has_filename() ? name : name.parent_path()).filename().string();
  if (run.title.empty()) run.title = run.label;
  return run;
}

}  // namespace lahar
