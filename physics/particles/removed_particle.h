/// \file A particle that left the mesh, or went as a stage said, and was removed.
#pragma once

#include <array>

#include "physics/base/types.h"

namespace lahar {

/// Its last state. Written as it lies in memory from rank to rank.
struct RemovedParticle {
  Index step = 0;  ///< updates done when it was outside
  Index id = -1;
  double mass = 0;  ///< [kg] without the liquid in its pores; of one that was going, the whole one
  double liquid_mass = 0;            ///< [kg]
  std::array<double, 3> position{};  ///< [m] outside the mesh
  std::array<double, 3> velocity{};  ///< [m/s]
  Index material = -1;               ///< index into the model's materials
  bool as_planned = false;           ///< a stage removed it (removal_in_time.h)
};

}  // namespace lahar
