#include "physics/materials/law.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace lahar {

std::span<const StateVariable> state_variables(const Law& law) {
  return std::visit(
      [](const auto& m) { return std::span<const StateVariable>(m.state.data(), m.state.size()); },
      law);
}

std::vector<const StateVariable*> state_variables(std::span<const Material> materials) {
  std::vector<const StateVariable*> all;
  for (const Material& m : materials)
    for (const StateVariable& variable : state_variables(m.law))
      if (std::none_of(all.begin(), all.end(),
                       [&](const StateVariable* other) { return other->name == variable.name; }))
        all.push_back(&variable);
  return all;
}

std::size_t most_state_variables(std::span<const Material> materials) {
  std::size_t most = 0;
  for (const Material& m : materials) most = std::max(most, state_variables(m.law).size());
  return most;
}

void initial_state(const Law& law, const Voigt& stress, double* state) {
  std::visit(
      [&](const auto& m) {
        std::fill_n(state, m.state.size(), 0.0);
        if constexpr (requires { m.initial_state(stress.data(), state); })
          m.initial_state(stress.data(), state);
      },
      law);
}

void follow_parameters(const Law& law, double* state) {
  std::visit(
      [&](const auto& m) {
        if constexpr (requires { m.follow_parameters(state); }) m.follow_parameters(state);
      },
      law);
}

void derive_state(const Law& law, const Voigt& stress, double* state) {
  std::visit(
      [&](const auto& m) {
        if constexpr (requires { m.derive(stress.data(), state); }) m.derive(stress.data(), state);
      },
      law);
}

bool has_pressure(const Law& law) {
  return std::visit([]<class LawType>(const LawType&) { return pressure_is_state<LawType>; }, law);
}

bool can_open(const Law& law) {
  return std::visit(
      [](const auto& m) {
        if constexpr (requires { m.has_tension_limit(); })
          return m.has_tension_limit();
        else
          return false;
      },
      law);
}

double wave_modulus(const Law& law) {
  return std::visit([](const auto& m) { return m.wave_modulus(); }, law);
}

double wave_speed(const Material& material) {
  const double modulus = wave_modulus(material.law);
  if (!material.liquid) return std::sqrt(modulus / material.density);
  return std::sqrt(
      wave_speed_squared(*material.liquid, modulus, Scalar(1.0 / material.density))[0]);
}

double shear_wave_modulus(const Law& law) {
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

namespace {

/// The reference code has one stiffness for a material.
template <class LawType>
bool follows_stress(const LawType& law) {
  if constexpr (requires { &LawType::wave_moduli; })
    return !law.as_cbgeo;
  else
    return false;
}

}  // namespace

bool stiffness_follows_stress(const Law& law) {
  return std::visit([](const auto& m) { return follows_stress(m); }, law);
}

WaveModuli wave_moduli(const Law& law, const Voigt& stress, const double* state) {
  return std::visit(
      [&](const auto& m) -> WaveModuli {
        const double most = m.wave_modulus();
        if constexpr (requires { m.wave_moduli(stress, state); })
          if (follows_stress(m)) {
            const WaveModuli at = m.wave_moduli(stress, state);
            const double share = std::min(1.0, most / at.compression);
            return {share * at.compression, share * at.shear};
          }
        return {most, shear_wave_modulus(law)};
      },
      law);
}

double viscosity(const Law& law) {
  return std::visit([](const auto& m) { return 4.0 / 3.0 * m.viscosity(); }, law);
}

}  // namespace lahar
