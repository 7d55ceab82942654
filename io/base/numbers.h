/// \file Numbers as text.
#pragma once

#include <charconv>
#include <cmath>
#include <string>

#include "physics/base/types.h"

namespace lahar {

/// Append the shortest decimal number that reads back to the same bits; "nan" whatever its sign.
inline void append_number(std::string& text, double value) {
  if (std::isnan(value)) {
    text += "nan";
    return;
  }
  char digits[32];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

inline void append_number(std::string& text, Index value) {
  char digits[24];
  text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

}  // namespace lahar
