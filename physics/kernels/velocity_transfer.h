/// \file Nodal side of VelocityTransfer (model.h): the filter of higher orders.
///
/// With R = S+ S, interpolation to particles and mapping back to nodes, S S+ to any power is S
/// times a power of R, so that particles take S V_k of nodal velocities V_k,
///     V_1 = V,    V_j = V + V_{j-1} - R V_{j-1},
/// where V are the velocities that nodes have before forces act, or with FMPM after. Each order
/// above 1 is one more sum over particles and one exchange. As Nairn (2026) recommends, this is
/// done once per step, just before particles move, so that contact, walls and prescribed velocities
/// act on nodes as with any transfer; then they also act on each V_j. Positions move with the
/// velocities of nodes themselves.
///
/// C. C. Hammerquist, J. A. Nairn, A new method for material point method particle updates that
/// reduces noise and enhances stability, Comput. Methods Appl. Mech. Eng. 318 (2017) 724-738.
/// J. A. Nairn, C. C. Hammerquist, Material point method simulations using an approximate full mass
/// matrix inverse, Comput. Methods Appl. Mech. Eng. 377 (2021) 113667.
/// J. A. Nairn, Improved implementation of approximate full mass matrix inverse methods into
/// material point method simulations, arXiv 2604.07307 (2026).
#pragma once

#include "physics/model/transfer_options.h"
#include "physics/particles/patch.h"

namespace lahar {

/// The sum that has R V_{order - 1}.
constexpr NodeSum sum_of_order(int order) {
  return order % 2 == 0 ? NodeSum::smoothed : NodeSum::smoothed_again;
}

/// Patch::transfer = the velocities of nodes before forces act, for affine parts
/// (spreads_before_forces()).
template <int Dim>
void velocities_before_forces(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Patch::transfer = V, from the velocities and accelerations of the step.
template <int Dim>
void begin_filter(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Patch::transfer becomes V_order, and the mean viscosity of the node [m^2/s] in place of a mass,
/// from V_{order - 1}, with sums over all patches that share a
/// node.
template <int Dim>
void raise_filter(Patch<Dim>& patch, const StepContext<Dim>& step, int order);

/// Patch::transfer becomes what particles add to (1 - theta - theta_1 - S theta_i) v_p: theta V_k +
/// (theta_1 + theta_i) V + dt a, with FMPM (1 - theta - theta_1 - theta_i) dt a; and theta_i in
/// place of a mass.
template <int Dim>
void finish_filter(Patch<Dim>& patch, const StepContext<Dim>& step);

/// {m v, m nu}_i += sum_p N_i m_p {sum_j N_j(x_p) v_j, nu_p} with the velocities of Patch::transfer
/// and viscosities of particles (PressureViscosity), into the sum of an order.
template <int Dim, class Real = Pack>
void map_smoothed(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins, int order);

}  // namespace lahar
