/// \file Typed access to values that the key tables have checked.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/json/json_source.h"
#include "physics/base/types.h"

namespace lahar {

inline std::optional<double> get_number(const JsonValue& object, std::string_view key) {
  const JsonValue* v = object.find(key);
  return v && v->is_number() ? std::optional(v->number()) : std::nullopt;
}

inline std::optional<Index> get_integer(const JsonValue& object, std::string_view key) {
  const JsonValue* v = object.find(key);
  if (!v || !v->is_number()) return std::nullopt;
  return v->is<std::int64_t>() ? v->as<std::int64_t>() : static_cast<Index>(v->number());
}

inline std::optional<bool> get_bool(const JsonValue& object, std::string_view key) {
  const JsonValue* v = object.find(key);
  return v && v->is<bool>() ? std::optional(v->as<bool>()) : std::nullopt;
}

inline std::optional<std::string> get_text(const JsonValue& object, std::string_view key) {
  const JsonValue* v = object.find(key);
  return v && v->is<std::string>() ? std::optional(v->as<std::string>()) : std::nullopt;
}

/// 0, 1 or 2 from a number or "x", "y", "z".
inline std::optional<int> get_direction(const JsonValue& object, std::string_view key) {
  const JsonValue* v = object.find(key);
  if (!v) return std::nullopt;
  if (v->is<std::string>()) return v->as<std::string>()[0] - 'x';
  return static_cast<int>(v->number());
}

inline std::vector<double> get_numbers(const JsonValue& object, std::string_view key) {
  std::vector<double> out;
  if (const JsonValue* v = object.find(key); v && v->is<JsonValue::Array>())
    for (const auto& item : v->as<JsonValue::Array>())
      if (item.is_number()) out.push_back(item.number());
  return out;
}

inline std::vector<std::string> get_texts(const JsonValue& object, std::string_view key) {
  std::vector<std::string> out;
  if (const JsonValue* v = object.find(key); v && v->is<JsonValue::Array>())
    for (const auto& item : v->as<JsonValue::Array>())
      if (item.is<std::string>()) out.push_back(item.as<std::string>());
  return out;
}

template <int Dim>
std::optional<Vec<Dim>> get_vector(const JsonValue& object, std::string_view key) {
  const auto numbers = get_numbers(object, key);
  if (static_cast<int>(numbers.size()) != Dim) return std::nullopt;
  return Vec<Dim>(numbers.data());
}

/// Whether the user wrote the key, validly or not.
inline bool written(const JsonValue& object, std::string_view key) {
  if (!object.is<JsonValue::Object>()) return false;
  for (const auto& member : object.as<JsonValue::Object>())
    if (member.key == key) return true;
  return false;
}

/// The elements of an array of objects that are still valid; none if there is no such array.
inline std::vector<const JsonValue*> get_list(const JsonValue& object, std::string_view key) {
  std::vector<const JsonValue*> out;
  if (const JsonValue* v = object.find(key); v && v->is<JsonValue::Array>())
    for (const auto& item : v->as<JsonValue::Array>())
      if (item.is<JsonValue::Object>()) out.push_back(&item);
  return out;
}

}  // namespace lahar
