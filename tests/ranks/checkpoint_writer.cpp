// Checkpoints that all ranks write together.
#include "runtime/output/checkpoint_writer.h"

#include <doctest/doctest.h>

#include <atomic>
#include <optional>
#include <string>

#include "io/base/atomic_file.h"
#include "physics/base/error.h"
#include "runtime/step/restart.h"
#include "tests/io/frames/frame_samples.h"
#include "tests/ranks/shared_folder.h"

using namespace lahar;
using namespace lahar::test;
namespace fs = std::filesystem;

namespace {

constexpr Index n_patches = 50;

std::vector<std::byte> bytes_of(Index patch) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(1 + patch * patch * 7 % 3000));
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::byte>(static_cast<Index>(i) * 13 + patch);
  return bytes;
}

/// Every rank has every so manieth patch, the first rank none where there are several.
SimulationState share_of(const Communicator& ranks, Index step) {
  SimulationState state;
  state.run = {.dim = 2, .step = step, .time = 0.25, .columns = "coordinates 2"};
  const int owners = ranks.several() ? ranks.size() - 1 : 1;
  for (Index patch = 0; patch < n_patches; ++patch)
    if (static_cast<int>(patch % owners) + (ranks.several() ? 1 : 0) == ranks.rank()) {
      state.patches.push_back(patch);
      state.sizes.push_back(static_cast<Index>(bytes_of(patch).size()));
    }
  state.bytes = [ids = state.patches](std::size_t i) { return bytes_of(ids[i]); };
  return state;
}

CheckpointHeader header_of(const SimulationState& state) {
  CheckpointHeader header;
  header.run = state.run;
  header.scenario = "{}";
  return header;
}

void write(CheckpointWriter& writer, const SimulationState& state) {
  writer.write(header_of(state), state);
}

/// What one rank with all patches writes.
std::string alone(Index step) {
  const TemporaryFolder folder;
  CheckpointWriter writer({.folder = folder.path}, Communicator());
  write(writer, share_of(Communicator(), step));
  writer.finish();
  return read_text_file(folder.path / checkpoint_name(step));
}

std::vector<Index> steps_in(const fs::path& folder) {
  std::vector<Index> steps;
  for (const CheckpointFile& file : checkpoints_in(folder)) steps.push_back(file.step);
  return steps;
}

}  // namespace

TEST_CASE("the bytes of a checkpoint do not depend on ranks, nor on whether it was copied") {
  const Communicator ranks = Communicator::world();
  for (const std::size_t copied : {std::size_t{1} << 20, std::size_t{0}}) {
    const SharedFolder folder(ranks);
    CheckpointWriter writer({.folder = folder.path / "checkpoints", .staging_bytes = copied},
                            ranks);
    write(writer, share_of(ranks, 10));
    writer.finish();
    const fs::path file = folder.path / "checkpoints" / checkpoint_name(10);
    ranks.wait_for_all();
    CHECK(read_text_file(file) == alone(10));
    // A state that is a copy, each patch of which is asked for once.
    SimulationState copy = share_of(ranks, 11);
    copy.copied = true;
    std::vector<int> asked(copy.patches.size(), 0);
    copy.bytes = [&asked, good = copy.bytes](std::size_t i) {
      ++asked[i];
      return good(i);
    };
    write(writer, copy);
    writer.finish();
    ranks.wait_for_all();
    CHECK(read_text_file(folder.path / "checkpoints" / checkpoint_name(11)) == alone(11));
    CHECK(asked == std::vector<int>(asked.size(), 1));
    const auto reader = open_checkpoint("latest", folder.path, ranks, [](const std::string&) {
      FAIL("a good checkpoint was passed over");
    });
    CHECK(reader->header().run.step == 11);
    CHECK(reader->patches().size() == n_patches);
    CHECK(state_in(*reader).bytes(7) == bytes_of(7));
  }
}

TEST_CASE("a checkpoint is complete or absent, and the last ones are kept") {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  bool synced = false;
  std::vector<Index> complete_before;
  CheckpointWriter writer({.folder = folder.path,
                           .kept = 2,
                           .before_complete =
                               [&] {
                                 synced = true;
                                 complete_before = steps_in(folder.path);
                               }},
                          ranks);
  for (const Index step : {10, 20, 30, 40}) {
    write(writer, share_of(ranks, step));
    CHECK(writer.last_step() == step);
    while (!writer.progress()) std::this_thread::yield();
    ranks.wait_for_all();  // rank 0 gave it its name
    CHECK(steps_in(folder.path).back() == step);
    CHECK(steps_in(folder.path).size() <= 2);
    if (ranks.rank() == 0) {
      CHECK((complete_before.empty() || complete_before.back() < step));
      CHECK(synced);
    }
  }
  CHECK(steps_in(folder.path) == std::vector<Index>{30, 40});
  for (const Index step : {30, 40})
    CHECK(read_text_file(folder.path / checkpoint_name(step)) == alone(step));
}

TEST_CASE("a checkpoint waits for the one before") {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  CheckpointWriter writer({.folder = folder.path, .kept = 10}, ranks);
  for (Index step = 1; step <= 8; ++step) write(writer, share_of(ranks, step));
  writer.finish();
  ranks.wait_for_all();
  CHECK(steps_in(folder.path).size() == 8);
}

TEST_CASE("what one rank cannot do fails on all, leaves no file, and the next may succeed") {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  CheckpointWriter writer({.folder = folder.path / "checkpoints"}, ranks);
  if (ranks.rank() == 0) write_text_file(folder.path / "checkpoints", "not a folder");
  const std::string no_folder = error_of([&] {
    write(writer, share_of(ranks, 1));
    writer.finish();
  });
  CHECK(no_folder.find("checkpoints: Not a directory") != std::string::npos);
  ranks.wait_for_all();
  if (ranks.rank() == 0) fs::remove(folder.path / "checkpoints");

  // The last rank's state cannot be packed when it is written.
  CheckpointWriter large({.folder = folder.path / "checkpoints", .staging_bytes = 0}, ranks);
  SimulationState state = share_of(ranks, 2);
  std::atomic<int> calls = 0;
  if (ranks.rank() == ranks.size() - 1)
    state.bytes = [&, n = state.patches.size(), good = state.bytes](std::size_t i) {
      if (++calls > static_cast<int>(n)) throw IoError("the disk is gone");
      return good(i);
    };
  const std::string failure = error_of([&] {
    write(large, state);
    large.finish();
  });
  CHECK(failure.find("the disk is gone") != std::string::npos);
  ranks.wait_for_all();
  CHECK(fs::is_empty(folder.path / "checkpoints"));
  ranks.wait_for_all();
  write(large, share_of(ranks, 3));
  large.finish();
  ranks.wait_for_all();
  CHECK(steps_in(folder.path / "checkpoints") == std::vector<Index>{3});
}

TEST_CASE("what has to come before a checkpoint and fails keeps it from being complete") {
  const Communicator ranks;
  const TemporaryFolder folder;
  CheckpointWriter writer(
      {.folder = folder.path, .before_complete = [] { throw IoError("a frame is missing"); }},
      ranks);
  CHECK(error_of([&] {
          write(writer, share_of(ranks, 1));
          writer.finish();
        }) == "a frame is missing");
  CHECK(fs::is_empty(folder.path));
}

TEST_CASE("a damaged latest checkpoint is passed over by all ranks, a damaged file is an error") {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  const fs::path place = checkpoint_folder(folder.path);
  CheckpointWriter writer({.folder = place, .kept = 3}, ranks);
  for (const Index step : {10, 20}) write(writer, share_of(ranks, step));
  writer.finish();
  ranks.wait_for_all();
  const fs::path latest = place / checkpoint_name(20);
  if (ranks.rank() == 0) {  // the last byte is of one patch, which one rank reads
    std::string text = read_text_file(latest);
    text.back() = static_cast<char>(text.back() ^ 1);
    write_text_file(latest, text);
  }
  ranks.wait_for_all();
  std::vector<std::string> warnings;
  const auto warn = [&](const std::string& text) { warnings.push_back(text); };
  const auto reader = open_checkpoint("latest", folder.path, ranks, warn);
  CHECK(reader->header().run.step == 10);
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].find(checkpoint_name(20)) != std::string::npos);
  CHECK(error_of([&] { open_checkpoint(latest.string(), folder.path, ranks, warn); }) != "");
  ranks.wait_for_all();
  if (ranks.rank() == 0) fs::resize_file(place / checkpoint_name(10), 50);
  ranks.wait_for_all();
  CHECK_THROWS_WITH_AS(open_checkpoint("latest", folder.path, ranks, warn),
                       doctest::Contains("holds no checkpoint that is not damaged"), InputError);
  CHECK_THROWS_WITH_AS(open_checkpoint("latest", folder.path / "none", ranks, warn),
                       doctest::Contains("holds no checkpoint"), InputError);
  CHECK_THROWS_WITH_AS(open_checkpoint("none.h5", folder.path, ranks, warn),
                       doctest::Contains("there is no checkpoint none.h5"), InputError);
}
