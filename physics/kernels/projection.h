/// \file Projection: liquids that do not change their volume. The step first finds velocities v*
/// that forces give without the pressure's change dp, then dp such that the velocities with it have
/// no divergence (A. J. Chorin, Math. Comput. 22, 1968; with MPM: F. Zhang et al., Int. J. Numer.
/// Methods Eng. 109, 2017; S. Kularathna and K. Soga, Comput. Methods Appl. Mech. Eng. 313, 2017):
///
///     A dp = b,   A_ij = int dt c_d dN_i/dx_d dN_j/dx_d dV,   b_i = -int N_i div u* dV
///
/// Integrals are over cells. A cell is full if its particles fill some share of it
/// (Projection::least_fill): else a few particles would leave its pressure undetermined, or make
/// its gradient too large. A fluid without a free surface also fills cells that lost all particles.
/// u is the discharge: v of a fluid, v + n (v_l - v) where a liquid moves in the pores of a
/// skeleton, with the porosity n of nodes (two_phase.h). c is what a unit pressure gradient changes
/// of it per time and volume: 1 / rho of a fluid; with both phases, whose drag q = n^2 r is
/// implicit as at the nodes, and with n of the cell,
///
///     c_d = ((1 - n)^2 rho_l' + n^2 rho_s' + dt q_d) / (rho_s' rho_l' + dt q_d (rho_s' + rho_l')),
///
/// rho_s' and rho_l' being the masses of the phases per volume. Without drag this is
/// (1 - n) / rho_s + n / rho_l, with much of it 1 / (rho_s' + rho_l'): both move together. The
/// liquid in pores keeps its bulk modulus K: n / (K dt) is added to the diagonal of A, and n / (K
/// dt) of the pressure that is not kept to b, as it is at the nodes: with its gradient in the cell.
///
/// Forces are then -sum_p V_p N_i grad dp (of the liquid in pores n_i times that): gradients, not
/// pressures, act at nodes, so that a pressure which does not change with place gives no force,
/// however particles lie. The share Projection::kept of the pressure before the step acts with the
/// other forces, in the weak form; dp is the change of what was kept.
///
/// The weight of a fluid is integrated by parts: u* is without it, and b_i gets dt g . a_i with
/// a_i = int grad N_i dV. So the pressure of a fluid at rest is exact, however particles lie and
/// cells are filled, and walls carry it. With a liquid in the pores the same is done with what the
/// gradient of water at rest does to both phases: b_i gets int dt c_d rho_l g_d dN_i/dx_d dV, and
/// u* is without the impulses of that gradient at the nodes. (Else the operators of b and A differ
/// at borders, and the skeleton takes over the weight of the water, the more the less permeable it
/// is.) Nodes with little mass have accelerations of no meaning: v* of soil has the mean
/// acceleration of a cell's nodes in their place (ProjectionNodes::unforced).
///
/// Velocities without divergence at nodes do not keep particles evenly spread: errors of steps add
/// up where flows meet, such as in corners. A fluid without a free surface cannot close its voids.
/// It therefore spreads at nodes at which its volume is larger than the space
/// (ProjectionNodes::space), and draws together where it is smaller. The rate is that of the shear:
/// b_i gets (V_i / space_i - 1) sum_p N_i V_p |D_p|. (Other particle methods shift positions for
/// this, A. Skillen et al., Comput. Methods Appl. Mech. Eng. 265, 2013.) This makes energy: with a
/// free surface it is left out.
///
/// The pressure is zero at nodes of a free surface: of cells that particles fill, some, but not all
/// around a node. There dp = 0. Prescribed pressures need kept = 0 or a mean before the step.
#pragma once

#include "physics/kernels/velocity_gradients.h"
#include "physics/particles/patch.h"

namespace lahar {

/// [m^3] of the particles in a local cell, and whether that fills a cell of so much volume.
template <int Dim>
double volume_in(const Patch<Dim>& patch, std::size_t cell) {
  const double* V = patch.particles.row(Column::volume);
  double sum = 0;
  for (Local b = patch.first_bin[cell]; b >= 0; b = patch.bins[static_cast<std::size_t>(b)].next) {
    const ParticleBin& bin = patch.bins[static_cast<std::size_t>(b)];
    for (Local p = bin.begin; p < bin.end; ++p) sum += V[p];
  }
  return sum;
}
template <int Dim>
bool is_filled(const Model<Dim>& model, double filled, double volume) {
  constexpr double rounding = 1e-6;
  return filled > 0 && filled >= (model.analysis.projection.least_fill - rounding) * volume;
}

/// Stress of fluids from the velocities with which the step begins, without their divergence; the
/// pressure stays. (Of velocities after the step, those of nodes with little mass have no bound.)
template <int Dim>
void update_shear_stress(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Before v*: forces of particles have their whole pressure; of a fluid takes away what is not
/// kept.
template <int Dim>
void leave_out_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// {m p, m p}_i += sum_p N_i m_p (p_p + g . (x_i - x_p)), of what is kept: with its gradient g in
/// the cell, and with that along axes on which the node holds the liquid. (There cells lie on one
/// side. With all of it inside, gradients that alternate from cell to cell would follow from
/// themselves.)
template <int Dim>
void map_kept_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// What weight gives to velocities v* in the step, and b has by parts [m/s]: of fluids, as far as
/// no pressure that is kept carries it.
template <int Dim>
Vec<Dim> weight_out_of_velocities(const StepContext<Dim>& step);

/// The gradient of the pressure of water at rest in pores, as far as no pressure that is kept has
/// it [Pa/m].
template <int Dim>
Vec<Dim> pore_gradient_at_rest(const StepContext<Dim>& step);

/// Axes along which nodes are held, by local node, a bit for each: nothing flows through there.
/// With a liquid in pores those along which it is. One bit more, held_askew, is of walls that lie
/// along no axis.
template <int Dim>
inline constexpr unsigned held_askew = 1u << Dim;
template <int Dim>
std::vector<std::uint8_t> held_axes(const Patch<Dim>& patch, bool two_phase);

/// With the velocities v*: A and b begin with voids, cells that are filled, pressures that are
/// given.
template <int Dim>
void begin_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step);
/// What particles give to A and b.
template <int Dim>
void add_to_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);
/// The same of cells that have no particles, and that a fluid fills.
template <int Dim>
void add_voids(Patch<Dim>& patch, const StepContext<Dim>& step, const std::vector<char>& voids);
/// Given pressures go to the right side.
template <int Dim>
void end_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step);
/// b of all patches, and at which nodes the pressure is known.
template <int Dim>
void close_pressure_system(Patch<Dim>& patch, const StepContext<Dim>& step);

/// At the beginning of a run: a pressure of the liquid in pores that was given as it is inside
/// becomes zero at free surfaces. Particles take -sum_i N_i p_i of the nodes there, p_i being that
/// of the particles around, with its gradient.
template <int Dim>
void drain_surfaces(Patch<Dim>& patch, const StepContext<Dim>& step);

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

/// The pressure of fluids becomes what is kept of it, and dp. Volumes do not change.
template <int Dim>
void change_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);
/// The same of a liquid in pores. Forces take the mean of the particles of a cell. Where all is
/// kept, that of a full cell gets dp at its centre: if particles lie to one side of their cells, a
/// dp that alternates from node to node would else push cells against each other, in velocities
/// without divergence, and grow. Particles differ from the mean as ProjectionNodes::level does,
/// else what no force answers to would stay in them.
template <int Dim>
void change_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

}  // namespace lahar
