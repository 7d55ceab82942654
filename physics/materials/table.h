/// \file What a material says of itself: its parameters and state variables, as data that io/
/// reads. The input's keys, bounds, help, JSON Schema and reference page follow from these tables.
#pragma once

#include <array>
#include <cstdio>
#include <limits>
#include <string>
#include <string_view>

namespace lahar {

/// Values of a parameter that are allowed.
enum class Bound {
  none,
  positive,      ///< > 0
  not_negative,  ///< >= 0
  angle,         ///< [0, 90) degrees
  poisson,       ///< (-1, 0.5)
};

/// What an optional parameter is where the scenario does not say.
struct Default {
  double value;
};
/// An optional parameter without a default: it is NaN where the scenario does not say.
inline constexpr Default no_default{std::numeric_limits<double>::quiet_NaN()};

/// A row of a material's parameter table. Without a default the key is required; a flag is false
/// where the scenario does not say.
template <class Material>
struct Parameter {
  std::string_view key;   ///< in the scenario
  std::string_view unit;  ///< "-" dimensionless; angles are in degrees
  std::string_view help;
  double Material::*number = nullptr;  ///< the member that is set; one of the two is null
  bool Material::*flag = nullptr;
  Bound bound = Bound::none;
  bool required = false;
  double fallback = no_default.value;

  constexpr Parameter(std::string_view k, std::string_view u, std::string_view h,
                      double Material::*member, Bound b)
      : key(k), unit(u), help(h), number(member), bound(b), required(true) {}
  constexpr Parameter(std::string_view k, std::string_view u, std::string_view h,
                      double Material::*member, Bound b, Default d)
      : key(k), unit(u), help(h), number(member), bound(b), fallback(d.value) {}
  constexpr Parameter(std::string_view k, std::string_view h, bool Material::*member)
      : key(k), help(h), flag(member) {}
};

/// A number that a particle carries for its material: a component of Column::state.
struct StateVariable {
  std::string_view name;  ///< of its field in frames
  std::string_view unit;
  std::string_view help;
  /// It is a function of the stress alone: the law does not keep it, derive() gives it for output.
  bool of_stress = false;
};
using NoState = std::array<StateVariable, 0>;

/// A number for a message of Material::problem().
inline std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace lahar
