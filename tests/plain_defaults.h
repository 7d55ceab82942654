/// \file Scenarios of tests whose keys that are not written mean the plainest method: USF,
/// functions of the elements, FLIP alone, half of the stable step. The program's
/// defaults may then change. Contact needs MUSL.
#pragma once

#include <string>
#include <utility>

#include "io/scenario/scenario.h"

namespace lahar::test {

inline ScenarioOptions plain_defaults(const std::string& text, ScenarioOptions options = {}) {
  const bool contact = text.find("\"interface\": true") != std::string::npos;
  for (const auto& [key, value] :
       {std::pair("mpm_scheme", contact ? "musl" : "usf"), std::pair("shape_functions", "element"),
        std::pair("velocity_update", "flip"), std::pair("safety", "0.5")}) {
    if (text.find('"' + std::string(key)) != std::string::npos) continue;
    if (std::string(key) == "shape_functions" &&
        (text.find("P2B\"") != std::string::npos || text.find("16G\"") != std::string::npos))
      continue;
    const std::string path = std::string(key) == "safety" ? "time_step.safety" : key;
    options.overrides.push_back("analysis." + path + "=" + value);
  }
  return options;
}

}  // namespace lahar::test
