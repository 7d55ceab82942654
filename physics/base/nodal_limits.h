/// \file Masses and velocities of nodes that are so small that they mean nothing.
#pragma once

namespace lahar {

/// A node of at most this mass [kg], whatever its sign (quadratic functions have negative parts),
/// is not accelerated: the reference code's value, but for models whose particles are so light that
/// it would be more than rounding (see Patch::least_mass).
inline constexpr double least_nodal_mass = 1e-15;
/// The same as a share of the lightest particle's mass; a particle contributes less than this to a
/// node only where its shape function there is rounding.
inline constexpr double least_nodal_mass_share = 1e-10;
/// Nodal velocity components smaller than this become zero [m/s], because the sign of a velocity
/// decides the direction of damping; the reference code's value.
inline constexpr double least_nodal_velocity = 1e-15;

}  // namespace lahar
