// Run folders: what a program finds there that somebody else may have changed.
#include <array>

#include "io/frames/vtkhdf.h"
#include "io/results/compare.h"
#include "io/results/export.h"
#include "io/run/run_folder.h"
#include "io/scenario/scenario.h"
#include "runtime/step/simulation.h"
#include "tests/fuzz/targets.h"

namespace lahar::fuzz {

namespace {

namespace fs = std::filesystem;

/// Steps of which the folder has frames; the run goes on from the middle one.
constexpr std::array<Index, 3> steps{1, 2, 3};
constexpr Index going_on = 2;

const std::array<std::string, steps.size()>& frames() {
  static const auto made = [] {
    const Scenario read = read_scenario_text(example("sand.json"), work_folder());
    ExecutionOptions options;
    options.mode = ExecutionOptions::Mode::serial;
    Simulation simulation(std::get<Model<2>>(read.model), options);
    std::array<std::string, steps.size()> texts;
    for (std::string& text : texts) {
      simulation.advance(1);
      write_frame(simulation.frame(), work_folder() / "frame.hdf");
      text = contents(work_folder() / "frame.hdf");
    }
    return texts;
  }();
  return made;
}

/// The names of a run folder's texts, in the order of the bundle.
constexpr std::array names{"manifest.json", "frames/particles.hdf.series", "history.csv",
                           "removed.csv",   "scenario.full.json",          "log.txt"};

}  // namespace

void run_folder(Bytes input) {
  const fs::path run = work_folder() / "run-folder";
  std::error_code error;
  fs::remove_all(run, error);
  fs::create_directories(run / "frames");
  for (std::size_t k = 0; k < steps.size(); ++k)
    write(run / "frames" / frame_name(steps[k], ".hdf"), frames()[k]);
  const std::vector<BundledFile> files = unbundle(text_of(input));
  for (std::size_t k = 0; k < std::min(files.size(), names.size()); ++k)
    if (!files[k].text.empty()) write(run / names[k], files[k].text);
  check_shown(compare(run, run).text());
  static_cast<void>(export_run(run, ExportFormat::cbgeo, {.kind = FrameChoice::Kind::all}));
  static_cast<void>(export_run(run, ExportFormat::vtu, {.kind = FrameChoice::Kind::all}));
  RunFolder folder(run, {}, RunContinuation{.step = going_on, .time = 0.01, .checkpoint = "some"});
  static_cast<void>(folder.kept_frames());
  folder.log("goes on");
  folder.history({});
  folder.finish({});
}

std::vector<Seed> folder_seeds() {
  const fs::path run = work_folder() / "seed-run";
  const Scenario read = read_scenario_text(example("sand.json"), work_folder());
  {
    RunInfo info;
    info.title = "sand";
    info.dim = 2;
    RunFolder folder(run, {.info = info, .scenario = read.text, .scenario_full = read.full});
    for (const Index step : steps) {
      HistoryRow row;
      row.step = step;
      folder.history(row);
      const RemovedParticle gone{.step = step, .id = step};
      folder.removed({&gone, 1});
    }
    folder.finish({});
  }
  write_series({{0.001, frame_name(1, ".hdf")}, {0.002, frame_name(2, ".hdf")}},
               run / "frames/particles.hdf.series");
  std::vector<BundledFile> files;
  for (const char* name : names) files.push_back({name, contents(run / name)});
  fs::remove_all(run);
  return {{"run", bundle(files)}};
}

}  // namespace lahar::fuzz
