/// \file The side files of a bundle, as files while an input is tried.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/fuzz/targets.h"

namespace lahar::fuzz {

/// A name in the folder of the case, wherever it wants to lead.
inline std::filesystem::path place_of(const std::filesystem::path& folder,
                                      const std::string& name) {
  std::filesystem::path place = folder;
  for (const std::filesystem::path& part : std::filesystem::path(name).relative_path())
    if (part != ".." && part != "." && !part.empty()) place /= part;
  return place;
}

/// Writes the side files of a bundle; they go with it.
class CaseFolder {
 public:
  explicit CaseFolder(const std::vector<BundledFile>& files) : folder_(work_folder() / "case") {
    for (std::size_t k = 1; k < files.size(); ++k) {
      const std::filesystem::path file = place_of(folder_, files[k].name);
      std::error_code error;
      std::filesystem::create_directories(file.parent_path(), error);
      if (!error) write(file, files[k].text);
      written_ = true;
    }
  }
  ~CaseFolder() {
    std::error_code error;
    if (written_) std::filesystem::remove_all(folder_, error);
  }
  CaseFolder(const CaseFolder&) = delete;
  CaseFolder& operator=(const CaseFolder&) = delete;
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
  bool written_ = false;
};

}  // namespace lahar::fuzz
