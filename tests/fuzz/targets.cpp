#include "tests/fuzz/targets.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <variant>

#include "io/atomic_file.h"
#include "io/cbgeo_table.h"
#include "io/checkpoint.h"
#include "io/csv.h"
#include "io/material_driver.h"
#include "io/scenario.h"
#include "io/vtkhdf.h"
#include "physics/error.h"
#include "runtime/material_command.h"
#include "runtime/simulation.h"
#include "runtime/trace/log.h"

namespace lahar::fuzz {

namespace {

namespace fs = std::filesystem;

/// Runs take some steps where they are small.
constexpr double most_memory = 256e6;  // [bytes]
constexpr Index most_particles = 2000, most_cells = 20000, steps = 3;

/// A folder of this process, in memory where that is possible.
const fs::path& work_folder() {
  static const fs::path folder = [] {
    const fs::path base = fs::is_directory("/dev/shm") ? "/dev/shm" : fs::temp_directory_path();
    fs::path made = base / ("lahar-fuzz-" + std::to_string(::getpid()));
    fs::create_directories(made);
    return made;
  }();
  return folder;
}
struct Cleaner {
  ~Cleaner() {
    std::error_code error;
    fs::remove_all(work_folder(), error);
  }
};

std::string_view text_of(Bytes input) {
  return {reinterpret_cast<const char*>(input.data()), input.size()};
}

/// The input as a file of this name.
fs::path file_of(Bytes input, const std::string& name) {
  static const Cleaner cleaner;
  fs::path file = work_folder() / name;
  std::ofstream(file, std::ios::binary | std::ios::trunc) << text_of(input);
  return file;
}

std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

template <int Dim>
void take_steps(Model<Dim> model) {
  const auto particles = static_cast<Index>(model.particles.x.size());
  if (particles > most_particles || model.mesh->n_cells() > most_cells) return;
  model.analysis.patch_particles = std::max<Index>(model.analysis.patch_particles, 16);
  model.output = {};
  ExecutionOptions options;
  options.mode = ExecutionOptions::Mode::serial;
  Simulation<Dim> simulation(std::move(model), options);
  if (!simulation.finished()) simulation.advance(steps);
  static_cast<void>(simulation.frame());
  static_cast<void>(simulation.history());
}

void scenario(Bytes input) {
  static const Cleaner cleaner;
  const std::vector<BundledFile> files = unbundle(text_of(input));
  std::vector<fs::path> written;
  for (std::size_t k = 1; k < files.size(); ++k) {
    const fs::path file = work_folder() / fs::path(files[k].name).filename();
    if (file.filename().empty()) continue;
    std::ofstream(file, std::ios::binary | std::ios::trunc) << files[k].text;
    written.push_back(file);
  }
  const auto remove = [&] {
    std::error_code error;
    for (const fs::path& file : written) fs::remove(file, error);
  };
  try {
    ScenarioOptions options;
    options.memory = {most_memory, "a fuzzed input may take"};
    Scenario read = read_scenario_text(files.front().text, work_folder(), options);
    for (const Problem& warning : read.warnings) static_cast<void>(format_problems({warning}));
    std::visit([](auto& model) { take_steps(std::move(model)); }, read.model);
  } catch (const InputError& error) {
    static_cast<void>(format_problems(error.problems(), "error", true));
    remove();
    throw;
  } catch (...) {
    remove();
    throw;
  }
  remove();
}

void material(Bytes input) {
  const MaterialDriver driver =
      read_material_driver_text(std::string(text_of(input)), work_folder());
  Index count = 0;
  for (const PathSegment& segment : driver.path) count += segment.steps;
  if (count > 1000) return;
  std::vector<PathPoint> points;
  Index divided = 0;
  follow_path(driver, points, divided);
}

void csv(Bytes input) {
  const Frame frame = parse_csv(text_of(input), "input.csv");
  static_cast<void>(csv_text(frame));
}

void frame(Bytes input) {
  const Frame read = read_frame(file_of(input, "frame.hdf"));
  static_cast<void>(csv_text(read));
}

void checkpoint(Bytes input) {
  CheckpointReader reader(file_of(input, "checkpoint_0000000001.h5"));
  for (std::size_t i = 0; i < reader.patches().size(); ++i) static_cast<void>(reader.patch(i));
}

void cbgeo(Bytes input) {
  const fs::path file = file_of(input, "particles01.h5");
  const Index rows = count_cbgeo_rows(file);
  static_cast<void>(read_cbgeo_rows(file, 0, std::min<Index>(rows, 100000)));
}

void trace(Bytes input) {
  const fs::path run = work_folder() / "run";
  fs::create_directories(trace_folder(run));
  std::ofstream(trace_file(run, 0), std::ios::binary | std::ios::trunc) << text_of(input);
  static_cast<void>(read_trace(run));
}

// --- inputs to begin with --------------------------------------------------------------------

std::vector<std::string> none() {
  return {};
}

Frame small_frame() {
  Frame frame;
  const auto read = read_scenario_text(
      contents(fs::path(LAHAR_SOURCE_DIR) / "tests/fuzz/corpus/scenario/sand.json"), work_folder());
  Model<2> model = std::get<Model<2>>(read.model);
  ExecutionOptions options;
  options.mode = ExecutionOptions::Mode::serial;
  return Simulation<2>(std::move(model), options).frame();
}

std::vector<std::string> csv_seeds() {
  return {csv_text(small_frame())};
}

std::vector<std::string> frame_seeds() {
  static const Cleaner cleaner;
  const fs::path file = work_folder() / "seed.hdf";
  write_frame(small_frame(), file);
  return {contents(file)};
}

std::vector<std::string> checkpoint_seeds() {
  static const Cleaner cleaner;
  const fs::path file = work_folder() / "seed.h5";
  std::vector<CheckpointPatch> patches;
  const std::string state = "some state of a patch";
  const auto bytes = std::as_bytes(std::span(state));
  for (Index id = 0; id < 3; ++id)
    patches.push_back({.id = id,
                       .offset = 0,
                       .bytes = static_cast<Index>(bytes.size()),
                       .checksum = checksum(bytes)});
  lay_out(patches);
  CheckpointHeader header;
  header.scenario = "{}";
  const Index begin = create_checkpoint(file, file, header, patches);
  std::string text = contents(file);
  text.resize(static_cast<std::size_t>(begin));
  for (int k = 0; k < 3; ++k) text += state;
  return {text};
}

std::vector<std::string> cbgeo_seeds() {
  static const Cleaner cleaner;
  const fs::path file = work_folder() / "seed-table.h5";
  write_cbgeo_table(file, 3, [](Index, Index n) {
    return std::vector<CbgeoParticle>(static_cast<std::size_t>(n));
  });
  return {contents(file)};
}

constexpr Target all[] = {
    {"scenario", "scenario files with their side files, read, and run for some steps", true,
     scenario, none},
    {"material", "input of `lahar material`", true, material, none},
    {"csv", "particles as CSV", false, csv, csv_seeds},
    {"frame", "frames, VTKHDF", false, frame, frame_seeds},
    {"checkpoint", "checkpoints, HDF5", false, checkpoint, checkpoint_seeds},
    {"cbgeo", "particle files of CB-Geo MPM, HDF5", false, cbgeo, cbgeo_seeds},
    {"trace", "traces", false, trace, none},
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

std::vector<std::string> corpus(const Target& target) {
  std::vector<std::string> inputs = target.seeds();
  const fs::path folder = fs::path(LAHAR_SOURCE_DIR) / "tests/fuzz/corpus" / target.name;
  std::vector<fs::path> files;
  if (fs::is_directory(folder))
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) inputs.push_back(contents(file));
  return inputs;
}

bool run(const Target& target, Bytes input) {
  try {
    target.run(input);
    return true;
  } catch (const InputError&) {
  } catch (const IoError&) {
  } catch (const SimulationError&) {
  }
  return false;
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

}  // namespace lahar::fuzz
