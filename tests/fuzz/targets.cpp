#include "tests/fuzz/targets.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "io/geometry/map_files.h"
#include "physics/base/error.h"

namespace lahar::fuzz {

namespace {

namespace fs = std::filesystem;

std::vector<Seed> none() {
  return {};
}

/// For readers that take memory by what a file says: much less than it may say [bytes].
constexpr std::uint64_t small_memory = std::uint64_t{3} << 29;

constexpr Target all[] = {
    {"scenario", "scenario files with their side files, read, and run for some steps", Form::bundle,
     run_scenario, scenario_seeds},
    {"dialect", "the same with --as-cbgeo", Form::bundle, run_dialect, dialect_seeds},
    {"material", "input of `lahar material`", Form::bundle, run_material, none},
    {"csv", "particles as CSV", Form::bytes, run_csv, csv_seeds},
    {"frame", "frames, VTKHDF", Form::bytes, run_frame, frame_seeds},
    {"checkpoint", "checkpoints, HDF5", Form::bytes, run_checkpoint, checkpoint_seeds},
    {"restart", "states in checkpoints, from which a run goes on", Form::sections, run_restart,
     restart_seeds},
    {"folder", "what a run folder has when a run goes on, is exported or compared", Form::bundle,
     run_folder, folder_seeds},
    {"cbgeo", "particle files of CB-Geo MPM, HDF5", Form::bytes, run_cbgeo, cbgeo_seeds},
    {"trace", "traces of one and several ranks, analysed and replayed", Form::sections, run_trace,
     trace_seeds},
    {"geometry", "triangles, rasters and polygons, alone and in a scenario", Form::formats,
     run_geometry, none, small_memory},
    {"mesh", "meshes of Gmsh and VTU files, alone and in a scenario", Form::formats, run_mesh,
     mesh_seeds, small_memory},
    {"network", "networks for replays", Form::bundle, run_network, none},
    {"bench", "results of `lahar bench`", Form::bundle, run_bench, bench_seeds},
};

constexpr std::string_view folder_prefix = "lahar-fuzz-";

/// Folders of processes that an input, or a user, ended.
void remove_abandoned(const fs::path& base) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(base, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(folder_prefix)) continue;
    const std::string process = name.substr(folder_prefix.size());
    if (!process.empty() && !fs::exists(fs::path("/proc") / process, error) && !error)
      fs::remove_all(entry.path(), error);
  }
}

/// Whether a build without GDAL cannot read it.
bool is_map(const std::string& name) {
  return name.ends_with(".asc") || name.ends_with(".tif") || name.ends_with(".geojson") ||
         name.ends_with(".shp");
}

struct Cleaner {
  fs::path folder;
  ~Cleaner() {
    std::error_code error;
    fs::remove_all(folder, error);
  }
};

}  // namespace

std::span<const Target> targets() {
  return all;
}

const Target& target(std::string_view name) {
  for (const Target& one : all)
    if (one.name == name) return one;
  throw std::invalid_argument("there is no target " + std::string(name));
}

std::vector<Seed> corpus(const Target& target) {
  std::vector<Seed> inputs = target.seeds();
  const fs::path folder = fs::path(LAHAR_SOURCE_DIR) / "tests/fuzz/corpus" / target.name;
  std::vector<fs::path> files;
  if (fs::is_directory(folder))
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    if (is_map(name) && !has_gdal()) continue;
    inputs.push_back({name, contents(file), !name.starts_with("refused-")});
  }
  return inputs;
}

std::string run(const Target& target, Bytes input) {
  const auto said = [](const std::exception& error) {
    return error.what()[0] ? std::string(error.what()) : std::string("no reason");
  };
  try {
    target.run(input);
    return "";
  } catch (const InputError& error) {
    return said(error);
  } catch (const IoError& error) {
    return said(error);
  } catch (const SimulationError& error) {
    return said(error);
  }
}

std::vector<BundledFile> unbundle(std::string_view text) {
  std::vector<BundledFile> files{{"scenario.json", {}}};
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size() - 1);
    const std::string_view line = text.substr(0, end + 1);
    text.remove_prefix(end + 1);
    if (line.starts_with("=== ")) {
      std::string name(line.substr(4));
      while (!name.empty() && (name.back() == '\n' || name.back() == '\r')) name.pop_back();
      files.push_back({std::move(name), {}});
    } else {
      files.back().text += line;
    }
  }
  return files;
}

std::string bundle(const std::vector<BundledFile>& files) {
  std::string text;
  for (const BundledFile& file : files) {
    if (&file != &files.front())
      text += (text.empty() || text.back() == '\n' ? "=== " : "\n=== ") + file.name + "\n";
    text += file.text;
  }
  return text;
}

const fs::path& work_folder() {
  static const Cleaner made = [] {
    const fs::path base = fs::is_directory("/dev/shm") ? "/dev/shm" : fs::temp_directory_path();
    remove_abandoned(base);
    fs::path folder = base / (std::string(folder_prefix) + std::to_string(::getpid()));
    fs::create_directories(folder);
    return Cleaner{folder};
  }();
  return made.folder;
}

std::string_view text_of(Bytes input) {
  return {reinterpret_cast<const char*>(input.data()), input.size()};
}

void write(const fs::path& file, std::string_view text) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
}

std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void check_shown(std::string_view text) {
  for (const char c : text)
    if ((static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7f)
      throw std::logic_error("text for people has a control character");
}

std::string example(std::string_view name) {
  return contents(fs::path(LAHAR_SOURCE_DIR) / "tests/fuzz/corpus/scenario" / name);
}

}  // namespace lahar::fuzz
