/// \file The kernels of a step: plain functions over one patch. Equations with the letters of the
/// papers: p particle, i node, N_i shape function; see CONTRIBUTING.md for the glossary.
/// Algorithm: Sulsky, Chen & Schreyer (1994); order of operations as in CB-Geo MPM (Kumar et al.
/// 2019).
#pragma once

#include "physics/base/nodal_limits.h"
#include "physics/base/simd.h"
#include "physics/kernels/velocity_gradients.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Place the particles that neighbours sent, in ascending patch id, in bins of their cells. The
/// first call sorts all particles into bins (stable, by cell and material). Those placed later are
/// listed in Patch::unmapped until they are mapped.
template <int Dim>
void receive(Patch<Dim>& patch);

/// Give a cell of the patch new particles, as receive() does with those that neighbours sent.
template <int Dim>
void place_new(Patch<Dim>& patch, const Particles<Dim>& from, Local cell);

/// The particles that Model::injections bring at the beginning of the step, after receive() has
/// shown which cells are empty. They are listed in Patch::unmapped, their events in
/// Patch::injected.
template <int Dim>
void inject(Patch<Dim>& patch, const StepContext<Dim>& step);

/// The limit of the time step [s] that the particles of a generator (index into Model::injections)
/// have when they come into cells of the patch.
template <int Dim>
double injection_limit(const Patch<Dim>& patch, std::size_t generator, const Model<Dim>& model);

/// Sort particles again where too many bins had to be added for cells without a free slot; forget
/// the bins of a patch that has become empty. When depends on what is in the patch only.
/// Patch::unmapped must be empty.
template <int Dim>
void sort_if_scattered(Patch<Dim>& patch);

/// Sort particles again where those of a cell and material are in several bins: means over them
/// need one. Patch::unmapped must be empty.
template <int Dim>
void join_bins(Patch<Dim>& patch);

/// Copy nodes for output (Patch::shown_nodes), when their velocities are those of the end of the
/// step and conditions and contact are met.
template <int Dim>
void show_nodes(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Active nodes (Patch::active_nodes) from the bins. Nobody may be reading the patch's sums: those
/// at nodes that are not active any more become zero.
template <int Dim>
void find_active_nodes(Patch<Dim>& patch);

/// Make the nodes of Patch::cells_to_activate active.
template <int Dim>
void activate_nodes(Patch<Dim>& patch);

/// Before the mapping for a step: zero one kind of the patch's own sums, or all that lie with it.
template <int Dim>
void clear_sums(Patch<Dim>& patch, const StepContext<Dim>& step, NodeSum which);
template <int Dim>
void clear_sums_with(Patch<Dim>& patch, const StepContext<Dim>& step, NodeSum which);

/// m_i += sum_p N_i m_p,  (m v)_i += sum_p N_i m_p v_p, into the patch's own sums.
template <int Dim, class Real = Pack>
void map_mass_momentum(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// (m v)_i += sum_p N_i m_p v_p with the updated particle velocities (MUSL's second mapping).
template <int Dim, class Real = Pack>
void map_momentum(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// (m p)_i += sum_p N_i m_p p_p over particles whose law has a pressure.
template <int Dim, class Real = Pack>
void map_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// f_i += -sum_p V_p sigma_p grad N_i + sum_p N_i t_p area_p (traction); of axisymmetric
/// models also the forces of ring.h.
template <int Dim, class Real = Pack>
void map_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// g_i += sum_p V_p grad N_i: points out of a body, for contact.
template <int Dim, class Real = Pack>
void map_gradient(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Which bodies meet at nodes of the patch, along which normals, and the gaps between them
/// (contact_surface.h), with the furthest surfaces of all patches that share a node.
template <int Dim>
void meet_bodies(Patch<Dim>& patch, const StepContext<Dim>& step);

/// What conditions of nodes take from particles (NodeMeans): (m u)_i, (m c_p)_i, (m c_s)_i,
/// (m rho)_i += sum_p N_i m_p {u_p, c_p, c_s, rho_p}, only in cells around them. Zero before.
template <int Dim>
void map_means(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);
template <int Dim>
void clear_means(Patch<Dim>& patch, const StepContext<Dim>& step);

/// ActingNode::means, with sums over all patches that share a node.
template <int Dim>
void set_node_means(Patch<Dim>& patch, const StepContext<Dim>& step);

/// v_i = (m v)_i / m_i with sums over all patches that share a node, in ascending patch id; then
/// prescribed velocities.
template <int Dim>
void nodal_velocity(Patch<Dim>& patch, const StepContext<Dim>& step);

/// The same with the momentum of MUSL's second mapping.
template <int Dim>
void nodal_velocity_again(Patch<Dim>& patch, const StepContext<Dim>& step);

/// p_i = (m p)_i / m_i.
template <int Dim>
void nodal_pressure(Patch<Dim>& patch, const StepContext<Dim>& step);

/// a_i = (f_i + m_i g + point forces + forces of conditions - alpha |f_i| sign(v_i)) / m_i;  v_i +=
/// dt a_i; prescribed velocities, which also zero the acceleration. Where bodies share nodes,
/// contact comes last and keeps prescribed velocities (contact.h).
template <int Dim>
void integrate(Patch<Dim>& patch, const StepContext<Dim>& step);

/// nodal_velocity() and integrate() in one pass, where one exchange brings mass, momentum and
/// force.
template <int Dim>
void velocity_and_integrate(Patch<Dim>& patch, const StepContext<Dim>& step);

/// v_p: FLIP v_p + dt sum_i N_i a_i, PIC sum_i N_i v_i, or their blend; x_p, u_p += dt sum_i N_i
/// v_i; prescribed particle velocities, and places where nodes are driven. Raises Patch::max_speed.
/// `gradients`, only where gives_gradients() (support.h), receives what update_stress() would find
/// before particles move.
template <int Dim, class Real = Pack>
void update_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      VelocityGradients<Dim>* gradients = nullptr);

/// Parts of the work of forces: as if they acted at centres, and the rest, because they act at
/// sides.
enum class WorkPart { all, centres, sides };

/// Work of the tractions over the step (particle_forces.h), before stresses change volumes or
/// particles move.
template <int Dim>
void add_work_of_tractions(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                           WorkPart part);

/// Which parts of the stress stage to do; pressure smoothing comes between the two.
enum class StressPart { both, strain, law };

/// Strain rate from nodal velocities; strain, volume (gradient at the cell's centre) and the law.
/// With `gradients` it takes those: of the same bins, from update_particles(). Models that deform
/// across their plane need those of find_gradients_across() (stress_across.h).
template <int Dim, class Real = Pack>
void update_stress(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                   StressPart part, const VelocityGradients<Dim>* gradients = nullptr);

/// p_p = sum_i N_i p_i.
template <int Dim, class Real = Pack>
void smooth_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Empty the outboxes before particles are located.
template <int Dim>
void clear_outboxes(Patch<Dim>& patch);

/// Take the particles that are no longer in their cell out of their bins, into Patch::movers.
/// Natural coordinates of the others.
template <int Dim, class Real = Pack>
void locate(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Find the cells of Patch::movers: they go to another bin, to a neighbour's outbox, or (where the
/// model says so) are removed.
template <int Dim>
void place_movers(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Record a fault of the first particle whose velocity or stress is not finite. locate() finds what
/// has reached a position; this finds the rest, before it is written.
template <int Dim>
void check_finite(Patch<Dim>& patch);

/// Smallest h / (c + |v|) over the particles [s], with h the cell's size, c = sqrt(M / density) the
/// material's longitudinal wave speed; a viscous fluid also h^2 density / (2 Dim 4/3 mu).
/// `limiting` (optional) receives the particle's position in the patch.
template <int Dim>
double time_step_limit(const Patch<Dim>& patch, const Model<Dim>& model,
                       std::span<const ParticleBin> bins, Local* limiting = nullptr);

}  // namespace lahar
