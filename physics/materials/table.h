/// \file What a material says of itself: its parameters and state variables, as data that io/
/// reads.
#pragma once

#include <array>
#include <cstdio>
#include <string>
#include <string_view>

#include "physics/base/parameter.h"

namespace lahar {

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
