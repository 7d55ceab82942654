/// \file Contact of a liquid in pores with rigid bodies, beside that of its skeleton
/// (rigid_contact.h), whose springs have the modulus M of the skeleton: N is the push of effective
/// stress, and friction that of N.
///
/// No liquid enters a body. A particle that touches it has a push P of its own, which goes with the
/// discharge u = v + n (v_l - v) (two_phase.h) through the surface, as the pore pressure does with
/// its divergence, and acts on mixture and liquid as the pore pressure does:
///
///     dP/dt = -k (u - v_b).n,  P >= -N;  f_i = P w_i,  f_l,i = n_i P w_i,  u.n = sum_i w_i . u_i
///
/// The functions w_i = (N_i - d n . grad N_i) n are those at the surface, or SidePush. The
/// velocities are those from which strains are found. So this is a spring: its work is that of its
/// forces, and no volume goes through the surface, whatever P is. As velocities that follow from
/// forces of this step, or at centres, they let liquid seep through bodies at rest.
///
///     k = min(2 K A / n h, m_u / dt^2),  1 / m_u = (1 - n)^2 / m + n^2 / m_l
///
/// K is the bulk modulus of the liquid, A, h and dt are as in rigid_contact.h, m and m_l the masses
/// of grains and liquid of the particle. Grains and liquid together yield to a pressure as half a
/// cell of saturated soil does, and share it as this would. Along the surface the liquid is free.
///
/// What begins at a body presses it with the pressure that it has. Where a body is left, P ends.
#pragma once

#include "physics/kernels/contact_springs.h"

namespace lahar {

/// P after the step, when particles have moved; liquid_discharge() comes first. Adds it to
/// Patch::reactions.
template <int Dim>
void press_liquid(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Forces of P on mixture and liquid.
template <int Dim>
void map_liquid_pushes(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

}  // namespace lahar
