/// \file The stages of a scenario as models.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "io/scenario/scenario.h"
#include "io/scenario/stages.h"

namespace lahar::test {

template <int Dim>
struct StageModel {
  Model<Dim> model;
  bool alike = false;  ///< it does to the particles what the stage before did
};

/// All stages of a scenario; one where it has no stages. Throws InputError as `lahar run` does.
template <int Dim>
std::vector<StageModel<Dim>> read_stages(const std::filesystem::path& file,
                                         const Team* team = nullptr) {
  std::vector<StageModel<Dim>> all;
  StageBody body;
  std::string before;
  for (std::size_t k = 0, n = 1; k < n; ++k) {
    ScenarioOptions options;
    options.team = team;
    options.stage = k;
    Scenario scenario = read_scenario(file, options);
    if (k == 0) {
      n = std::max<std::size_t>(1, scenario.stages.size());
    } else {
      check_body(body, scenario);
    }
    body = body_of(scenario);
    const bool alike = k > 0 && goes_on_alike(before, scenario.full);
    before = scenario.full;
    all.push_back({std::get<Model<Dim>>(std::move(scenario.model)), alike});
  }
  return all;
}

}  // namespace lahar::test
