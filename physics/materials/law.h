/// \file What may be asked of any constitutive law.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <type_traits>
#include <vector>

#include "physics/materials/material.h"

namespace lahar {

/// The state variables of a law, in the order of their components of Column::state.
inline std::span<const StateVariable> state_variables(const Law& law) {
  return std::visit(
      [](const auto& m) { return std::span<const StateVariable>(m.state.data(), m.state.size()); },
      law);
}

/// Those of some materials, each name once, in the order in which they occur.
inline std::vector<const StateVariable*> state_variables(std::span<const Material> materials) {
  std::vector<const StateVariable*> all;
  for (const Material& m : materials)
    for (const StateVariable& variable : state_variables(m.law))
      if (std::none_of(all.begin(), all.end(),
                       [&](const StateVariable* other) { return other->name == variable.name; }))
        all.push_back(&variable);
  return all;
}

/// The most that any of some materials has.
inline std::size_t most_state_variables(std::span<const Material> materials) {
  std::size_t most = 0;
  for (const Material& m : materials) most = std::max(most, state_variables(m.law).size());
  return most;
}

/// State of a particle before its first step; `state` has room for state_variables().
inline void initial_state(const Law& law, const Voigt& stress, double* state) {
  std::visit(
      [&](const auto& m) {
        std::fill_n(state, m.state.size(), 0.0);
        if constexpr (requires { m.initial_state(stress.data(), state); })
          m.initial_state(stress.data(), state);
      },
      law);
}

/// Set the state variables that follow from the law's parameters and from other state variables:
/// where a particle goes on with parameters that may be others.
inline void follow_parameters(const Law& law, double* state) {
  std::visit(
      [&](const auto& m) {
        if constexpr (requires { m.follow_parameters(state); }) m.follow_parameters(state);
      },
      law);
}

/// Set the state variables that follow from the stress.
inline void derive_state(const Law& law, const Voigt& stress, double* state) {
  std::visit(
      [&](const auto& m) {
        if constexpr (requires { m.derive(stress.data(), state); }) m.derive(stress.data(), state);
      },
      law);
}

/// What update() takes for a law: the law itself, or what it computes once for many particles.
template <class LawType>
LAHAR_INLINE auto prepare(const LawType& law) {
  if constexpr (requires { law.prepared(); })
    return law.prepared();
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
inline bool has_pressure(const Law& law) {
  return std::visit([]<class LawType>(const LawType&) { return pressure_is_state<LawType>; }, law);
}

/// True if gaps may open in the law's material (physics/kernels/opening.h).
inline bool can_open(const Law& law) {
  return std::visit(
      [](const auto& m) {
        if constexpr (requires { m.has_tension_limit(); })
          return m.has_tension_limit();
        else
          return false;
      },
      law);
}

/// Modulus of longitudinal waves M [Pa]; wave speed c = sqrt(M / density).
inline double wave_modulus(const Law& law) {
  return std::visit([](const auto& m) { return m.wave_modulus(); }, law);
}

/// Speed of the fastest wave at the beginning [m/s].
inline double wave_speed(const Material& material) {
  const double modulus = wave_modulus(material.law);
  if (!material.liquid) return std::sqrt(modulus / material.density);
  return std::sqrt(
      wave_speed_squared(*material.liquid, modulus, Scalar(1.0 / material.density))[0]);
}

/// Modulus of shear waves G [Pa], from M and Poisson's ratio; 0 for fluids.
inline double shear_wave_modulus(const Law& law) {
  return std::visit(
      [](const auto& m) {
        if constexpr (requires { m.poisson_ratio; } &&
                      !std::is_same_v<std::decay_t<decltype(m)>, Bingham>)
          return m.wave_modulus() * (1.0 - 2.0 * m.poisson_ratio) / (2.0 - 2.0 * m.poisson_ratio);
        else
          return 0.0;
      },
      law);
}

/// Viscosity 4/3 mu [Pa s] of longitudinal motion, whose diffusion limits the step too; 0 for
/// solids.
inline double viscosity(const Law& law) {
  return std::visit([](const auto& m) { return 4.0 / 3.0 * m.viscosity(); }, law);
}

}  // namespace lahar
