/// \file Implicit steps: what a step does to nodes and particles between its linear solves.
///
/// A step looks for the displacement d of the nodes in the step, with which the body is in
/// equilibrium at its end:
///
///     r_i = f_i - sum_p V_p P_p grad N_i - m_i a_i(d) = 0
///
/// f are the loads, P = J sigma F^-T is the first Piola-Kirchhoff stress with respect to the
/// beginning of the step, F = 1 + H, H = sum_i d_i grad N_i, and V, grad N are those of the
/// beginning. a(d) is Newmark's acceleration (1959), or zero where steps are quasi-static. Newton's
/// method solves A x = r again and again, A = -dr/dd exactly (tangent.h), and adds x to d. Stress
/// and state of particles are those of the beginning until the step has converged.
///
/// With Analysis::as_cbgeo P = (1 + tr H) sigma, and strains are linear in H.
#pragma once

#include "physics/kernels/velocity_gradients.h"

namespace lahar {

/// Particles that neighbours sent, where no step maps them.
template <int Dim>
void deliver(Patch<Dim>& patch);

/// {m a}_i += sum_p N_i m_p a_p, for the accelerations of the beginning.
template <int Dim>
void map_inertia(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Velocities and accelerations at the beginning, from sums of mass, momentum and inertia. d = 0.
/// Which unknowns are given, and the pattern of the matrix.
template <int Dim>
void begin_implicit_step(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Sums and matrix of one iteration begin at zero.
template <int Dim>
void clear_system(Patch<Dim>& patch, const StepContext<Dim>& step);
/// What particles give to r and A. Where a law finds no stress, Patch::unsolved says so.
template <int Dim>
void linearize(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);
/// The rest of A: inertia, and what keeps nodes without stiffness in place. Where given unknowns
/// are to move with the next solution, their part of A d goes to the right side.
template <int Dim>
void complete_matrix(Patch<Dim>& patch, const StepContext<Dim>& step);
/// r of all patches, with the loads of nodes and inertia: the right side of the system.
template <int Dim>
void close_system(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Before the first step nothing is known of accelerations: a = r / m, from the balance of d = 0
/// with a = 0.
template <int Dim>
void accelerate_from_rest(Patch<Dim>& patch, const StepContext<Dim>& step);

/// From now on `left_out` of r(d = 0) is left out, so that Newton's method goes towards the loads
/// in parts. Given unknowns move by `part` of what is prescribed with the next solution. Supports
/// follow the material again (ImplicitNodes::keeps_support).
template <int Dim>
void load_in_part(Patch<Dim>& patch, double left_out, double part);
/// r(d = 0) has been found, at least of fixed unknowns.
template <int Dim>
void keep_unloaded(Patch<Dim>& patch);
/// Keep d, or go back to it.
template <int Dim>
void keep_increment(Patch<Dim>& patch);
template <int Dim>
void restore_increment(Patch<Dim>& patch);
/// d += x, and what is given.
template <int Dim>
void take_solution(Patch<Dim>& patch);
/// d -= share x.
template <int Dim>
void take_back(Patch<Dim>& patch, double share);

/// Sums over the nodes that a patch counts (PatchTopology::owned).
struct EquilibriumNorms {
  double residual = 0;  ///< [N^2] sum of r^2 of unknowns that are not given
  double forces = 0;    ///< [N^2] sum of the squares of what is in balance
  double change = 0;    ///< [m^2] sum of x^2
  double unknowns = 0;  ///< that are not given
};
template <int Dim>
EquilibriumNorms equilibrium_norms(const Patch<Dim>& patch, const StepContext<Dim>& step);

/// The longest displacement in the step.
struct LongestMove {
  double metres = 0, cells = 0;
};
/// Of nodes that hold at least `least_mass` [kg].
template <int Dim>
LongestMove longest_move(const Patch<Dim>& patch, double least_mass);
/// The largest mass of a node [kg].
template <int Dim>
double heaviest_node(const Patch<Dim>& patch);

/// The step has converged: d / dt becomes the velocity that strains and moves particles, and
/// Patch::acceleration what their velocities take; system.solution has Newmark's accelerations.
/// Counts the work of loads and of what prescribes.
template <int Dim>
void end_implicit_step(Patch<Dim>& patch, const StepContext<Dim>& step);
/// H / dt of the particles of these bins, for update_stress().
template <int Dim>
void find_displacement_gradients(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                                 VelocityGradients<Dim>& gradients);
/// Velocities, accelerations and places of particles.
template <int Dim>
void move_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

}  // namespace lahar
