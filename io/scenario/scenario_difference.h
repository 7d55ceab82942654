/// \file In what a scenario differs from the one that a checkpoint was made with.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "io/run/checkpoint_header.h"

namespace lahar {

/// A value that is not the same in two scenarios.
struct ScenarioDifference {
  std::string where;   ///< JSON pointer, or the name of a side file
  std::string before;  ///< as JSON; "not given" where there is none
  std::string now;
  bool allowed = false;  ///< a run may continue with it
};

/// Keys in which a scenario may differ from that of the checkpoint it continues from, as JSON
/// pointers: they decide when the run ends, and what is written where. A pointer stands for all
/// that is below it.
std::span<const char* const> allowed_differences();

/// Differences of two scenarios with every default filled in (Scenario::full), as JSON values.
/// Throws IoError where the one before is no JSON.
std::vector<ScenarioDifference> differences(const std::string& before, const std::string& now);

/// Differences of the contents of side files, in the order in which the scenarios name them.
std::vector<ScenarioDifference> differences(const std::vector<SideFileHash>& before,
                                            const std::vector<SideFileHash>& now);

}  // namespace lahar
