// A run folder from which a run goes on: nothing is left of what comes later, nothing else is lost.
#include "io/run/run_continuation.h"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "io/base/atomic_file.h"
#include "io/base/series.h"
#include "io/frames/vtkhdf.h"
#include "io/run/checkpoint.h"
#include "io/run/run_folder.h"
#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"

namespace lahar {

using namespace test;
namespace fs = std::filesystem;

namespace {

RunFolderContents contents(Index steps = 0) {
  RunFolderContents c;
  c.info.title = "a case";
  c.info.command = {"lahar", "run"};
  c.info.particles = 7;
  c.info.steps = steps;
  c.scenario = "{}";
  c.scenario_full = "{}";
  return c;
}

Frame frame_at(Index step) {
  Frame frame = two_particles();
  frame.step = step;
  frame.time = static_cast<double>(step) / 3;
  return frame;
}

void write_step(RunFolder& run, Index step) {
  HistoryRow row;
  row.step = step;
  row.time = static_cast<double>(step) / 3;
  run.history(row);
  const fs::path frames = frames_folder(run.folder());
  write_frame(frame_at(step), frames / frame_name(step, ".hdf"));
  std::vector<TimedFile> index = run.kept_frames().particles;  // and those since
  for (const FrameFile& frame : frames_of_run(run.folder()))
    if (index.empty() || frame.file.filename() > index.back().name)
      index.push_back({static_cast<double>(frame.step) / 3, frame.file.filename().string()});
  write_series(index, frames / "particles.hdf.series");
}

/// A run with rows and frames at these steps, and checkpoints of that name.
void make_run(const fs::path& path, const std::vector<Index>& steps) {
  RunFolder run(path, contents(40));
  run.log("the beginning");
  for (const Index step : steps) write_step(run, step);
  make_folder(checkpoint_folder(path));
  for (const Index step : steps)
    write_text_file(checkpoint_folder(path) / checkpoint_name(step), "");
  run.finish({.status = RunStatus::stopped, .message = "signal 15", .warnings = {}});
}

const std::vector<const char*> results{"history.csv", "frames/particles.hdf.series"};

}  // namespace

TEST_CASE("a run that goes on has the rows and frames of one that never stopped") {
  const TemporaryFolder folder;
  make_run(folder.path / "whole", {0, 10, 20, 30, 40});
  const fs::path run = folder.path / "run";
  make_run(run, {0, 10, 20, 25});  // the last state, when it was stopped
  write_text_file(run / "notes.txt", "mine");
  write_text_file(run / "frames" / ".particles_0000000030.hdf.123.part", "killed");
  {
    RunFolder again(run, contents(40),
                    RunContinuation{25, 25.0 / 3, false, false, "checkpoint_0000000025.h5"});
    again.log("the end");
    for (const Index step : {30, 40}) write_step(again, step);
    again.finish({});
  }
  for (const char* file : results)
    CHECK(read_text_file(run / file) == read_text_file(folder.path / "whole" / file));
  CHECK(names_in(run / "frames") == names_in(folder.path / "whole" / "frames"));
  CHECK(read_text_file(run / "log.txt") == "the beginning\nthe end\n");
  CHECK(fs::exists(run / "notes.txt"));
  CHECK(checkpoints_in(checkpoint_folder(run)).back().step == 25);

  const auto manifest = nlohmann::json::parse(read_text_file(run / "manifest.json"));
  CHECK(manifest["status"] == "finished");
  CHECK(manifest["model"]["particles"] == 7);
  REQUIRE(manifest["restarts"].size() == 1);
  CHECK(manifest["restarts"][0]["step"] == 25);
  CHECK(manifest["restarts"][0]["checkpoint"] == "checkpoint_0000000025.h5");
}

TEST_CASE("what is due at the step of the checkpoint stays, what is later goes") {
  const TemporaryFolder folder;
  const fs::path run = folder.path / "run";
  make_run(run, {0, 10, 20, 30});
  for (int k = 0; k < 2; ++k) {  // also when it is interrupted at once, and done again
    RunFolder again(run, contents(), RunContinuation{20, 20.0 / 3, true, true, "c"});
    again.finish({});
  }
  CHECK(names_in(run / "frames") ==
        std::vector<std::string>{"particles.hdf.series", frame_name(0, ".hdf"),
                                 frame_name(10, ".hdf"), frame_name(20, ".hdf")});
  const auto lines = read_text_file(run / "history.csv");
  CHECK(lines.find("\n20,") != std::string::npos);
  CHECK(lines.find("\n30,") == std::string::npos);
  CHECK(checkpoints_in(checkpoint_folder(run)).back().step == 20);
  const auto manifest = nlohmann::json::parse(read_text_file(run / "manifest.json"));
  CHECK(manifest["restarts"].size() == 2);
}

TEST_CASE("particles that left before the checkpoint stay listed, later ones are listed again") {
  const TemporaryFolder folder;
  const fs::path run = folder.path / "run";
  make_run(run, {0, 10, 20, 30});
  CHECK_FALSE(fs::exists(run / removed_file));
  RemovedParticle particle;
  const auto row = [&](Index step, Index id) {
    particle.step = step;
    particle.id = id;
    return removed_line(particle);
  };
  const std::string kept = removed_header() + row(15, 7) + row(20, 3);
  write_text_file(run / removed_file, kept + row(20, 4).substr(0, 3));  // killed while writing
  {
    RunFolder again(run, contents(), RunContinuation{20, 20.0 / 3, true, true, "c"});
    CHECK(read_text_file(run / removed_file) == kept);
    const std::vector<RemovedParticle> more{particle};
    again.removed(more);
    again.removed({});
    again.finish({});
  }
  CHECK(read_text_file(run / removed_file) == kept + removed_line(particle));
  {
    RunFolder earlier(run, contents(), RunContinuation{10, 10.0 / 3, true, true, "c"});
    earlier.finish({});
  }
  CHECK_FALSE(fs::exists(run / removed_file));
  {
    RunFolder fresh(run, contents(), true);
    fresh.removed(std::vector<RemovedParticle>{particle});
    fresh.finish({});
  }
  CHECK(read_text_file(run / removed_file) == removed_header() + removed_line(particle));
  RunFolder replaced(run, contents(), true);
  CHECK_FALSE(fs::exists(run / removed_file));
}

TEST_CASE("a half row and a series that is lost are made good") {
  const TemporaryFolder folder;
  const fs::path run = folder.path / "run";
  make_run(run, {0, 10, 20});
  const std::string series = read_text_file(run / "frames" / "particles.hdf.series");
  const std::string history = read_text_file(run / "history.csv");
  for (const char* text : {"", "{\"files\": [{}, 3"}) {
    if (*text)
      write_text_file(run / "frames" / "particles.hdf.series", text);
    else
      fs::remove(run / "frames" / "particles.hdf.series");
    write_text_file(run / "history.csv", history + "21,0.3");
    RunFolder again(run, contents(), RunContinuation{20, 20.0 / 3, true, true, "c"});
    again.finish({});
    CHECK(read_text_file(run / "frames" / "particles.hdf.series") == series);
    CHECK(read_text_file(run / "history.csv") == history);
  }
}

TEST_CASE("only a run that nobody writes to goes on") {
  const TemporaryFolder folder;
  const RunContinuation from{0, 0.0, true, true, "c"};
  CHECK_THROWS_WITH_AS(RunFolder(folder.path / "none", contents(), from),
                       doctest::Contains("holds no run that could be continued"), InputError);
  CHECK_FALSE(fs::exists(folder.path / "none"));
  const fs::path run = folder.path / "run";
  RunFolder open(run, contents());
  write_step(open, 0);
  CHECK_THROWS_WITH_AS(RunFolder(run, contents(), from),
                       doctest::Contains("is being written to by another run"), InputError);
  open.finish({});
}

TEST_CASE("a run that is replaced loses its checkpoints too") {
  const TemporaryFolder folder;
  const fs::path run = folder.path / "run";
  make_run(run, {0, 10});
  RunFolder(run, contents(), true).finish({});
  CHECK(checkpoints_in(checkpoint_folder(run)).empty());
}

TEST_CASE("files of nodes go and stay as their frames do") {
  const TemporaryFolder folder;
  const fs::path run = folder.path / "run";
  make_run(run, {0, 10, 20, 30});
  const fs::path frames = frames_folder(run);
  std::vector<TimedFile> index;
  for (const Index step : {10, 20, 30}) {
    write_frame(frame_at(step), frames / node_frame_name(step));
    index.push_back({static_cast<double>(step) / 3, node_frame_name(step)});
  }
  write_series(index, frames / "nodes.hdf.series");
  {
    RunFolder again(run, contents(), RunContinuation{20, 20.0 / 3, true, true, "c"});
    const KeptFrames kept = again.kept_frames();
    CHECK(kept.particles.size() == 3);
    REQUIRE(kept.nodes.size() == 2);
    CHECK(kept.nodes.back().name == node_frame_name(20));
    CHECK(kept.nodes.back().time == 20.0 / 3);
    again.finish({});
  }
  CHECK(frames_of_run(run).size() == 3);  // nodes are no frames
  CHECK(node_frames_of_run(run).size() == 2);
  CHECK(read_text_file(frames / "nodes.hdf.series").find(node_frame_name(30)) == std::string::npos);
  RunFolder(run, contents(), true).finish({});
  CHECK(names_in(frames).empty());
}

}  // namespace lahar
