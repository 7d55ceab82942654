/// \file Constitutive laws: value types, one call per pack of particles of one material.
/// A new law is one struct in model.h, one update() here and its name in the scenario's material
/// table.
#pragma once

#include <algorithm>
#include <cmath>

#include "physics/model.h"
#include "physics/simd.h"

namespace lahar {

/// What a law sees of a pack of particles. Voigt rows: 2D xx yy zz xy, 3D xx yy zz xy yz xz.
template <int Dim, class Real>
struct LawInput {
  static constexpr int rows = stress_components<Dim>;
  Real rate[rows];    ///< strain rate [1/s], engineering shear; 2D: zz = 0
  double dt;          ///< [s]
  Real volumetric;    ///< volumetric strain increment at the cell's centre [-]; splines: at the
                      ///< particle
};

/// Isotropic Hooke's law in rate form, sigma += lambda tr(de) I + 2 G de (engineering shear: G).
/// 2D is plane strain, so sigma_zz follows.
template <int Dim, class Real>
LAHAR_INLINE void update(const LinearElastic& m, const LawInput<Dim, Real>& in, Real* stress,
                         Real*) {
  const double G = m.youngs_modulus / (2.0 * (1.0 + m.poisson_ratio));
  const double lambda = m.youngs_modulus * m.poisson_ratio /
                        ((1.0 + m.poisson_ratio) * (1.0 - 2.0 * m.poisson_ratio));
  Real trace = in.rate[0] + in.rate[1];
  if constexpr (Dim == 3) trace += in.rate[2];
  const Real volumetric = (lambda * in.dt) * trace;
  LAHAR_UNROLL
  for (int k = 0; k < 3; ++k) {
    if (Dim == 2 && k == 2)
      stress[k] += volumetric;
    else
      stress[k] += volumetric + (2.0 * G * in.dt) * in.rate[k];
  }
  LAHAR_UNROLL
  for (int k = 3; k < in.rows; ++k) stress[k] += (G * in.dt) * in.rate[k];
}

/// True if strain is a function of stress, so that it need not be stored where the initial stress
/// is zero: laws linear in the strain increment.
inline bool strain_follows_from_stress(const Law& law) {
  return std::holds_alternative<LinearElastic>(law);
}

/// Strain (engineering shear; rows as in a stress) of a linear elastic material without initial
/// stress: Hooke's law inverted. It differs from the sum of a run's increments by rounding.
template <int Dim>
std::array<double, stress_components<Dim>> strain_of(
    const LinearElastic& m, const std::array<double, stress_components<Dim>>& stress) {
  const double E = m.youngs_modulus, nu = m.poisson_ratio;
  std::array<double, stress_components<Dim>> strain{};
  if constexpr (Dim == 2) {  // plane strain: e_zz = 0
    strain[0] = (1 + nu) / E * ((1 - nu) * stress[0] - nu * stress[1]);
    strain[1] = (1 + nu) / E * ((1 - nu) * stress[1] - nu * stress[0]);
  } else {
    for (std::size_t k = 0; k < 3; ++k)
      strain[k] = (stress[k] - nu * (stress[(k + 1) % 3] + stress[(k + 2) % 3])) / E;
  }
  for (std::size_t k = 3; k < stress_components<Dim>; ++k) strain[k] = 2 * (1 + nu) / E * stress[k];
  return strain;
}

/// Weakly compressible Newtonian fluid (CB-Geo MPM, theory/material): p -= K d(eps_v) with the
/// volumetric increment at the cell's centre; sigma = -p I + 2 mu (rate - tr(rate)/3 I).
/// 2D: sigma_zz carries no deviatoric term beyond -2/3 mu tr(rate), which is what it is at rate_zz
/// = 0.
template <int Dim, class Real>
LAHAR_INLINE void update(const Newtonian& m, const LawInput<Dim, Real>& in, Real* stress,
                         Real* pressure) {
  const double compressible = m.incompressible ? 0.0 : 1.0;
  const double mu = m.dynamic_viscosity;
  Real trace = in.rate[0] + in.rate[1];
  if constexpr (Dim == 3) trace += in.rate[2];
  *pressure -= compressible * m.bulk_modulus * in.volumetric;
  const Real volumetric = compressible * (-*pressure - (2.0 / 3.0) * mu * trace);
  LAHAR_UNROLL
  for (int k = 0; k < 3; ++k) {
    if (Dim == 2 && k == 2)
      stress[k] = volumetric;
    else
      stress[k] = volumetric + (2.0 * mu) * in.rate[k];
  }
  LAHAR_UNROLL
  for (int k = 3; k < in.rows; ++k) stress[k] = mu * in.rate[k];
}

/// True if the law has the state variable `pressure`, which pressure smoothing averages.
inline bool has_pressure(const Law& law) {
  return std::holds_alternative<Newtonian>(law);
}

/// Modulus of longitudinal waves M [Pa]; wave speed c = sqrt(M / density).
inline double wave_modulus(const Law& law) {
  struct {
    double operator()(const LinearElastic& m) const {
      return m.youngs_modulus * (1.0 - m.poisson_ratio) /
             ((1.0 + m.poisson_ratio) * (1.0 - 2.0 * m.poisson_ratio));
    }
    double operator()(const Newtonian& m) const { return m.incompressible ? 0.0 : m.bulk_modulus; }
  } modulus;
  return std::visit(modulus, law);
}

/// Viscosity 4/3 mu [Pa s] of longitudinal motion, whose diffusion limits the step too; 0 for
/// solids.
inline double viscosity(const Law& law) {
  const auto* fluid = std::get_if<Newtonian>(&law);
  return fluid ? 4.0 / 3.0 * fluid->dynamic_viscosity : 0.0;
}

}  // namespace lahar
