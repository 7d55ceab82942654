/// \file Particles of axisymmetric models are rings: x is the radius r, y runs along the axis, and
/// volumes, masses and forces are those of the whole circle. A ring that moves outwards stretches
/// along its circle at the rate v_r / r, and its stress there pulls its nodes inwards:
///
///     L_tt = sum_i R_i v_ir,    f_ir -= V_p sigma_tt R_i,
///     R_i = N_i / r_p,          r_p = sum_i N_i r_i.
///
/// r_p is where the functions are taken, also where the particle has moved on. So forces do exactly
/// the work of the stresses. Volumetric strains of fluids are those at particles: that at a cell's
/// centre would not balance the weight of rings, which differs within a cell.
///
/// B-splines bend within a particle of the half width l. With the mean of d(r N_i)/dr over it in
/// place of what it is in its middle, an even pressure has no resultant, next to the axis, too,
/// where functions end:
///
///     R_i = ((r N_i)(r_p + l) - (r N_i)(r_p - l)) / (2 l r_p) - dN_i/dr,    l^2 = V_p / (8 pi r_p)
///
/// as far as the particle lies within its cell.
#pragma once

#include <numbers>

#include "physics/kernels/particle_sums.h"
#include "physics/kernels/velocity_gradients.h"

namespace lahar {

/// Finds R_i r_p of `count` particles, the first of which is p. Returns r_p [m].
template <class Real, class Basis>
LAHAR_INLINE Real ring_functions(const Basis& basis, const Patch<2>& patch, Local p, Local count,
                                 const Local* nodes, Real (&R)[Basis::nodes]) {
  constexpr double least = 1e-3;  // of the cell
  basis.functions(p, R);
  Real r(0.0);
  for (int i = 0; i < Basis::nodes; ++i)
    r = multiply_add(r, R[i],
                     &patch.node_position[static_cast<std::size_t>(nodes[i]) * node_width]);
  if constexpr (requires { basis.functions_beside(p, r, R); }) {
    const double cell = basis.cell_length(0);
    const Real V = load_first<Real>(patch.particles.row(Column::volume) + p, count);
    Real place[2];
    basis.place(p, place);
    const Real room = 0.5 - abs(place[0] - 0.5);  // to the nearer side of the cell, in cells
    // Lanes without a particle may have any radius.
    const Real square = first_lanes(Real(V / (8 * std::numbers::pi * cell * cell * r)), count);
    const Real width = sqrt(square);
    const Real half = max(Real(least), -max(-width, -room));
    const unsigned wide = outside(room, least, lanes<Real>);
    Real outer[Basis::nodes], inner[Basis::nodes], slopes[2][Basis::nodes];
    basis.functions_beside(p, half, outer);
    basis.functions_beside(p, -half, inner);
    basis.gradients(p, slopes);
    const Real l = cell * half, per_width = 0.5 / l, r_out = r + l, r_in = r - l;
    for (int i = 0; i < Basis::nodes; ++i)
      R[i] =
          select(wide, per_width * (r_out * outer[i] - r_in * inner[i]) - r * slopes[0][i], R[i]);
  }
  return r;
}

/// VelocityGradients::hoop of a nodal field v, and its share of the trace. `factor` makes a
/// velocity of the field.
template <class Real = Pack>
void add_hoop_rates(const Patch<2>& patch, ParticleBins bins, const double* v,
                    VelocityGradients<2>& gradients, double factor = 1.0);

/// The forces of stresses along the circles of the particles of one bin.
template <class Real>
void map_hoop_force(Patch<2>& patch, const StepContext<2>& step, ParticleBin& bin,
                    const general::ParticleStress<2>& stress);

}  // namespace lahar
