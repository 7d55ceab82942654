/// \file Examples of CONTRIBUTING.md, which tests compile.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace lahar::test {

/// Whether CONTRIBUTING.md has the lines of a file of the project, as a block of code.
inline bool contributing_has(const char* file) {
  const auto text_of = [](const char* name) {
    std::ostringstream text;
    text << std::ifstream(std::filesystem::path(LAHAR_SOURCE_DIR) / name).rdbuf();
    return text.str();
  };
  std::istringstream lines(text_of(file));
  std::string block = "\n\n";
  for (std::string line; std::getline(lines, line);)
    block += line.empty() ? "\n" : "    " + line + "\n";
  return block.size() > 40 &&
         (text_of("CONTRIBUTING.md") + "\n").find(block + "\n") != std::string::npos;
}

}  // namespace lahar::test
