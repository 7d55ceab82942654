// Frames as a run writes them: the same files however it was executed.
#include "runtime/output/frame_output.h"

#include <doctest/doctest.h>

#include "io/frames/vtkhdf.h"
#include "io/run/run_folder.h"
#include "physics/base/error.h"
#include "runtime/output/node_job.h"
#include "tests/ranks/shared_folder.h"
#include "tests/runtime/step/by_hand.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;
namespace fs = std::filesystem;

namespace {

using Files = std::map<std::string, std::string>;

/// A run whose frames go to a folder; returns its files.
template <int Dim>
Files files_of(const Model<Dim>& model, ExecutionOptions options, bool copied) {
  const TemporaryFolder folder;
  FrameOutput output(folder.path);
  options.staging_bytes = copied ? options.staging_bytes : 0;
  Observer observer;
  observer.frame = [&](FramePieces&& frame) { output.add(std::move(frame)); };
  observer.large_frame = [&](const FrameSource& frame) { output.write(frame); };
  Simulation simulation(model, options, observer);
  output.write(simulation.frame_source());
  simulation.run();
  output.write(simulation.frame_source());
  output.finish();
  const Frame last = read_frame(folder.path / frame_name(simulation.step(), ".hdf"));
  CHECK(same_bits(last, simulation.frame()));
  return contents_of(folder.path);
}

template <int Dim>
void check(const Model<Dim>& model, std::size_t frames) {
  const Files reference = files_of(model, serial(), true);
  CHECK(reference.size() == frames + 1);  // and the index
  for (const ExecutionOptions& way : {serial(), flow(1), flow(2), flow(3), random_order(1)})
    for (const bool copied : {true, false}) {
      CAPTURE(describe(way));
      CAPTURE(copied);
      CHECK(files_of(model, way, copied) == reference);
    }
}

FramePieces frame_at(Index step, Index particles = 2000) {
  const Frame frame = sample_frame(3, particles);
  FramePieces pieces{header_of(frame), {}};
  pieces.header.step = step;
  pieces.header.time = static_cast<double>(step) / 8;
  for (Index first = 0; first < particles; first += 100)
    pieces.pieces.push_back(part_of(frame, first, std::min<Index>(100, particles - first)));
  return pieces;
}

}  // namespace

TEST_CASE("frame files are the same for any way of executing, byte by byte") {
  Model<2> discs = two_discs();
  discs.analysis.patch_particles = 16;
  discs.analysis.nsteps = 60;
  discs.output.frame_steps = 7;
  check(discs, 10);
  discs.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  check(discs, 10);
  check(dam_break_3d(), 4);
}

TEST_CASE("a file of nodes has each node once, ascending ids, and an index of its own") {
  Model<2> model = two_discs();
  model.analysis.patch_particles = 16;
  model.output.node_fields = {NodeField::velocity, NodeField::mass};
  model.analysis.shows_nodes = true;
  const TemporaryFolder folder;
  FrameOutput output(folder.path);
  Observer observer;
  observer.frame = [&](FramePieces&& frame) { output.add(std::move(frame)); };
  observer.nodes = [&](FramePieces&& nodes) { output.add_nodes(std::move(nodes)); };
  Simulation simulation(model, flow(2), observer);
  simulation.run();
  output.finish();
  CHECK(names_in(folder.path) ==
        std::vector<std::string>{"nodes.hdf.series", node_frame_name(20), node_frame_name(40),
                                 node_frame_name(60), node_frame_name(80), "particles.hdf.series",
                                 frame_name(20, ".hdf"), frame_name(40, ".hdf"),
                                 frame_name(60, ".hdf"), frame_name(80, ".hdf")});
  CHECK(read_text_file(folder.path / "nodes.hdf.series").find(node_frame_name(80)) !=
        std::string::npos);
  const Frame nodes = read_frame(folder.path / node_frame_name(80));
  CHECK(nodes.step == 80);
  CHECK(nodes.time == simulation.time());
  CHECK(std::adjacent_find(nodes.id.begin(), nodes.id.end(), std::greater_equal<>()) ==
        nodes.id.end());
  REQUIRE(nodes.columns.size() == 2);
  CHECK(nodes.columns[0].name == "velocity");
  CHECK(nodes.columns[0].unit == "m/s");
  const Frame expected = unite_nodes(*simulation.nodes());
  CHECK(nodes.id == expected.id);
  CHECK(same_bits(nodes.coordinates, expected.coordinates));
  for (std::size_t k = 0; k < 2; ++k)
    CHECK(same_bits(nodes.columns[k].values, expected.columns[k].values));
  for (std::size_t i = 0; i < nodes.id.size(); ++i)
    CHECK(nodes.coordinates[2 * i + 1] == model.mesh->node(nodes.id[i])[1]);
}

TEST_CASE("frames are written in the background, in order, while at most two wait") {
  const TemporaryFolder folder;
  FrameOutput output(folder.path);
  for (Index step = 0; step < 20; ++step) {
    output.add(frame_at(step));
    // All but two are complete when the next one is accepted.
    for (Index done = 0; done + 2 <= step; ++done)
      REQUIRE(fs::exists(folder.path / frame_name(done, ".hdf")));
  }
  output.finish();
  CHECK(names_in(folder.path).size() == 21);
}

TEST_CASE("pieces that are written are given back, and snapshots in their memory are as new") {
  const TemporaryFolder folder;
  FrameOutput output(folder.path);
  FramePieces pieces = frame_at(0, 300);
  const auto spare = pieces.spare = std::make_shared<SparePieces>();
  output.add(std::move(pieces));
  output.finish();
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(spare->take(k).columns.size() > 0);
    CHECK(spare->take(k).columns.empty());
  }

  const auto check_all = []<int Dim>(const Model<Dim>& model) {
    ByHand<Dim> by_hand(model);
    for (int k = 0; k < 5; ++k) by_hand.step();
    SparePieces used;
    for (int p = 0; p < by_hand.patches.size(); ++p) {
      const Frame fresh = snapshot(by_hand.patches[p], model);
      Frame again = snapshot(by_hand.patches[p], model, used.take(0));
      CHECK(same_bits(again, fresh));
      std::vector<Frame> done;
      done.push_back(std::move(again));
      used.give(std::move(done));
    }
  };
  check_all(two_discs());
  check_all(dam_break_3d());
}

TEST_CASE("the index has every frame once, with its time") {
  const TemporaryFolder folder;
  FrameOutput output(folder.path);
  for (const Index step : {0, 5, 5}) output.add(frame_at(step, 10));
  output.finish();
  const std::string index = read_text_file(folder.path / "particles.hdf.series");
  CHECK(index.find("    {\"name\": \"particles_0000000000.hdf\", \"time\": 0},\n"
                   "    {\"name\": \"particles_0000000005.hdf\", \"time\": 0.625}\n  ]") !=
        std::string::npos);
}

TEST_CASE("what waits is written even where nobody asks for the end") {
  const TemporaryFolder folder;
  {
    FrameOutput output(folder.path);
    for (const Index step : {1, 2}) output.add(frame_at(step));
  }
  CHECK(names_in(folder.path).size() == 3);
}

TEST_CASE("a frame gets no name where its folder is not that of the run any more") {
  const TemporaryFolder folder;
  FrameOutput output(folder.path);
  output.before_naming([] { throw IoError("the folder is another's"); });
  output.add(frame_at(1));
  CHECK_THROWS_WITH_AS(output.finish(), "the folder is another's", IoError);
  CHECK(names_in(folder.path).empty());
}

TEST_CASE("a frame that cannot be written is an error at the next one, or at the end") {
  const TemporaryFolder folder;
  write_text_file(folder.path / "file", "");
  const fs::path nowhere = folder.path / "file";
  const std::string message =
      "cannot write " + (nowhere / frame_name(1, ".hdf")).string() + ": Not a directory";
  FrameOutput at_end(nowhere);
  at_end.add(frame_at(1));
  CHECK_THROWS_WITH_AS(at_end.finish(), message.c_str(), IoError);
  FrameOutput next(nowhere);
  const auto write_many = [&] {
    for (Index step = 1; step < 10; ++step) next.add(frame_at(step));
  };
  CHECK_THROWS_WITH_AS(write_many(), message.c_str(), IoError);
}

TEST_CASE("a full disk names step and file, and leaves the frames before it readable") {
  const TemporaryFolder folder;
  const std::string third = (folder.path / frame_name(3, ".hdf")).string();
  {
    const SmallDisk disk(400'000);
    FrameOutput output(folder.path);
    for (const Index step : {1, 2}) output.add(frame_at(step, 500));  // 0.1 MB
    output.add(frame_at(3, 5000));
    CHECK_THROWS_WITH_AS(output.finish(), ("cannot write " + third + ": File too large").c_str(),
                         IoError);
  }
  CHECK(names_in(folder.path) == std::vector<std::string>{"particles.hdf.series",
                                                          frame_name(1, ".hdf"),
                                                          frame_name(2, ".hdf")});
  CHECK(read_frame(folder.path / frame_name(2, ".hdf")).size() == 500);
}

TEST_CASE("an index that cannot be written is an error too") {
  const TemporaryFolder folder;
  make_folder(folder.path / "particles.hdf.series" / "in the way");
  FrameOutput output(folder.path);
  output.add(frame_at(1));
  CHECK_THROWS_AS(output.finish(), IoError);
  CHECK(read_frame(folder.path / frame_name(1, ".hdf")).size() == 2000);
}
