/// \file A folder that all ranks of a test use.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "io/base/atomic_file.h"
#include "physics/base/error.h"
#include "runtime/comm/communicator.h"
#include "tests/io/frames/frame_samples.h"

namespace lahar::test {

/// Made and removed by rank 0, when no rank needs it any more.
class SharedFolder {
 public:
  explicit SharedFolder(const Communicator& ranks) : ranks_(ranks) {
    if (ranks.rank() == 0) folder_.emplace();
    std::string name = folder_ ? folder_->path.string() : "";
    ranks.broadcast(name);
    path = name;
  }
  SharedFolder(const SharedFolder&) = delete;
  SharedFolder& operator=(const SharedFolder&) = delete;
  ~SharedFolder() { ranks_.wait_for_all(); }
  std::filesystem::path path;

 private:
  Communicator ranks_;
  std::optional<TemporaryFolder> folder_;
};

/// Files of a folder by name.
inline std::map<std::string, std::string> contents_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const std::string& name : names_in(folder)) files[name] = read_text_file(folder / name);
  return files;
}

/// The message of the IoError that `action` throws; "" = none.
inline std::string error_of(const auto& action) {
  try {
    action();
  } catch (const IoError& error) {
    return error.what();
  }
  return "";
}

}  // namespace lahar::test
