/// \file Frames and folders that several tests use.
#pragma once

#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "io/frames/frame.h"

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

/// No file of this process may grow beyond some bytes: what a full disk looks like.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

/// Names in a folder, sorted.
std::vector<std::string> names_in(const std::filesystem::path& folder);

/// n particles with awkward numbers in every column (denormals, -0, all 17 digits).
Frame sample_frame(int dim, Index n);

/// Two plane-strain particles of a fluid with numbers that a person can read.
Frame two_particles();

/// Particles [first, first + n) of a frame.
Frame part_of(const Frame& frame, Index first, Index n);

/// True if both frames hold the same bits.
bool same_bits(const Frame& a, const Frame& b);

}  // namespace lahar::test
