// Frames that all ranks write together.
#include "runtime/output/frame_output.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "io/frames/vtkhdf.h"
#include "io/run/run_folder.h"
#include "physics/base/error.h"
#include "runtime/comm/communicator.h"
#include "tests/ranks/shared_folder.h"

using namespace lahar;
using namespace lahar::test;
namespace fs = std::filesystem;

namespace {

constexpr Index n_particles = 5000;

/// What all ranks together have at a step.
Frame whole(int dim, Index step) {
  Frame frame = sample_frame(dim, n_particles);
  frame.step = step;
  frame.time = 0.5 * static_cast<double>(step);
  frame.coordinates[0] = static_cast<double>(step);
  return frame;
}

/// The pieces of this rank: parts of very different sizes; the first rank has none where there are
/// several, so that rank 0 lays a file out without particles of its own.
FramePieces pieces_of(const Frame& frame, const Communicator& ranks) {
  FramePieces own{header_of(frame), {}};
  const int owners = ranks.several() ? ranks.size() - 1 : 1;
  const int place = ranks.several() ? ranks.rank() - 1 : 0;
  if (place < 0) return own;
  const Index first = place * frame.size() / owners, end = (place + 1) * frame.size() / owners;
  for (Index at = first, n = 0; at < end; at += n, n = 3 * n + 1)
    own.pieces.push_back(part_of(frame, at, n = std::min(n, end - at)));
  return own;
}

/// The same, not copied before it is written.
FrameSource source_of(const FramePieces& pieces) {
  FrameSource source;
  source.header = pieces.header;
  for (const Frame& piece : pieces.pieces) source.sizes.push_back(piece.size());
  source.piece = [&pieces](std::size_t i) { return pieces.pieces[i]; };
  source.threads = 2;
  return source;
}

}  // namespace

TEST_CASE(
    "ranks write the file that one rank writes, whether they copy a frame or not, and few do") {
  const Communicator ranks = Communicator::world();
  for (const auto& [dim, writers] : {std::pair{2, 0}, {3, 0}, {2, 1}, {3, 1}, {3, 2}, {3, 3}}) {
    CAPTURE(dim);
    CAPTURE(writers);
    const SharedFolder folder(ranks), alone(ranks);
    FrameOutput output(folder.path, ranks, {}, writers);
    for (const Index step : {0, 1, 2, 3, 4, 5}) {
      const Frame frame = whole(dim, step);
      FramePieces own = pieces_of(frame, ranks);
      if (step % 3 == 1)
        output.write(source_of(own));
      else
        output.add(std::move(own));
      output.progress();
      if (ranks.rank() == 0) write_frame(frame, alone.path / frame_name(step, ".hdf"));
    }
    output.finish();
    if (ranks.rank() != 0) continue;
    for (const Index step : {0, 1, 2, 3, 4, 5}) {
      CAPTURE(step);
      const std::string name = frame_name(step, ".hdf");
      CHECK(read_text_file(folder.path / name) == read_text_file(alone.path / name));
      CHECK(same_bits(read_frame(folder.path / name), whole(dim, step)));
    }
    CHECK(names_in(folder.path).size() == 7);  // and the index
  }
}

TEST_CASE("writers are the first of as many even groups of consecutive ranks") {
  for (const int ranks : {1, 2, 3, 7, 64, 1000})
    for (const int writers : {1, 2, 3, 5, 63}) {
      CAPTURE(ranks);
      CAPTURE(writers);
      std::map<int, int> written_for;
      for (int r = 0, last = 0; r < ranks; ++r) {
        const int writer = OutputRelay::writer_of(r, ranks, writers);
        CHECK(writer >= last);
        CHECK(writer <= r);
        CHECK(OutputRelay::writer_of(writer, ranks, writers) == writer);
        ++written_for[last = writer];
      }
      const int groups = std::min(ranks, writers);
      CHECK(static_cast<int>(written_for.size()) == groups);
      for (const auto& [writer, n] : written_for) {
        CHECK(n >= ranks / groups);
        CHECK(n <= (ranks + groups - 1) / groups);
      }
    }
  CHECK(OutputRelay::writer_of(5, 8, 0) == 5);
  CHECK(OutputRelay::writer_of(5, 8, 8) == 5);
}

TEST_CASE("frames that are more than blocks that wait may hold come to the one that writes them") {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks), alone(ranks);
  // For each rank: more than all blocks that sender and writer hold together.
  const Index n = ranks.size() * Index{100'000};
  Frame frame = sample_frame(3, n);
  FrameOutput output(folder.path, ranks, {}, 1);
  for (const Index step : {0, 1}) {
    frame.step = step;
    const Index first = ranks.rank() * (n / ranks.size());
    FramePieces own{header_of(frame), {part_of(frame, first, n / ranks.size())}};
    if (step == 1)
      output.write(source_of(own));
    else
      output.add(std::move(own));
  }
  output.finish();
  if (ranks.rank() == 0)
    for (const Index step : {0, 1}) {
      frame.step = step;
      CHECK(same_bits(read_frame(folder.path / frame_name(step, ".hdf")), frame));
    }
}

TEST_CASE("a frame without any particle is written") {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  FrameOutput output(folder.path, ranks);
  const Frame nothing = sample_frame(3, 0);
  output.add({header_of(nothing), {}});
  output.finish();
  if (ranks.rank() == 0)
    CHECK(read_frame(folder.path / frame_name(nothing.step, ".hdf")).size() == 0);
}

TEST_CASE("ranks that wait for others do what they are told to do meanwhile") {
  const Communicator ranks = Communicator::world();
  const SharedFolder folder(ranks);
  FrameOutput output(folder.path, ranks);
  int polls = 0;
  output.while_waiting([&] {
    ++polls;
    output.progress();
  });
  for (const Index step : {0, 1, 2, 3, 4}) output.add(pieces_of(whole(3, step), ranks));
  output.finish();
  CHECK((polls > 0) == ranks.several());
}

TEST_CASE("a disk that is full for one rank is an error on all, and finished frames stay") {
  const Communicator ranks = Communicator::world();
  const int last = ranks.size() - 1;
  for (const auto& [full, writers] : {std::pair{0, 0}, {last, 0}, {0, 1}})
    for (const bool copied : {true, false}) {
      CAPTURE(full);
      CAPTURE(writers);
      CAPTURE(copied);
      const SharedFolder folder(ranks);
      FrameOutput output(folder.path, ranks);
      output.add(pieces_of(whole(3, 1), ranks));
      output.finish();
      FrameOutput failing(folder.path, ranks, {}, writers);
      const auto write_many = [&] {
        for (const Index step : {2, 3, 4, 5, 6, 7}) {
          FramePieces own = pieces_of(whole(3, step), ranks);
          if (copied)
            failing.add(std::move(own));
          else
            failing.write(source_of(own));
        }
        failing.finish();
      };
      std::string error;
      {
        std::optional<SmallDisk> disk;
        if (ranks.rank() == full) disk.emplace(20'000);
        error = error_of(write_many);
        CHECK(error == error_of([&] { failing.finish(); }));
      }
      const std::string file = (folder.path / frame_name(2, ".hdf")).string();
      const std::string who = ranks.several() ? "rank " + std::to_string(full) + ": " : "";
      CHECK(error == who + "cannot write " + file + ": File too large");
      ranks.wait_for_all();
      if (ranks.rank() != 0) continue;
      CHECK(names_in(folder.path) ==
            std::vector<std::string>{"particles.hdf.series", frame_name(1, ".hdf")});
      CHECK(same_bits(read_frame(folder.path / frame_name(1, ".hdf")), whole(3, 1)));
    }
}
