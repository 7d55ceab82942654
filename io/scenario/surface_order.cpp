#include "io/scenario/surface_order.h"

#include <fmt/format.h>

namespace lahar {

namespace {

/// Whether one surface is above another at most places of a lattice where both are known.
template <int Dim>
bool is_above(const Surface<Dim>& one, const Surface<Dim>& other) {
  constexpr int places = Dim == 2 ? 1000 : 60;  // along an axis
  const Vec<Dim> low = one.bounds().first.cwiseMax(other.bounds().first);
  const Vec<Dim> size = one.bounds().second.cwiseMin(other.bounds().second) - low;
  int above = 0, below = 0;
  Vec<Dim> x = low;
  for (int j = 0; j < (Dim == 2 ? 1 : places); ++j)
    for (int i = 0; i < places; ++i) {
      x[0] = low[0] + size[0] * (i + 0.5) / places;
      if constexpr (Dim == 3) x[1] = low[1] + size[1] * (j + 0.5) / places;
      const double difference = one.height(x) - other.height(x);
      above += difference > 0 ? 1 : 0;
      below += difference < 0 ? 1 : 0;
    }
  return above > below;
}

template <int Dim>
const Surface<Dim>* surface_of(const JsonValue& name, const Geometries<Dim>& geometries) {
  if (!name.is<std::string>()) return nullptr;
  const auto at = geometries.find(name.as<std::string>());
  return at == geometries.end() ? nullptr : at->second.surface.get();
}

}  // namespace

template <int Dim>
std::string wrong_order(const JsonValue& region, const Geometries<Dim>& geometries) {
  std::string found;
  if (region.is<JsonValue::Array>())
    for (const JsonValue& part : region.as<JsonValue::Array>())
      if (found.empty()) found = wrong_order<Dim>(part, geometries);
  if (!region.is<JsonValue::Object>()) return found;
  for (const JsonValue::Member& member : region.as<JsonValue::Object>()) {
    if (!found.empty()) break;
    const bool between = member.key == "between" && member.value.is<JsonValue::Array>() &&
                         member.value.as<JsonValue::Array>().size() == 2;
    if (!between) {
      found = wrong_order<Dim>(member.value, geometries);
      continue;
    }
    const auto& names = member.value.as<JsonValue::Array>();
    const auto* first = surface_of<Dim>(names[0], geometries);
    const auto* second = surface_of<Dim>(names[1], geometries);
    if (first && second && is_above<Dim>(*first, *second))
      found = fmt::format("'{0}' is above '{1}': the lower surface comes first in 'between'",
                          names[0].as<std::string>(), names[1].as<std::string>());
  }
  return found;
}

bool names_surface(const JsonValue& region) {
  if (region.is<JsonValue::Array>())
    for (const JsonValue& part : region.as<JsonValue::Array>())
      if (names_surface(part)) return true;
  if (!region.is<JsonValue::Object>()) return false;
  for (const auto& [key, offset, value] : region.as<JsonValue::Object>())
    if (key == "below" || key == "between" || names_surface(value)) return true;
  return false;
}

template std::string wrong_order<2>(const JsonValue&, const Geometries<2>&);
template std::string wrong_order<3>(const JsonValue&, const Geometries<3>&);

}  // namespace lahar
