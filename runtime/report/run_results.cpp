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

/// Objects of an array of the manifest.
std::vector<json> list_of(const json& manifest, const char* key) {
  std::vector<json> list;
  const json found = member_of(manifest, key);
  if (found.is_array()) list.assign(found.begin(), found.end());
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
    const fs::path file = part.folder / text_in(item, "file");
    if (fs::is_regular_file(file)) part.gauges.push_back({text_in(item, "name"), read_table(file)});
  }
  for (const json& item : list_of(part.manifest, "maps")) {
    std::vector<std::string> files;
    for (const json& name : list_of(item, "files"))
      if (name.is_string()) files.push_back(name.get<std::string>());
    for (const std::string& name : files)
      if (name.ends_with(".asc") && fs::is_regular_file(part.folder / name))
        part.maps.push_back({text_in(item, "name"), text_in(item, "unit"), text_in(item, "meaning"),
                             part.folder / name});
  }
}

RunPart read_part(FolderOfRun from, const std::string& name) {
  RunPart part;
  part.name = name;
  part.folder = std::move(from.folder);
  part.manifest = std::move(from.manifest);
  const fs::path& folder = part.folder;
  const auto there = [&](const char* file) { return fs::is_regular_file(folder / file); };
  if (there("scenario.json")) part.scenario = read_text_file(folder / "scenario.json");
  if (there("history.csv")) part.history = read_table(folder / "history.csv");
  if (there(rigid_bodies_file)) part.bodies = read_table(folder / rigid_bodies_file);
  part.shapes = PlacedBodies(folder);
  if (there(removed_file)) part.removed = read_table(folder / removed_file).rows();
  if (there("log.txt")) part.stages = stages_in(read_text_file(folder / "log.txt"));
  for (const json& warning : list_of(part.manifest, "warnings"))
    if (warning.is_string()) part.warnings.push_back(warning.get<std::string>());
  part.axisymmetric = is_axisymmetric(folder);
  if (fs::is_directory(frames_folder(folder))) part.frames = frames_of_run(folder);
  read_maps_and_gauges(part);
  return part;
}

}  // namespace

std::string RunPart::text(const char* key) const {
  return text_in(manifest, key);
}

double RunPart::number(const char* key) const {
  return number_in(manifest, key);
}

double RunPart::model(const char* key) const {
  return number_in(member_of(manifest, "model"), key);
}

double RunPart::timed_from() const {
  const std::vector<json> restarts = list_of(manifest, "restarts");
  return restarts.empty() ? 0 : number_in(restarts.back(), "step");
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
    const double from = part.timed_from();
    for (std::size_t k = 1; k < step.size(); ++k)
      sum += std::max(0.0, step[k] - std::max(step[k - 1], from)) * n[k];
  }
  return sum;
}

namespace {

/// The run with full strength, or its stages, and the mechanism where there is one.
std::vector<RunPart> parts_of_search(const fs::path& folder, const SafetyRecord& record) {
  const fs::path rest = folder / "equilibrium", mechanism = folder / "mechanism";
  std::vector<RunPart> parts;
  for (FolderOfRun& one : folders_of_run(rest)) {
    const std::string name = one.folder.lexically_relative(folder).generic_string();
    parts.push_back(read_part(std::move(one), name));
  }
  if (auto manifest = read_manifest(mechanism); manifest && record.mechanism)
    parts.push_back(read_part({mechanism, std::move(*manifest)}, "mechanism"));
  for (RunPart& part : parts) part.is_stage = false;
  return parts;
}

}  // namespace

RunResults read_run(const fs::path& folder) {
  RunResults run;
  run.safety = read_safety(folder);
  if (run.safety) {
    run.parts = parts_of_search(folder, run.safety->record);
  } else {
    for (FolderOfRun& one : folders_of_run(folder)) {
      const std::string stage = one.folder == folder ? "" : one.folder.filename().string();
      run.parts.push_back(read_part(std::move(one), stage));
    }
  }
  for (std::size_t k = 1; k < run.parts.size(); ++k)
    run.parts[k].begin = run.parts[k - 1].begin + run.parts[k - 1].end_time();
  run.title = run.last().text("title");
  const fs::path name = fs::absolute(folder).lexically_normal();
  run.label = (name.has_filename() ? name : name.parent_path()).filename().string();
  if (run.title.empty()) run.title = run.label;
  return run;
}

}  // namespace lahar
