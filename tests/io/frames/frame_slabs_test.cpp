// A frame file that several writers fill, each with its own particles.
#include "io/frames/frame_slabs.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <thread>

#include "io/base/atomic_file.h"
#include "io/frames/vtkhdf.h"
#include "physics/base/error.h"
#include "physics/materials/law.h"
#include "tests/io/frames/frame_samples.h"
#include "tests/physics/materials/material_samples.h"

namespace lahar {

using namespace test;

namespace {

/// Sizes of pieces that make up n particles, empty ones among them.
std::vector<Index> random_sizes(Index n, std::mt19937_64& random) {
  std::vector<Index> sizes{0};
  while (n > 0) {
    const Index most = random() % 2 == 0 ? 10 : 20000;
    sizes.push_back(std::min(n, static_cast<Index>(random() % static_cast<std::size_t>(most))));
    n -= sizes.back();
  }
  return sizes;
}

/// NaN is NaN.
bool same_numbers(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

}  // namespace

TEST_CASE("a frame in single precision has its numbers rounded, ids as they are, half the size") {
  const TemporaryFolder folder;
  const auto file = folder.path / "single.hdf";
  for (const int dim : {2, 3}) {
    const Frame frame = sample_frame(dim, 5000);
    FrameHeader header = header_of(frame);
    write_frame(frame, file);
    const auto bytes = std::filesystem::file_size(file);
    header.single = true;
    const FrameLayout layout = lay_out_frame(header, frame.size(), file, file);
    SlabFile(file, file).write(layout, 0, {&frame, 1});
    CHECK(std::filesystem::file_size(file) < 0.65 * static_cast<double>(bytes));
    const Frame back = read_frame(file);
    Frame sorted = frame;
    sort_by_id(sorted);
    CHECK(back.id == sorted.id);
    REQUIRE(back.columns.size() == sorted.columns.size());
    const auto rounded = [](std::vector<double> values) {
      for (double& value : values) value = static_cast<float>(value);
      return values;
    };
    CHECK(back.coordinates == rounded(sorted.coordinates));
    for (std::size_t k = 0; k < back.columns.size(); ++k)
      CHECK(same_numbers(back.columns[k].values, rounded(sorted.columns[k].values)));
  }
}

TEST_CASE("a frame in pieces, written by many threads in any order, is the file of the whole") {
  const TemporaryFolder folder;
  const auto whole = folder.path / "whole.hdf", pieces = folder.path / "pieces.hdf";
  std::mt19937_64 random(5);
  for (const int dim : {2, 3}) {
    const Frame frame = sample_frame(dim, 70000);
    write_frame(frame, whole);
    const FrameLayout layout = lay_out_frame(header_of(frame), frame.size(), pieces, pieces);
    {
      const SlabFile file(pieces, pieces);
      std::vector<std::thread> threads;
      Index first = 0;
      for (const Index n : random_sizes(frame.size(), random)) {
        threads.emplace_back([&, first, n] {
          const Frame two[] = {part_of(frame, first, n / 3),
                               part_of(frame, first + n / 3, n - n / 3)};
          file.write(layout, first, two);
        });
        first += n;
      }
      for (std::thread& thread : threads) thread.join();
      file.sync();
    }
    CHECK(read_text_file(pieces) == read_text_file(whole));
  }
}

TEST_CASE("a frame has room for the state variables of all laws at once") {
  const TemporaryFolder folder;
  const auto file = folder.path / "frame.hdf";
  Frame frame = sample_frame(2, 10);
  for (const Law& law : sample_laws())
    for (const StateVariable& variable : state_variables(law))
      if (!frame.find(std::string(variable.name)))
        frame.columns.push_back({std::string(variable.name), std::string(variable.unit), 1,
                                 std::vector<double>(10, 1.5)});
  CHECK(frame.columns.size() > 32);
  write_frame(frame, file);
  CHECK(read_frame(file).columns.size() == frame.columns.size());
}

TEST_CASE("particles in any order are read by ascending id") {
  const TemporaryFolder folder;
  const auto file = folder.path / "frame.hdf";
  std::mt19937_64 random(6);
  for (const int dim : {2, 3}) {
    const Frame frame = sample_frame(dim, 3000);
    std::vector<Index> order(static_cast<std::size_t>(frame.size()));
    std::iota(order.begin(), order.end(), Index{0});
    std::shuffle(order.begin(), order.end(), random);
    FramePieces shuffled{header_of(frame), {}};
    for (const Index i : order) shuffled.pieces.push_back(part_of(frame, i, 1));
    const FrameLayout layout = lay_out_frame(shuffled.header, frame.size(), file, file);
    SlabFile(file, file).write(layout, 0, shuffled.pieces);
    CHECK(same_bits(read_frame(file), frame));
    CHECK(same_bits(join(shuffled), frame));
  }
}

TEST_CASE("a slab beyond the end or with other columns is a mistake of ours") {
  const TemporaryFolder folder;
  const auto file = folder.path / "frame.hdf";
  const Frame frame = sample_frame(3, 10);
  const FrameLayout layout = lay_out_frame(header_of(frame), 12, file, file);
  const SlabFile slabs(file, file);
  CHECK_THROWS_WITH_AS(slabs.write(layout, 3, {&frame, 1}), "frame: particles 3 to 13 of 12",
                       std::logic_error);
  for (const bool fewer : {false, true}) {
    Frame other = fewer ? frame : sample_frame(2, 10);
    if (fewer) other.columns.pop_back();
    CHECK_THROWS_WITH_AS(slabs.write(layout, 0, {&other, 1}),
                         "frame: a piece has other columns than the frame", std::logic_error);
  }
}

}  // namespace lahar
