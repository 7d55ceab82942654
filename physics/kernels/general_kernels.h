/// \file The kernels of a step for bases other than linear Q4 and H8 (basis.h): what those of
/// kernels.h do for a patch that has topology.support_nodes.
#pragma once

#include "physics/basis/support.h"
#include "physics/kernels/particle_sums.h"
#include "physics/kernels/pressure_viscosity.h"
#include "physics/kernels/velocity_gradients.h"

namespace lahar::general {

/// {m v, m}_i += sum_p N_i {m_p v_p, m_p} into nodal sums.
template <int Dim, class Real>
void map_momentum(Patch<Dim>& patch, ParticleBins bins, const ParticleMomentum<Dim>& particle,
                  double* sums);

/// (m p)_i += sum_p N_i m_p p_p over bins whose law has a pressure.
template <int Dim, class Real>
void map_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins, double* sums);

/// f_i += -sum_p V_p sigma_p grad N_i + tractions.
template <int Dim, class Real>
void map_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
               ParticleStress<Dim> stress, double* sums);

/// g_i += sum_p V_p grad N_i with the row V.
template <int Dim, class Real>
void map_gradient(Patch<Dim>& patch, ParticleBins bins, const double* V, double* sums);

/// {m v, m nu}_i += sum_p N_i m_p {sum_j N_j v_j, nu_p} with the velocities of Patch::transfer.
template <int Dim, class Real>
void map_smoothed(Patch<Dim>& patch, const PressureViscosity<Dim>& viscosity, ParticleBins bins,
                  double* sums);

/// The same of the first four for quadratic splines in 3D.
template <class Real>
void map_spline_momentum(Patch<3>& patch, ParticleBins bins, const ParticleMomentum<3>& particle,
                         double* sums);
template <class Real>
void map_spline_pressure(Patch<3>& patch, const StepContext<3>& step, ParticleBins bins,
                         double* sums);
template <class Real>
void map_spline_force(Patch<3>& patch, const StepContext<3>& step, ParticleBins bins,
                      ParticleStress<3> stress, double* sums);
template <class Real>
void map_spline_gradient(Patch<3>& patch, ParticleBins bins, const double* V, double* sums);

/// The same but for pressures, with domains that have corners (CPDI) and no affine velocities.
template <int Dim, class Real>
void map_domain_momentum(Patch<Dim>& patch, ParticleBins bins,
                         const ParticleMomentum<Dim>& particle, double* sums);
template <int Dim, class Real>
void map_domain_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      ParticleStress<Dim> stress, double* sums);
template <int Dim, class Real>
void map_domain_gradient(Patch<Dim>& patch, ParticleBins bins, const double* V, double* sums);

/// Velocities and places of particles; `gradients` (optional) as in kernels.h.
template <int Dim, class Real>
void update_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      VelocityGradients<Dim>* gradients);

/// Fill `gradients` for these bins, with those of the nodal velocities v.
template <int Dim, class Real>
void find_gradients(const Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                    const double* v, VelocityGradients<Dim>& gradients);

/// The same two with domains that have corners, the first without affine velocities.
template <int Dim, class Real>
void update_domain_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                             VelocityGradients<Dim>* gradients);
template <int Dim, class Real>
void find_domain_gradients(const Patch<Dim>& patch, ParticleBins bins, const double* v,
                           VelocityGradients<Dim>& gradients);

/// Whether particles have domains with corners.
template <int Dim>
bool has_corners(const Patch<Dim>& patch) {
  return patch.basis == BasisKind::cpdi || patch.basis == BasisKind::cpdi2;
}

}  // namespace lahar::general
