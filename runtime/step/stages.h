/// \file The stages that a time step is made of. Each function gives those of one purpose, in
/// order: none where the analysis does not need them, or several with exchanges between them.
#pragma once

#include <vector>

#include "runtime/step/timestep.h"

namespace lahar {

template <int Dim>
using Stages = std::vector<TimestepStage<Dim>>;

/// Particles that neighbours sent, and their part of the mapping of this step.
template <int Dim>
Stages<Dim> arrivals(const Analysis& analysis);
/// The same of particles that come into cells that are empty when everybody has arrived.
template <int Dim>
Stages<Dim> injection(const Analysis& analysis);

/// Which bodies meet at nodes: surfaces, normals and gaps (physics/contact).
template <int Dim>
Stages<Dim> meeting_bodies(const Analysis& analysis);
/// Nodes that particles with prescribed velocities drive.
template <int Dim>
Stages<Dim> driven_nodes(const Analysis& analysis);

/// v_i from mass and momentum.
template <int Dim>
Stages<Dim> nodal_velocities(const Analysis& analysis);
/// v_i again, from the updated particles: MUSL's second mapping.
template <int Dim>
Stages<Dim> remapped_velocities(const Analysis& analysis);

/// One stage, or two with the exchange of nodal pressure between them.
template <int Dim>
Stages<Dim> strain_and_stress(const Analysis& analysis);
/// Whether stress takes what G2P finds of velocity gradients: with USL both take the same nodal
/// velocities at the same places.
bool stress_follows_g2p(const Analysis& analysis);

/// Pressure of the liquid in pores, with an exchange where nodes smooth or prescribe it.
template <int Dim>
Stages<Dim> pore_pressure(const Analysis& analysis);

/// What conditions of nodes need of particles: wave speeds and displacement.
template <int Dim>
Stages<Dim> mapped_means(const Analysis& analysis);
/// Means at nodes from that.
template <int Dim>
Stages<Dim> node_means(const Analysis& analysis);

/// a_i and the new v_i, which become what constraints, walls and contact allow.
template <int Dim>
Stages<Dim> integration(const Analysis& analysis);
/// How far nodes are from equilibrium (imbalance.h), where a run ends by itself.
template <int Dim>
Stages<Dim> unbalanced_forces(const Analysis& analysis);

/// What the velocity transfer needs of nodes before particles move (velocity_transfer.h): APIC's
/// velocities before forces, nodes that are held, a filter with an exchange per order.
template <int Dim>
Stages<Dim> velocity_transfer(const Analysis& analysis);
/// Forces of rigid bodies on particles, of the step after (rigid_contact.h).
template <int Dim>
Stages<Dim> rigid_contact(const Analysis& analysis);
/// Particles that have moved, out of rigid bodies.
template <int Dim>
Stages<Dim> outside_of_bodies(const Analysis& analysis);
/// Velocities and places of particles.
template <int Dim>
Stages<Dim> g2p(const Analysis& analysis);
/// Velocities of the liquid in pores, before particles move.
template <int Dim>
Stages<Dim> liquid_g2p(const Analysis& analysis);
/// Cells of particles; those that leave the patch go to outboxes. Limits of the time step.
template <int Dim>
Stages<Dim> location(const Analysis& analysis);

/// Whether forces are mapped at the end of the step before. Else they are mapped when particles
/// have arrived: with USF, and where means over the particles of a cell need all of them.
bool maps_force_with_momentum(const Analysis& analysis);
/// Mass and momentum of nodes, of the step after.
template <int Dim>
Stages<Dim> p2g(const Analysis& analysis);
/// Internal and external forces.
template <int Dim>
Stages<Dim> forces(const Analysis& analysis);
/// The same of a liquid in pores (two_phase.h).
template <int Dim>
Stages<Dim> liquid_p2g(const Analysis& analysis);
template <int Dim>
Stages<Dim> liquid_forces(const Analysis& analysis);
/// Sums of particles with prescribed velocities, of the step after.
template <int Dim>
Stages<Dim> prescribed_velocities(const Analysis& analysis);

/// Implicit steps: what their solve found becomes velocities and accelerations.
template <int Dim>
Stages<Dim> solved_motion(const Analysis& analysis);
/// Masses, velocities and accelerations of nodes, before a solve.
template <int Dim>
Stages<Dim> motion_before_solve(const Analysis& analysis);
/// Matrix and right side of a solve, with the exchange of forces that are not in balance.
template <int Dim>
Stages<Dim> linear_system(const Analysis& analysis);

/// Projections: velocities of nodes to which the change of the pressure is missing, before a solve.
template <int Dim>
Stages<Dim> motion_before_projection(const Analysis& analysis);
/// Matrix and right side of the system for it, with the exchange of divergences.
template <int Dim>
Stages<Dim> pressure_system(const Analysis& analysis);
/// Forces of the change of the pressure, beside those that nodes have; integration() follows again.
template <int Dim>
Stages<Dim> pressure_forces(const Analysis& analysis);
/// Stress and pressure: of soil with strains of velocities that particles gave to nodes again.
template <int Dim>
Stages<Dim> projected_stress(const Analysis& analysis);

/// Frames, history and checkpoints take what they need here.
template <int Dim>
Stages<Dim> output(const Analysis& analysis);

}  // namespace lahar
