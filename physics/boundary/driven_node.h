/// \file A node that particles with prescribed velocities drive (driven_nodes.h).
#pragma once

#include <array>

#include "physics/base/types.h"

namespace lahar {

template <int Dim>
struct DrivenNode {
  Local node = -1;
  std::array<bool, Dim> driven{};      ///< along which directions
  std::array<double, Dim> velocity{};  ///< [m/s] there
  /// [m/s] what the beginning of the step changed in the node's velocity, with the opposite sign:
  /// still to be given as an impulse. Of schemes that take strains from these velocities.
  std::array<double, Dim> taken{};
};

}  // namespace lahar
