/// \file How far and how long a body may move before it has failed: of trials of strength.
#pragma once

#include <vector>

#include "io/frames/frame.h"
#include "physics/materials/material.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// A body that has moved further has failed, and so has one that has not come to rest by then.
struct FailureBounds {
  double displacement;  ///< [m] of a particle; infinite without gravity
  double time;          ///< [s]
};

/// Those of a body as it is now. Displacement: rho g L^2 / G, more than a layer as thick as the
/// body settles by its weight; L is its volume over its area across gravity. Time: waves of shear
/// pass the body many times in it. Of several materials the softest and the slowest count. `frame`
/// has the particles of this rank. Collective.
FailureBounds failure_bounds(const FrameSource& frame, const std::vector<Material>& materials,
                             const std::vector<double>& gravity, const Communicator& ranks);

/// Of a particle of any rank [m]. Collective.
double largest_displacement(const FrameSource& frame, const Communicator& ranks);

}  // namespace lahar
