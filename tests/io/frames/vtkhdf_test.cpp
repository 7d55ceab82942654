#include "io/frames/vtkhdf.h"

#include <doctest/doctest.h>

#include <limits>

#include "io/base/atomic_file.h"
#include "physics/base/error.h"
#include "physics/particles/columns.h"
#include "tests/io/frames/frame_samples.h"

namespace lahar {

using namespace test;

TEST_CASE("a frame read back has the same bits as the one written") {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path / "frame.hdf";
  for (const int dim : {2, 3})
    // none, one, and more than one buffer of the writer
    for (const Index n : {0, 1, 140000}) {
      CAPTURE(dim);
      CAPTURE(n);
      Frame frame = sample_frame(dim, n);
      write_frame(frame, file);
      CHECK(same_bits(read_frame(file), frame));
    }
}

TEST_CASE("NaN and infinity survive in a frame, so that a failed run can be looked at") {
  const TemporaryFolder folder;
  Frame frame = sample_frame(3, 2);
  frame.time = std::numeric_limits<double>::infinity();
  frame.coordinates[4] = std::numeric_limits<double>::quiet_NaN();
  write_frame(frame, folder.path / "frame.hdf");
  CHECK(same_bits(read_frame(folder.path / "frame.hdf"), frame));
}

TEST_CASE("columns of any number of components that particles have are read back") {
  const TemporaryFolder folder;
  Frame frame = two_particles();
  for (const ColumnInfo& info : column_table)
    if (const int n = info.components_3d; n > 0 && info.exported && !frame.find(info.name))
      frame.columns.push_back(
          {info.name, info.unit, n, std::vector<double>(2 * static_cast<std::size_t>(n), 0.5)});
  write_frame(frame, folder.path / "a.hdf");
  CHECK(read_frame(folder.path / "a.hdf").columns.size() == frame.columns.size());
}

TEST_CASE("a frame without material ids is read back without them") {
  const TemporaryFolder folder;
  Frame frame = sample_frame(2, 5);
  frame.material.clear();
  write_frame(frame, folder.path / "frame.hdf");
  CHECK(same_bits(read_frame(folder.path / "frame.hdf"), frame));
}

TEST_CASE("the same state gives the same file, byte by byte") {
  const TemporaryFolder folder;
  write_frame(sample_frame(3, 1000), folder.path / "a.hdf");
  write_frame(sample_frame(3, 1000), folder.path / "b.hdf");
  CHECK(read_text_file(folder.path / "a.hdf") == read_text_file(folder.path / "b.hdf"));
}

TEST_CASE("writing a frame leaves no temporary file") {
  const TemporaryFolder folder;
  write_frame(sample_frame(2, 3), folder.path / "frame.hdf");
  CHECK(names_in(folder.path) == std::vector<std::string>{"frame.hdf"});
}

TEST_CASE("a full disk is an error that names the file and the reason, and leaves nothing behind") {
  const TemporaryFolder folder;
  const std::string file = (folder.path / "frame.hdf").string();
  for (const rlim_t bytes : {1000, 10'000, 3'000'000, 6'000'000}) {
    CAPTURE(bytes);
    const Frame frame = sample_frame(3, 60000);
    const SmallDisk disk(bytes);
    CHECK_THROWS_WITH_AS(write_frame(frame, file),
                         ("cannot write " + file + ": File too large").c_str(), IoError);
  }
  CHECK(names_in(folder.path).empty());
  write_frame(sample_frame(2, 3), file);  // and HDF5 works on
  CHECK(read_frame(file).size() == 3);
}

TEST_CASE("a frame that cannot be written keeps the older one") {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path / "frame.hdf";
  write_frame(sample_frame(2, 3), file);
  {
    const Frame large = sample_frame(3, 60000);
    const SmallDisk disk(100'000);
    CHECK_THROWS_AS(write_frame(large, file), IoError);
  }
  CHECK(same_bits(read_frame(file), sample_frame(2, 3)));
}

TEST_CASE("a frame in a place that is no folder is an error with the system's reason") {
  const TemporaryFolder folder;
  write_text_file(folder.path / "file", "x");
  const std::string below = (folder.path / "file" / "frame.hdf").string();
  CHECK_THROWS_WITH_AS(write_frame(sample_frame(2, 1), below),
                       ("cannot write " + below + ": Not a directory").c_str(), IoError);
  const std::string nowhere = (folder.path / "none" / "frame.hdf").string();
  CHECK_THROWS_WITH_AS(write_frame(sample_frame(2, 1), nowhere),
                       ("cannot write " + nowhere + ": No such file or directory").c_str(),
                       IoError);
}

TEST_CASE("files that are no frames are refused with the reason") {
  const TemporaryFolder folder;
  const std::string file = (folder.path / "frame.hdf").string();
  CHECK_THROWS_WITH_AS(read_frame(file),
                       ("cannot read " + file + ": No such file or directory").c_str(), IoError);
  write_text_file(file, "this is a text");
  CHECK_THROWS_WITH_AS(read_frame(file), ("cannot read " + file + ": not an HDF5 file").c_str(),
                       IoError);
  write_frame(sample_frame(2, 1000), file);
  const std::string bytes = read_text_file(file);
  write_text_file(file, bytes.substr(0, bytes.size() / 2));
  CHECK_THROWS_WITH_AS(read_frame(file),
                       ("cannot read " + file + ": the file is truncated").c_str(), IoError);
}

TEST_CASE("a frame whose columns have the wrong length is a mistake of ours and is not written") {
  const TemporaryFolder folder;
  Frame frame = sample_frame(2, 3);
  frame.columns[1].values.pop_back();
  CHECK_THROWS_WITH_AS(write_frame(frame, folder.path / "frame.hdf"),
                       "frame: displacement has 5 values instead of 6", std::logic_error);
  CHECK(names_in(folder.path).empty());
}

}  // namespace lahar
