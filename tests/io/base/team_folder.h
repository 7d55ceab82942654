// Files that a team reads.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace lahar {

// A folder of this process for as long as the object lives; one at a time.
class Folder {
 public:
  Folder()
      : path(std::filesystem::temp_directory_path() / fmt::format("lahar-shares-{}", ::getpid())) {
    std::filesystem::remove_all(path);
    std::filesystem::create_directories(path);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  void write(const std::string& file, const std::string& text) const {
    std::ofstream(path / file, std::ios::binary) << text;
  }
  const std::filesystem::path path;
};

}  // namespace lahar
