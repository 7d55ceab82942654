/// \file Particles of axisymmetric models are rings: x is the radius r, y runs along the axis, and
/// volumes, masses and forces are those of the whole circle. A ring that moves outwards stretches
/// along its circle at the rate v_r / r, and its stress there pulls its nodes inwards:
///
///     L_tt = sum_i N_i v_ir / r_p,    f_ir -= V_p sigma_tt N_i / r_p,    r_p = sum_i N_i r_i.
///
/// r_p is where the functions are taken, also where the particle has moved on. So forces do exactly
/// the work of the stresses. Volumetric strains of fluids are those at particles: that at a cell's
/// centre would not balance the weight of rings, which differs within a cell.
#pragma once

#include "physics/kernels/particle_sums.h"
#include "physics/kernels/velocity_gradients.h"

namespace lahar {

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
