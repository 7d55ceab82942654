/// \file Prescribed velocities of nodes that are functions of time.
///
/// With w(t) the prescribed velocity, a node has in a step from t to t + dt
///
///     v = w(t + dt/2),   a = (w(t + dt) - w(t)) / dt.
///
/// What moves with v follows the integral of w by the midpoint rule, and particles, to which a is
/// given, have the velocity w(t). Both hold for any steps, without a memory of those before. All
/// kernels see v as a constant of the step, with which a is zero; add_timed_acceleration() comes
/// after them. What holds the node does the work of v against all forces, and gives the kinetic
/// energy m (w(t + dt)^2 - w(t)^2) / 2 besides.
///
/// A velocity that is not zero when the run begins, constant or not, is reached at once where the
/// particles have another: the first step has (w(0) - v_i) / dt in its acceleration, too, with the
/// velocity v_i that particles give to the node (Analysis::sudden_velocities).
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Set v in Patch::fixed, fixed_liquid and walls. Needs the time step, and may be repeated.
template <int Dim>
void set_timed_velocities(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Before an implicit step: nodes at walls have v where it is held, and no acceleration. (Those
/// with constant velocities get what they lack as an impulse of the wall.)
template <int Dim>
void hold_timed_walls(Patch<Dim>& patch);

/// Add a to what is held, and count its work, with that of velocities which are reached at once.
/// One-sided walls give their impulse themselves.
template <int Dim>
void add_timed_acceleration(Patch<Dim>& patch, const StepContext<Dim>& step);
template <int Dim>
void add_timed_acceleration_of_liquid(Patch<Dim>& patch, const StepContext<Dim>& step);
/// The same at the end of an implicit step, whose patches keep their own masses elsewhere. Nodes
/// have both the change of velocities in the step and the acceleration at its end.
template <int Dim>
void add_timed_acceleration_of_implicit(Patch<Dim>& patch, const StepContext<Dim>& step);

}  // namespace lahar
