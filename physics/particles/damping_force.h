/// \file Damping at nodes.
#pragma once

#include <cmath>

#include "physics/model/model.h"
#include "physics/particles/node_sums.h"

namespace lahar {

/// The force against the velocity in {v, m}, without a mass lane. Cundall's is alpha |f_d|
/// sign(v_d), with Analysis::damping_as_cbgeo |f| in place of |f_d|. The viscous one is alpha m v
/// in the mean over a step in which it acts alone: v becomes v exp(-alpha dt), whatever the step.
LAHAR_INLINE NodeVector damping_force(const Analysis& analysis, double dt, const NodeVector& v,
                                      const NodeVector& force) {
  const NodeVector zero(0.0);
  if (analysis.viscous_damping)
    return with_mass((-std::expm1(-analysis.damping * dt) / dt * v[mass_lane]) * v, zero);
  const NodeVector squares = force * force;
  const NodeVector size =
      analysis.damping_as_cbgeo ? NodeVector(std::sqrt(reduce(squares))) : max(force, zero - force);
  const NodeVector against = analysis.damping * size;
  const auto signed_force = v.v > zero.v ? against.v : v.v < zero.v ? -against.v : zero.v;
  return with_mass(NodeVector::of(signed_force), zero);
}

/// Whether damping is a share of the net force, which other bodies leave. Viscous damping is none
/// of a force, and that of CB-Geo MPM is a share of the force without contact.
inline bool damps_net_force(const Analysis& analysis) {
  return analysis.damping > 0.0 && !analysis.viscous_damping && !analysis.damping_as_cbgeo;
}

}  // namespace lahar
