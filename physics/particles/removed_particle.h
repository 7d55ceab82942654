/// \file A particle that left the mesh and was removed.
#pragma once

#include <array>

#include "physics/base/types.h"

namespace lahar {

/// Its last state. Written as it lies in memory from rank to rank.
struct RemovedParticle {
  Index step = 0;  ///< updates done when it was outside
  Index id = -1;
  double mass = 0;                   ///< [kg] without the liquid in its pores
  double liquid_mass = 0;            ///< [kg]
  std::array<double, 3> position{};  ///< [m] outside the mesh
  std::array<double, 3> velocity{};  ///< [m/s]
  Index material = -1;               ///< index into the model's materials
};

}  // namespace lahar
