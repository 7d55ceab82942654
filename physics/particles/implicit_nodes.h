/// \file What nodes keep while an implicit step is solved (physics/kernels/implicit.h).
#pragma once

#include <vector>

#include "physics/base/node_vector.h"

namespace lahar {

/// By local node; vectors are complete: all copies of a node have the same bits.
struct ImplicitNodes {
  std::vector<double> own_mass;  ///< [kg] of this patch's particles
  NodeArray increment;           ///< {d [m], 0}: displacement in the step so far
  NodeArray kept;                ///< d to go back to
  NodeArray given;               ///< {d [m], 0} of the whole step, of unknowns that are given
  NodeArray unloaded;            ///< {r [N], 0} of d = 0
  double predicted = 0;          ///< share of `given` by which the next solution moves them
  double left_out = 0;           ///< share of `unloaded` that is left out of the balance
};

}  // namespace lahar
