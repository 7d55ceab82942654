/// \file Frames and folders that several tests use.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "io/frame.h"

namespace lahar::test {

/// A folder that disappears with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "lahar-test-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

/// Names in a folder, sorted.
std::vector<std::string> names_in(const std::filesystem::path& folder);

/// n particles with awkward numbers in every column (denormals, -0, all 17 digits).
Frame sample_frame(int dim, Index n);

/// Two plane-strain particles of a fluid with numbers that a person can read.
Frame two_particles();

/// True if both frames hold the same bits.
bool same_bits(const Frame& a, const Frame& b);

}  // namespace lahar::test
