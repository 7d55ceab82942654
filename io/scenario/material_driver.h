/// \file The input of `lahar material`: one particle and the path that it is led along.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/scenario/scenario.h"
#include "physics/model/model.h"

namespace lahar {

/// A part of the path, done in equal steps unless the increments are given one by one.
struct PathSegment {
  Index steps = 0;
  double time = 1;  ///< [s] of the whole segment
  /// By Voigt component: true: `change` is of the stress [Pa], false: of the strain [-].
  std::array<bool, 6> stress_controlled{};
  Voigt change{};                 ///< over the whole segment; engineering shear
  std::vector<Voigt> increments;  ///< of the strain, one per step; empty = equal parts of `change`
};

struct MaterialDriver {
  std::string title;
  Material material;
  Voigt stress{};  ///< [Pa] initial
  std::vector<PathSegment> path;
  std::vector<Problem> warnings;
};

/// Throws InputError with every problem of the file.
MaterialDriver read_material_driver(const std::filesystem::path& file,
                                    const ScenarioOptions& options = {});
MaterialDriver read_material_driver_text(const std::string& text,
                                         const std::filesystem::path& folder,
                                         const ScenarioOptions& options = {});

}  // namespace lahar
