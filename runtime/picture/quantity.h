/// \file Numbers and units as people read them.
#pragma once

#include <string>
#include <string_view>

namespace lahar {

/// A unit with a prefix (kPa, mm), or with a power of ten, for values up to a size.
struct UnitScale {
  double factor = 1;  ///< values times this are in `unit`
  std::string unit;   ///< "" without one
};

/// For fields, axes and tables. `unit` as frames and history have it; "-" and "" are none.
UnitScale unit_scale(double largest, std::string_view unit);

/// "name [unit]", "name" without a unit.
std::string with_unit(std::string_view name, std::string_view unit);

/// With so many significant digits, without zeros at the end: 1,234  0.00123  1.2e-09.
std::string short_number(double value, int digits = 4);

/// A value with its unit and prefix: "12.3 kPa".
std::string quantity(double value, std::string_view unit, int digits = 4);

/// A value at a grid line, as exact as the distance of lines asks for.
std::string tick_label(double value, double step);

}  // namespace lahar
