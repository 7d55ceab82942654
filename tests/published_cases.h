/// \file The published cases beside the repository, which tests skip where they are absent.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace lahar::test {

/// Folders of the published cases of which Lahar solves the equations, by name; others are left out
/// with a message, all of them where there is none.
inline std::vector<std::filesystem::path> published_cases() {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(LAHAR_SOURCE_DIR).parent_path() / "shared" / "cases";
  std::vector<fs::path> found;
  const auto entries =
      fs::exists(folder) ? fs::directory_iterator(folder) : fs::directory_iterator();
  for (const auto& entry : entries) {
    if (!entry.is_directory()) continue;
    std::ostringstream text;
    text << std::ifstream(entry.path() / "case.json").rdbuf();
    const bool solved = text.str().find("\"MPMExplicit") != std::string::npos ||
                        text.str().find("\"MPMImplicit") != std::string::npos;
    if (solved)
      found.push_back(entry.path());
    else
      MESSAGE(
          "equations that Lahar does not solve yet, skipped: " << entry.path().filename().string());
  }
  if (found.empty()) MESSAGE("no published cases beside the repository: skipped");
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace lahar::test
