/// \file Explicit steps in which volumes of the particles of a cell change alike (B-bar), so that
/// material whose volume can hardly change does not lock.
///
/// The volumetric part of a velocity gradient becomes its mean over the particles of a bin,
/// weighted by their volumes (Hughes 1980; for material points Coombs et al. 2018):
///
///     L_p' = L_p + (m - tr L_p) / Dim I,   m = sum_q V_q tr L_q / sum_q V_q.
///
/// Forces have to do the work of the stresses, sum_p V_p sigma_p : L_p'. The mean is a projection
/// that is its own transpose, so this is sum_p V_p sigma_p' : L_p, and the internal force is that
/// of
///
///     sigma_p' = sigma_p + (s - tr sigma_p / Dim) I,   s = sum_q V_q tr sigma_q / (Dim sum_q V_q),
///
/// with traces of Dim components, and of three in axisymmetric models, in place of Dim too. F-bar
/// (de Souza Neto et al. 1996) scales F_p by (mean J / J_p)^(1 / Dim). That is the same in the
/// limit of short increments, which those of explicit steps are.
///
/// Fluids with the functions of Q4 and H8 keep what they have without B-bar: their volumes change
/// as that of the cell's centre does, and their pressure acts there (p2g.cpp). With a mean over
/// particles, still water would gather where its cells are open.
#pragma once

#include "physics/kernels/general_kernels.h"
#include "physics/kernels/velocity_gradients.h"
#include "physics/materials/law.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Whether volume and pressure of the particles of a bin are those of the cell's centre.
template <int Dim>
bool acts_at_centre(const Patch<Dim>& patch, const StepContext<Dim>& step, const ParticleBin& bin) {
  const Analysis& analysis = step.model->analysis;
  return !general::is(patch) && !analysis.volume_as_cbgeo &&
         analysis.plane != Plane::axisymmetric &&
         has_pressure(step.model->materials[bin.material].law);
}

/// L' in place of L.
template <int Dim, class Real = Pack>
void take_mean_volume(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      VelocityGradients<Dim>& gradients);

/// L' of the nodal velocities.
template <int Dim, class Real = Pack>
void find_mean_gradients(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                         VelocityGradients<Dim>& gradients);

/// map_force() with sigma'. Bins must have all their particles.
template <int Dim, class Real = Pack>
void map_mean_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

}  // namespace lahar
