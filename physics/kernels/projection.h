/// \file Projection: liquids that do not change their volume. The step first finds velocities v*
/// that forces give without the pressure's change dp, then dp such that the velocities with it have
/// no divergence (A. J. Chorin, Math. Comput. 22, 1968; with MPM: F. Zhang et al., Int. J. Numer.
/// Methods Eng. 109, 2017; S. Kularathna and K. Soga, Comput. Methods Appl. Mech. Eng. 313, 2017):
///
///     A dp = b,   A_ij = sum_p V_p dt c_d dN_i/dx_d dN_j/dx_d,   b_i = -sum_p V_p N_i div u*
///
/// u is the discharge: v of a fluid, (1 - n) v + n v_l where a liquid moves in the pores of a
/// skeleton (two_phase.h). c is what a unit pressure gradient changes of it per time and volume:
/// 1 / rho of a fluid; with both phases, whose drag q = n^2 r is implicit as at the nodes,
///
///     c_d = ((1 - n)^2 rho_l' + n^2 rho_s' + dt q_d) / (rho_s' rho_l' + dt q_d (rho_s' + rho_l')),
///
/// rho_s' and rho_l' being the masses of the phases per volume. Without drag this is
/// (1 - n) / rho_s + n / rho_l, with much of it 1 / (rho_s' + rho_l'): both move together. The
/// liquid in pores keeps its bulk modulus K: n V_p / (K dt) is added to the diagonal of A.
///
/// Forces are then -sum_p V_p N_i grad dp (of the liquid in pores n times that): gradients, not
/// pressures, act at nodes, so that a pressure which does not change with place gives no force,
/// however particles lie. The share Projection::kept of the pressure before the step acts with the
/// other forces, in the weak form; dp is the change of what was kept.
///
/// The weight of a fluid is integrated by parts: u* is without it, and b_i gets dt g . a_i with
/// a_i = sum_p V_p grad N_i. So the pressure of a fluid at rest is exact, however particles lie and
/// cells are filled, and walls carry it.
///
/// The pressure is zero at nodes of a free surface: of cells that particles fill, some, but not all
/// around a node. There dp = 0. Prescribed pressures need kept = 0 or a mean before the step.
#pragma once

#include "physics/kernels/velocity_gradients.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Before v*: forces of particles have their whole pressure; of a fluid takes away what is not
/// kept.
template <int Dim>
void leave_out_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// {a, m p}_i += sum_p {V_p grad N_i, N_i m_p p_p}: points out of the body; p of what is kept.
template <int Dim>
void map_outward(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// With the velocities v*: A and b begin at zero, cells that are filled, pressures that are given.
template <int Dim>
void begin_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step);
/// What particles give to A and b.
template <int Dim>
void add_to_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);
/// Given pressures go to the right side.
template <int Dim>
void end_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step);
/// b of all patches, and at which nodes the pressure is known.
template <int Dim>
void close_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Sums over the nodes that a patch counts (PatchTopology::owned).
struct PressureSums {
  double unknowns = 0, given = 0;
  double discharge = 0;  ///< [m^3/s] sum of b of unknowns
  double volume = 0;     ///< [m^3] of these
};
template <int Dim>
PressureSums pressure_sums(const Patch<Dim>& patch);

/// Where the pressure is known nowhere, it has no mean, and b must have none: b_i -= V_i `mean`.
template <int Dim>
void take_out_mean(Patch<Dim>& patch, double mean);

/// The solution and what is given, as ProjectionNodes::change.
template <int Dim>
void take_pressure(Patch<Dim>& patch);

/// Forces of grad dp, added to those that are there.
template <int Dim>
void begin_pressure_forces(Patch<Dim>& patch, const StepContext<Dim>& step);
template <int Dim>
void add_pressure_forces(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Stress of fluids, from velocities without divergence: sigma = s - p I, with what is kept of p,
/// and dp. Volumes do not change.
template <int Dim>
void update_fluid_stress(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);
/// Pressure of a liquid in pores.
template <int Dim>
void change_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

}  // namespace lahar
