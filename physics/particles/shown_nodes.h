/// \file What output shows of the nodes of a patch.
#pragma once

#include <vector>

#include "physics/base/node_vector.h"
#include "physics/base/types.h"

namespace lahar {

/// Active nodes with mass, as they are when the velocities of a step are known: what moves the
/// particles. Steps do not read it, so the state of a patch leaves it out. Patches that share a
/// node have the same bits for it.
struct ShownNodes {
  Index step = -1;          ///< the last one that filled it
  std::vector<Local> node;  ///< ascending; of bodies in contact that of the first body
  NodeArray velocity;       ///< {v [m/s], m [kg]}
  NodeArray acceleration;   ///< {a [m/s^2], 0}
};

}  // namespace lahar
