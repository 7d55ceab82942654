/// \file What nodes keep while an implicit step is solved (physics/kernels/implicit.h).
#pragma once

#include <cstdint>
#include <vector>

#include "physics/base/node_vector.h"
#include "physics/base/types.h"

namespace lahar {

/// A node at walls (ConstrainedNode), by its local axes.
template <int Dim>
struct ImplicitWall {
  std::uint8_t fixed = 0;                ///< bit per axis: the displacement along it is prescribed
  std::uint8_t closed = 0;               ///< bit per axis: a one-sided wall holds the node along it
  std::uint8_t closing = 0;              ///< is to hold it from the next iteration on
  bool slips = false;                    ///< friction does not hold the other axes
  int changes = 0;                       ///< of sticking and slipping in this step
  Vec<Dim> slip = Vec<Dim>::Zero();      ///< unit vector of sliding
  Vec<Dim> friction = Vec<Dim>::Zero();  ///< [N] on the node
};

/// By local node, if nothing else is said; vectors are complete: all copies of a node have the same
/// bits.
template <int Dim>
struct ImplicitNodes {
  std::vector<double> own_mass;  ///< [kg] of this patch's particles
  NodeArray increment;           ///< {d [m], 0}: displacement in the step so far
  NodeArray kept;                ///< d to go back to
  NodeArray prescribed;          ///< {d [m], 0} of the whole step, of unknowns that are given
  NodeArray given;               ///< {d [m], 0} by which these move with the next solution
  bool has_given = false;        ///< some do
  NodeArray balance;             ///< {r [N], 0} but for friction
  NodeArray unloaded;            ///< r of d = 0; until it is needed, of fixed unknowns alone
  double left_out = 0;           ///< share of `unloaded` that is left out of the balance
  std::vector<ImplicitWall<Dim>> walls, kept_walls;  ///< by Patch::walls
  bool walls_changed = false;                        ///< in this iteration
  /// [Pa] stiffness in shear of a bin's material, by its first particle, which sets the stiffness
  /// of motions without strain (linearize()).
  std::vector<double> support;
  bool keeps_support = false;  ///< it is that of an earlier iteration
};

}  // namespace lahar
