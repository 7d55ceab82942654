/// \file Forces on what holds nodes: supports, walls, springs, absorbing boundaries, particles with
/// prescribed velocities.
///
/// What holds a node of mass m gives it m a - f, with the acceleration a that particles get and all
/// other forces f (d'Alembert). A transfer that takes the share c of nodal velocities from the
/// nodes takes c (m v - p) more in a step: v are the velocities that are held at its beginning, p
/// the momentum that particles gave. A filter of higher order (XPIC, FMPM, that of grains) gives
/// particles the share c of other velocities, of the same momentum but for what holds nodes again
/// when they are known (velocity_transfer.cpp). All nodes together, loads and damping change the
/// momentum of the particles, and nothing else does. All of it is linear in the sums that patches
/// give to a node: each patch has its part.
///
/// Forces of a projection are of gradients: of a pressure dp they are -int N grad dp, to which the
/// walls' own part, the integral of N dp n over the surface, is missing. It is
/// int (N grad dp + dp grad N), over the particles as the forces are, and nothing within a liquid.
///
/// Forces on rigid bodies are those at the end of a step (rigid_contact.h).
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Find Patch::measured, by the gauges of forces on nodes.
template <int Dim>
void set_measured_nodes(Patch<Dim>& patch, const Model<Dim>& model);

/// Patch::supports begin at zero: in projections before the forces of the pressure's change.
template <int Dim>
void begin_supports(Patch<Dim>& patch);
/// Adds `force` on what holds a node [N], if it is measured.
template <int Dim>
void add_support(Patch<Dim>& patch, const Model<Dim>& model, Local node, const Vec<Dim>& force);
/// Patch::supports, by what this patch gave to nodes. After integrate().
template <int Dim>
void find_supports(Patch<Dim>& patch, const StepContext<Dim>& step);
/// The same of the liquid in pores is added: after integrate_liquid().
template <int Dim>
void add_supports_of_liquid(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Those at the end of an implicit step, when its displacement is known. Before
/// end_implicit_step().
template <int Dim>
void find_supports_of_implicit(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Patch::supports and reactions go into Patch::impulses. At the end of a step.
template <int Dim>
void add_impulses(Patch<Dim>& patch, const StepContext<Dim>& step);

}  // namespace lahar
