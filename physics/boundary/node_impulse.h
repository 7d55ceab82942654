/// \file What an impulse of contact or of a one-sided wall did to a node in a step.
#pragma once

#include "physics/base/types.h"

namespace lahar {

template <int Dim>
struct NodeImpulse {
  Vec<Dim> start = Vec<Dim>::Zero();   ///< [m/s] velocity at the beginning of the step
  Vec<Dim> change = Vec<Dim>::Zero();  ///< [m/s] what the impulse added
  Vec<Dim> after = Vec<Dim>::Zero();   ///< [m/s] velocity at the end of the step

  /// What the impulse takes per mass [J/kg] beyond -change . (start + after) / 2, once MUSL's
  /// second mapping gave the velocity `mapped` [m/s] and strains are taken from `held` [m/s].
  ///
  /// With forces f and impulses j at the nodes, particles of FLIP get the kinetic energy
  /// (f dt + j) . (start + mapped) / 2, and what `held` changes in `mapped` the strain energy
  /// -f dt . (held - mapped): the impulse takes -j . (start + mapped) / 2 + f dt . (held - mapped).
  double taken_again(const Vec<Dim>& mapped, const Vec<Dim>& held) const {
    return (after - start - change).dot(held - mapped) - 0.5 * change.dot(mapped - after);
  }
};

}  // namespace lahar
