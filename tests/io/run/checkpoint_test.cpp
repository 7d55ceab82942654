#include "io/run/checkpoint.h"

#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "io/base/atomic_file.h"
#include "io/base/shared_file.h"
#include "io/frames/vtkhdf.h"
#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"

namespace lahar {

using namespace test;
namespace fs = std::filesystem;

namespace {

CheckpointHeader sample_header() {
  return {.version = "1.2.3",
          .commit = "abc",
          .compiler = "a compiler",
          .run = {.dim = 2,
                  .step = 300,
                  .time = 0.1 + 0.2,
                  .dt = 1e-3 / 3,
                  .dt_limit = std::numeric_limits<double>::infinity(),
                  .particles = 5,
                  .removed = 1,
                  .history_steps = 7,
                  .work = {1.0 / 3, -2e-300, 0},
                  .kinetic_at_start = 4.0,
                  .cells_per_patch = 28,
                  .least_mass = 1e-15,
                  .columns = "coordinates 2"},
          .scenario = "{\"title\": \"\xc3\xa9 \\\" \"}",
          .side_files = {{"mesh.txt", "12ab"}}};
}

std::vector<std::byte> bytes_of(std::size_t n, int seed) {
  std::vector<std::byte> bytes(n);
  for (std::size_t i = 0; i < n; ++i)
    bytes[i] = static_cast<std::byte>(static_cast<int>(i) * 7 + seed);
  return bytes;
}

/// Writes a checkpoint of three patches; they may come in any order.
fs::path write_sample(const fs::path& file, const CheckpointHeader& header = sample_header()) {
  std::vector<CheckpointPatch> patches;
  for (const int id : {9, 2, 5}) {
    const auto bytes = bytes_of(static_cast<std::size_t>(1000 * id), id);
    patches.push_back({id, 0, static_cast<Index>(bytes.size()), checksum(bytes)});
  }
  CHECK(lay_out(patches) == 16000);
  make_folder(file.parent_path());
  const Index data = create_checkpoint(file, file, header, patches);
  SharedFile slabs(file, file);
  for (auto patch = patches.rbegin(); patch != patches.rend(); ++patch)
    slabs.write(data + patch->offset,
                bytes_of(static_cast<std::size_t>(patch->bytes), static_cast<int>(patch->id)));
  slabs.sync();
  return file;
}

void set_byte(const fs::path& file, std::size_t at, char value) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(static_cast<std::streamoff>(at));
  stream.put(value);
}

/// Read everything; why that fails, "" if it does not.
std::string problem(const fs::path& file) {
  try {
    CheckpointReader(file).verify();
  } catch (const IoError& error) {
    CHECK(std::string(error.what()).find(file.string()) != std::string::npos);
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a checkpoint gives back every bit, patches in ascending order") {
  const TemporaryFolder folder;
  const fs::path file = write_sample(folder.path / checkpoint_name(300));
  const CheckpointReader reader(file);
  CHECK(header_text(reader.header()) == header_text(sample_header()));
  const RunState &run = reader.header().run, expected = sample_header().run;
  CHECK(run.time == expected.time);
  CHECK(run.dt == expected.dt);
  CHECK(run.dt_limit == expected.dt_limit);
  CHECK(run.work == expected.work);
  CHECK(reader.header().scenario == sample_header().scenario);
  REQUIRE(reader.patches().size() == 3);
  Index last = -1;
  for (std::size_t i = 0; i < 3; ++i) {
    const CheckpointPatch& patch = reader.patches()[i];
    CHECK(patch.id > last);
    last = patch.id;
    CHECK(reader.patch(i) ==
          bytes_of(static_cast<std::size_t>(patch.bytes), static_cast<int>(patch.id)));
  }
}

TEST_CASE("numbers of a run that came to nothing finite are given back") {
  CheckpointHeader header = sample_header();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  header.run.work.internal = infinity;
  header.run.work.external = -infinity;
  header.run.work.damping = std::numeric_limits<double>::quiet_NaN();
  header.run.kinetic_at_start = -std::numeric_limits<double>::quiet_NaN();
  header.run.watchdog.put_in = infinity;
  const CheckpointHeader read = read_header(header_text(header));
  CHECK(header_text(read) == header_text(header));
  CHECK(read.run.work.external == -infinity);
  CHECK(std::isnan(read.run.work.damping));
}

TEST_CASE("a header that counts what cannot be is refused") {
  const std::string good = header_text(sample_header());
  const auto refusal = [&](const std::string& key, const std::string& value) {
    const std::size_t at = good.find('"' + key + "\":");
    REQUIRE(at != std::string::npos);
    std::string text = good;
    const std::size_t begin = at + key.size() + 3;
    text.replace(begin, text.find_first_of(",\n", begin) - begin, value);
    try {
      read_header(text);
      return std::string("read");
    } catch (const IoError& error) {
      return std::string(error.what());
    }
  };
  CHECK(refusal("step", "-3") == "its 'step' cannot be -3");
  CHECK(refusal("cells_per_patch", "1.5") == "its 'cells_per_patch' cannot be 1.5");
  CHECK(refusal("particles", "9223372036854775807") ==
        "its 'particles' cannot be 9223372036854775807");
  CHECK(refusal("internal", "\"many\"").starts_with("its header is not one of a checkpoint"));
  CHECK(refusal("kind", "77") == "its watchdog has an alarm of an unknown kind");
  CHECK(refusal("step", "3") == "read");
}

TEST_CASE("equal states give equal checkpoint files") {
  const TemporaryFolder folder;
  const std::string a = read_text_file(write_sample(folder.path / "a.h5"));
  const std::string b = read_text_file(write_sample(folder.path / "b.h5"));
  CHECK(a == b);
}

TEST_CASE("a checkpoint without patches is one") {
  const TemporaryFolder folder;
  const fs::path file = folder.path / "empty.h5";
  create_checkpoint(file, file, sample_header(), {});
  const CheckpointReader reader(file);
  CHECK(reader.patches().empty());
  CHECK(problem(file) == "");
}

TEST_CASE("a damaged checkpoint is found out, whichever byte is") {
  const TemporaryFolder folder;
  const fs::path good = write_sample(folder.path / "good.h5");
  const std::string text = read_text_file(good);
  const auto place = [&](const std::string& part) {
    const std::size_t at = text.find(part);
    REQUIRE(at != std::string::npos);
    return at;
  };
  const auto with_byte = [&](std::size_t at) {
    const fs::path file = folder.path / "bad.h5";
    fs::copy_file(good, file, fs::copy_options::overwrite_existing);
    set_byte(file, at, static_cast<char>(text[at] ^ 0x10));
    return problem(file);
  };
  const std::string table(reinterpret_cast<const char*>(CheckpointReader(good).patches().data()),
                          sizeof(CheckpointPatch));
  CHECK(contains(with_byte(text.size() - 5), "state of patch 9 does not match its checksum"));
  CHECK(contains(with_byte(place("kinetic_at_start")), "its header does not match its checksum"));
  CHECK(contains(with_byte(place(table)), "its table of patches does not match its checksum"));
  CHECK(contains(with_byte(0), "not an HDF5 file"));
  // Anywhere: it is refused, or was padding that nobody reads. Never are other values read.
  Index refused = 0, tried = 0;
  for (std::size_t at = 0; at < text.size(); at += 37, ++tried) refused += !with_byte(at).empty();
  CHECK(refused > tried * 9 / 10);

  const fs::path cut = folder.path / "cut.h5";
  for (const std::size_t size : {text.size() - 1, text.size() / 2, std::size_t{100}}) {
    fs::copy_file(good, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, size);
    CHECK(contains(problem(cut), "truncated"));
  }
  fs::resize_file(cut, 0);
  CHECK(contains(problem(cut), "not an HDF5 file"));
  CHECK(contains(problem(folder.path / "none.h5"), "No such file"));
}

TEST_CASE("other HDF5 files and other formats are no checkpoints") {
  const TemporaryFolder folder;
  write_frame(two_particles(), folder.path / "frame.hdf");
  CHECK(contains(problem(folder.path / "frame.hdf"), "it is not a checkpoint of Lahar"));
  std::string text = header_text(sample_header());
  const std::string now = "\"lahar_checkpoint\": 4";
  REQUIRE(contains(text, now));
  text.replace(text.find(now), now.size(), "\"lahar_checkpoint\": 77");
  CHECK_THROWS_WITH_AS(read_header(text),
                       doctest::Contains("it has format 77, this version of Lahar reads format 4"),
                       IoError);
  CHECK_THROWS_WITH_AS(read_header("{}"), doctest::Contains("its header is not one"), IoError);
}

TEST_CASE("the latest checkpoints are kept") {
  const TemporaryFolder folder;
  const fs::path place = checkpoint_folder(folder.path);
  CHECK(checkpoints_in(place).empty());
  make_folder(place);
  for (const Index step : std::vector<Index>{5, 100, 20, 1'000'000'000'000})
    write_text_file(place / checkpoint_name(step), "");
  write_text_file(place / "notes.txt", "a user's");
  write_text_file(place / "checkpoint_old.h5", "a user's");
  const auto steps = [&] {
    std::vector<Index> all;
    for (const CheckpointFile& file : checkpoints_in(place)) all.push_back(file.step);
    return all;
  };
  CHECK(steps() == std::vector<Index>{5, 20, 100, 1'000'000'000'000});
  prune_checkpoints(place, 3);
  CHECK(steps() == std::vector<Index>{20, 100, 1'000'000'000'000});
  prune_checkpoints(place, 7);
  CHECK(steps().size() == 3);
  remove_checkpoints_after(place, 100);
  CHECK(steps() == std::vector<Index>{20, 100});
  CHECK(fs::exists(place / "notes.txt"));
  CHECK(fs::exists(place / "checkpoint_old.h5"));
}

}  // namespace lahar
