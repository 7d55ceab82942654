/// \file A skeleton with a liquid in its pores: one set of particles, which move with the skeleton
/// and carry velocity and pressure of the liquid (Jassim, Stolle & Vermeer 2013; as in the fork of
/// CB-Geo MPM). Nodes have momenta of both phases,
///     m_l a_l = f_l + m_l g - Q (v_l - v),    f_l = n_i sum_p V p grad N,
///     m a = f - f_l + m g + Q (v_l - v),      f = sum_p V (p I - sigma') grad N + tractions,
/// with the effective stress sigma' of the law, pore pressure p > 0 in compression, and the drag
/// Q_d = sum_p N V n^2 r_d (Pores::drag_volume(), PoreLiquid::resistance). Acceleration of the
/// liquid against the skeleton is kept, its advection is not.
///
/// The porosity n_i = m_l / sum_p N V rho is that of the node: f_l is that of -n grad p, not of
/// -grad(n p), which is another one where layers of different porosity meet. The same holds for
/// the change of the pressure, whose work is that of these forces:
///     dp/dt = -K / n div u,    u_i = v_i + n_i (v_l,i - v_i).
/// USF and CB-Geo MPM have the porosity of particles in both.
///
/// Drag is implicit at the node: a system of two equations for each direction, so that the step has
/// no limit of 2 k / (n g).
///
/// I. Jassim, D. Stolle, P. Vermeer, Two-phase dynamic analysis by material point method, Int. J.
/// Numer. Anal. Methods Geomech. 37 (2013) 2502-2522.
#pragma once

#include "physics/kernels/velocity_gradients.h"
#include "physics/particles/patch.h"

namespace lahar {

/// {m_l v_l, m_l}_i += sum_p N_i n rho V {v_l, 1}.
template <int Dim>
void map_liquid_mass_momentum(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// The momentum again, for MUSL's second mapping.
template <int Dim>
void map_liquid_momentum(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Forces of the pore pressure on the mixture and on the liquid, tractions on the liquid, and drag.
/// With Q4 and H8 the pressure acts by gradients at the cell's centre, whose volumetric strain it
/// comes from (B-bar, Hughes 1980), else in the mean of the particles of a cell. With
/// Analysis::volume_as_cbgeo each particle's acts by its own gradients.
template <int Dim>
void map_liquid_forces(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Velocities of the liquid at nodes, with those that are prescribed.
template <int Dim>
void liquid_velocity(Patch<Dim>& patch, const StepContext<Dim>& step);
template <int Dim>
void liquid_velocity_again(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Forces and drag of all patches, before integrate() takes those on the skeleton from them.
template <int Dim>
void liquid_forces(Patch<Dim>& patch, const StepContext<Dim>& step);

/// -f_l, which leaves of the force on the mixture that on the skeleton, with an explicit drag
/// Q (v_l - v). `old` is {v, m} of the skeleton's node before the step.
template <int Dim>
NodeVector before_damping(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                          const NodeVector& old);

/// Q (v_l - v) after a step without damping, where drag is implicit: the part of drag in what is
/// out of balance, which Cundall's damping takes. (That of the beginning has no bound where drag is
/// stiff: a rounding of v_l - v times Q.) `force` is all else on the skeleton's node. It is kept in
/// Patch::Liquid::acceleration until integrate_liquid().
template <int Dim>
NodeVector drag_before_damping(Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                               const NodeVector& old, const NodeVector& force,
                               const NodeVector& gravity);

/// Q (v_l - v) after the step, where drag is implicit; `force` is all else on the skeleton's node.
/// integrate_liquid() finds the same for the liquid: drag keeps the momentum of both.
template <int Dim>
NodeVector drag_on_skeleton(const Patch<Dim>& patch, const StepContext<Dim>& step, Local node,
                            const NodeVector& old, const NodeVector& force,
                            const NodeVector& gravity);

/// A one-sided wall that holds the liquid, too, with nodal porosities. Its friction takes the
/// effective stress: of what presses the skeleton on the wall, (1 - n) p is the pore pressure's,
/// and n p is what presses the liquid. It slows both phases, as far as drag ties them together.
/// `m` is the mass of the skeleton, `after` its velocity without the wall. Changes coefficients of
/// friction to those of the skeleton alone, and returns by how much its friction is more than that
/// of this mass.
template <int Dim>
double meet_wall_with_liquid(const Patch<Dim>& patch, const StepContext<Dim>& step,
                             const NodeVector& gravity, double m, const Vec<Dim>& after,
                             ConstrainedNode<Dim>& wall);

/// Velocities of the liquid after the step, from those of the skeleton, which are final. Work of
/// gravity, of prescribed velocities and of drag.
template <int Dim>
void integrate_liquid(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Velocity of the liquid of particles, as update_particles() does for the skeleton. It comes
/// before particles move.
template <int Dim>
void update_liquid(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// u of nodes, before update_pore_pressure() or the system of a projection.
template <int Dim>
void liquid_discharge(Patch<Dim>& patch);

/// dp = -dt K / n div u, or -dt K / n ((1 - n) div v + n div v_l) without nodal porosities, after
/// the skeleton's volume has changed. `skeleton` is what update_stress() took for the same bins;
/// with linear Q4 and H8, and with nodal porosities, it is not read.
template <int Dim>
void update_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                          const VelocityGradients<Dim>& skeleton);

/// Means of the pore pressure at nodes, by liquid mass, with those that are prescribed.
template <int Dim>
void map_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);
template <int Dim>
void nodal_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Particles take the pressure of the nodes. Without smoothing they only take what pressures that
/// are prescribed inside differ by from the mean: of a cell all the same, as their pressures are
/// those of the cell, and its nodes then have the mean that is prescribed.
template <int Dim>
void take_pore_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

}  // namespace lahar
