/// \file Nodes that particles with prescribed velocities drive: what such particles are made of
/// moves as a rigid, kinematic body, and pushes and pulls the material around it.
///
/// Every node that gets mass from particles whose velocity along a direction is prescribed has
/// along it the mean of these velocities by mass ("specified" contact of a rigid body, Guilkey &
/// Harman, Uintah). Fields at such particles are then those of a body that does not deform, and
/// material around them sticks to it. What a node is given in a step is an impulse on all that has
/// mass there: particles get all of it, so that momentum is balanced. Nodal velocity constraints
/// and walls at the same node win.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// m_i,d += sum_p N_i m_p and (m v)_i,d += sum_p N_i m_p v_p,d over the particles whose velocity
/// along d is prescribed. Zero before.
template <int Dim>
void map_prescribed(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);
template <int Dim>
void clear_prescribed(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Patch::driven from sums over all patches that share a node.
template <int Dim>
void find_driven_nodes(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Nodal velocities become what driven nodes, nodal constraints and walls allow. Where a step
/// begins with them (`begins`), DrivenNode::taken and, at walls, Patch::acceleration keep what was
/// taken from them, for the impulses of the step.
template <int Dim>
void prescribe_velocities(Patch<Dim>& patch, NodeArray& velocity, bool begins = false);

/// Velocities and accelerations at the end of the step, and the work of what drives the nodes, with
/// that of weight (`gravity` [m/s^2]) and damping along the way. What drives a node does work along
/// its velocity; the rest of its impulse's work is lost, as in a plastic impact.
template <int Dim>
void finish_driven_nodes(Patch<Dim>& patch, const StepContext<Dim>& step, const Vec<Dim>& gravity);

}  // namespace lahar
