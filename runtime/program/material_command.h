/// \file `lahar material`: one material point along a path of strains, stresses or both.
#pragma once

#include <string>
#include <vector>

#include "io/scenario/material_driver.h"

namespace lahar {

/// A state on the path.
struct PathPoint {
  double time = 0;  ///< [s]
  Voigt strain{}, stress{};
  std::vector<double> state;
};

/// All states, the initial one first. Throws SimulationError where the law finds no stress that it
/// allows, or a stress cannot be reached: `points` then has those before. `divided` counts
/// increments that were done in parts.
void follow_path(const MaterialDriver& driver, std::vector<PathPoint>& points, Index& divided);

/// Columns step, time, strain_xx ..., stress_xx ..., p, q and the state variables.
std::string path_table(const MaterialDriver& driver, const std::vector<PathPoint>& points);

/// q and volumetric strain against the strain that changes most, and the path in p and q.
std::string path_picture(const MaterialDriver& driver, const std::vector<PathPoint>& points);

}  // namespace lahar
