#include "io/base/atomic_file.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "physics/base/error.h"
#include "tests/io/frames/frame_samples.h"

namespace fs = std::filesystem;
using namespace lahar;

TEST_CASE("a file that is not committed leaves nothing, and one that is replaces what was there") {
  const test::TemporaryFolder folder;
  const fs::path target = folder.path / "whole.txt";
  for (const bool commits : {false, true}) {
    AtomicFile file(target);
    std::ofstream(file.temporary()) << "whole";
    CHECK(!fs::exists(target));
    if (commits) file.commit();
  }
  CHECK(fs::exists(target));
  CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()) == 1);
}

TEST_CASE("a file that cannot get its name asks its caller for the reason") {
  const test::TemporaryFolder folder;
  AtomicFile file(folder.path / "whole.txt");
  std::ofstream(file.temporary()) << "whole";
  int asked = 0;
  const auto check = [&] {
    // The folder is emptied when it has been found in its place.
    if (++asked == 1) fs::remove(file.temporary());
    if (asked == 2) throw IoError("the folder was emptied");
  };
  CHECK_THROWS_WITH_AS(file.commit(check), "the folder was emptied", IoError);
  CHECK_THROWS_WITH_AS(file.commit(), doctest::Contains("cannot write "), IoError);
}

TEST_CASE("a device is not read as a text: it may never end") {
  for (const char* device : {"/dev/zero", "/dev/null"})
    CHECK_THROWS_WITH_AS(
        read_text_file(device),
        (std::string("cannot read ") + device + ": it is not a regular file").c_str(), IoError);
}
