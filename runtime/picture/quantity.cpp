#include "runtime/picture/quantity.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace lahar {

namespace {

/// Units that take prefixes. In products and quotients the first unit takes it.
constexpr std::array prefixed{
    std::string_view("Pa"),  std::string_view("J"),  std::string_view("N"), std::string_view("W"),
    std::string_view("N m"), std::string_view("s"),  std::string_view("m"), std::string_view("m/s"),
    std::string_view("J/m"), std::string_view("N/m")};

/// Lengths and times take no multiples: 1200 m, 300 s.
bool has_multiples(std::string_view unit) {
  return unit[0] != 's' && unit[0] != 'm';
}

std::string superscript(int power) {
  static constexpr std::array digits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = power < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(power)))
    text += digits[static_cast<std::size_t>(c - '0')];
  return text;
}

}  // namespace

UnitScale unit_scale(double largest, std::string_view unit) {
  if (unit == "-") unit = "";
  const double size = std::abs(largest);
  if (size == 0 || !std::isfinite(size)) return {1, std::string(unit)};
  int thousands = static_cast<int>(std::floor(std::log10(size) / 3.0 + 1e-9));
  if (size >= 0.1 && size < 1) thousands = 0;  // 0.35 m/s
  if (std::find(prefixed.begin(), prefixed.end(), unit) != prefixed.end()) {
    static constexpr std::array names{"n", "µ", "m", "", "k", "M", "G", "T"};
    const int k = std::clamp(thousands, -3, has_multiples(unit) ? 4 : 0);
    return {std::pow(1000.0, -k), names[static_cast<std::size_t>(k + 3)] + std::string(unit)};
  }
  if (size < 1e5 && size >= 1e-2) return {1, std::string(unit)};
  const int power = 3 * thousands;
  const std::string ten = "10" + superscript(power);
  return {std::pow(10.0, -power), unit.empty() ? ten : fmt::format("{} {}", ten, unit)};
}

std::string with_unit(std::string_view name, std::string_view unit) {
  return unit.empty() || unit == "-" ? std::string(name) : fmt::format("{} [{}]", name, unit);
}

std::string short_number(double value, int digits) {
  if (std::isnan(value)) return "–";
  if (std::isinf(value)) return value > 0 ? "∞" : "−∞";
  std::string text = fmt::format("{:.{}g}", value, digits);
  if (std::abs(value) >= 1000 && std::abs(value) < 1e6 && text.find('e') != std::string::npos)
    text = fmt::format("{:.0f}", value);
  if (text.find_first_of("e.") == std::string::npos) {
    const std::size_t first = text[0] == '-' ? 1 : 0;
    for (std::size_t at = text.size(); at > first + 3;) text.insert(at -= 3, ",");
  }
  if (text[0] == '-') text = "−" + text.substr(1);
  return text;
}

std::string quantity(double value, std::string_view unit, int digits) {
  const UnitScale scale = unit_scale(value, unit);
  const std::string number = short_number(value * scale.factor, digits);
  if (scale.unit.empty()) return number;
  return number + (scale.unit.starts_with("10") ? " × " : " ") + scale.unit;
}

std::string tick_label(double value, double step) {
  if (std::abs(value) < 1e-9 * step) return "0";
  const double size = std::max(std::abs(value), step);
  if (size >= 1e6 || size < 1e-3) return short_number(value, 3);
  const int after = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  const std::string text = fmt::format("{:.{}f}", std::abs(value), after);
  return (value < 0 ? "−" : "") + (after == 0 ? short_number(std::stod(text), 7) : text);
}

}  // namespace lahar
