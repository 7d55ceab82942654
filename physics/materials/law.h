/// \file What may be asked of any constitutive law.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "physics/materials/material.h"

namespace lahar {

/// The state variables of a law, in the order of their components of Column::state.
std::span<const StateVariable> state_variables(const Law& law);

/// Those of some materials, each name once, in the order in which they occur.
std::vector<const StateVariable*> state_variables(std::span<const Material> materials);

/// The most that any of some materials has.
std::size_t most_state_variables(std::span<const Material> materials);

/// State of a particle before its first step; `state` has room for state_variables().
void initial_state(const Law& law, const Voigt& stress, double* state);

/// Set the state variables that follow from the law's parameters and from other state variables:
/// where a particle goes on with parameters that may be others.
void follow_parameters(const Law& law, double* state);

/// Set the state variables that follow from the stress.
void derive_state(const Law& law, const Voigt& stress, double* state);

/// What update() takes for a law: the law itself, or what it computes once for many particles.
template <class LawType>
LAHAR_INLINE auto prepare(const LawType& law) {
  if constexpr (requires { law.prepared(); })
    return law.prepared();
  else
    return law;
}

/// The law of bodies with faces that bear no stress: the law itself, or one that allows a little
/// more than zero there.
template <class LawType>
LawType with_free_faces(const LawType& law) {
  if constexpr (requires { law.with_free_faces(); })
    return law.with_free_faces();
  else
    return law;
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

/// True if the law's first state variable is the pressure, which pressure smoothing averages.
bool has_pressure(const Law& law);

/// True if gaps may open in the law's material (physics/kernels/opening.h).
bool can_open(const Law& law);

/// Modulus of longitudinal waves M [Pa]; wave speed c = sqrt(M / density).
double wave_modulus(const Law& law);

/// Speed of the fastest wave at the beginning [m/s].
double wave_speed(const Material& material);

/// Modulus of shear waves G [Pa], from M and Poisson's ratio; 0 for fluids.
double shear_wave_modulus(const Law& law);

/// True if the stiffness of elastic waves depends on the stress.
bool stiffness_follows_stress(const Law& law);

/// Moduli of elastic waves at a stress; not more than wave_modulus(), which limits the time step.
/// Those of wave_modulus() and shear_wave_modulus() where stiffness does not follow the stress.
WaveModuli wave_moduli(const Law& law, const Voigt& stress, const double* state);

/// wave_moduli().compression of a law whose kind is known.
template <class LawType>
double compression_modulus(const LawType& law, const Voigt& stress, const double* state) {
  const double most = law.wave_modulus();
  if constexpr (requires { law.wave_moduli(stress, state); })
    if (!law.as_cbgeo) return std::min(most, law.wave_moduli(stress, state).compression);
  return most;
}

/// Viscosity 4/3 mu [Pa s] of longitudinal motion, whose diffusion limits the step too; 0 for
/// solids.
double viscosity(const Law& law);

}  // namespace lahar
