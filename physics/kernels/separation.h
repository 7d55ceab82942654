/// \file ASFLIP: particles move with velocities of their own where material comes apart.
///
/// Particles get the velocities of APIC. Of their own they keep the share alpha that nodes do not
/// have, as with FLIP. With S from nodes to particles, V before forces act and v after,
///     v_p <- S v + alpha (v_p - S V)
/// Where places move with S v alone, particles near each other move together, and what they keep
/// cannot part them. Here
///     x_p += dt (S v + beta_p alpha (v_p - S V)) = dt ((1 - beta_p) S v + beta_p v_p),
/// beta_p = VelocityTransfer::separation, but zero
///   where the particle is compressed: det(I + dt L) < 1, L the gradient of v there;
///   along each direction in which a node that it reaches is held: by a velocity constraint, or by
///   particles with a prescribed velocity; along all of them where such a node is at a wall, at a
///   nodal condition with forces or at the surfaces of two bodies.
/// There places move with the nodes: what nodes may not pass particles do not.
///
/// Momentum is kept to rounding. Columns of loose sand made energy with it, with shares beta of 0
/// and 1; why is not known. Places are no part of the account of energy: where beta differs
/// between particles, their centre of mass moves by other than its velocity.
///
/// Y. Fei, Q. Guo, R. Wu, L. Huang, M. Gao, Revisiting integration in the material point method: a
/// scheme for easier separation and less dissipation, ACM Trans. Graph. 40(4) (2021) 109. There
/// beta is zero in all directions inside of obstacles.
#pragma once

#include "physics/kernels/velocity_gradients.h"

namespace lahar {

inline bool separates(const Analysis& analysis) {
  return analysis.transfer.separation > 0.0;
}

/// Patch::held, from what holds nodes in this step.
template <int Dim>
void find_held_nodes(Patch<Dim>& patch, const StepContext<Dim>& step);

namespace general {

/// update_particles() of general_kernels.h with separation. Affine velocities are needed.
template <int Dim, class Real>
void update_separable(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      VelocityGradients<Dim>* gradients);

}  // namespace general

}  // namespace lahar
