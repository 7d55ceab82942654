/// \file What CONTRIBUTING.md shows as code is code that tests compile.
#pragma once

#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace lahar::test {

/// Checks that CONTRIBUTING.md has all lines of a file, indented by four spaces.
inline void check_that_contributing_has(const char* file) {
  const std::filesystem::path root = LAHAR_SOURCE_DIR;
  std::ostringstream text;
  text << std::ifstream(root / "CONTRIBUTING.md").rdbuf();
  std::ifstream lines(root / file);
  std::string indented;
  for (std::string line; std::getline(lines, line);)
    indented += line.empty() ? "\n" : "    " + line + "\n";
  CHECK(indented.size() > 1000);
  CHECK(text.str().find(indented) != std::string::npos);
}

}  // namespace lahar::test
