/// \file What this program is.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace lahar {

/// "1.2.3 (commit abc1234)", compiler and flags, libraries.
std::string version_line();
std::string compiler_line();
std::vector<std::pair<std::string, std::string>> library_versions();

}  // namespace lahar
