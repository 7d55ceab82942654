/// \file Stress of models in two dimensions that deform across their plane. Laws see them in three
/// dimensions without shear across the plane, so no law has to know of them:
///
///     axisymmetric   the strain rate around the axis is v_r / r (ring.h);
///     plane stress   the strain rate across the sheet is that for which its stress there is zero
///                    at the end of the step (free_strain.h). So volumes follow its thickness. A
///                    particle whose law has no such stress ends the run.
#pragma once

#include "physics/kernels/velocity_gradients.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Velocity gradients of particles as update_stress_across() takes them; `trace` is what volumes
/// follow. In plane stress it is that in the plane.
template <class Real = Pack>
void find_gradients_across(const Patch<2>& patch, const StepContext<2>& step, ParticleBins bins,
                           VelocityGradients<2>& gradients);

/// update_stress() of models in two dimensions that deform across their plane.
template <class Real = Pack>
void update_stress_across(Patch<2>& patch, const StepContext<2>& step, ParticleBins bins,
                          const VelocityGradients<2>& gradients);

}  // namespace lahar
