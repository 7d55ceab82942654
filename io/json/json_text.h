/// \file JSON that this program wrote once, and that anyone may have changed since.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace lahar {

/// Arrays and objects within each other: copying, comparing and writing them takes stack.
inline constexpr int most_json_depth = 100;

/// `text` as JSON; discarded (is_discarded()) where it is none, or deeper than most_json_depth.
template <class Json = nlohmann::json>
Json json_of_text(std::string_view text) {
  struct TooDeep {};
  try {
    return Json::parse(
        text,
        [](int depth, typename Json::parse_event_t, Json&) {
          if (depth > most_json_depth) throw TooDeep{};
          return true;
        },
        /*allow_exceptions=*/false);
  } catch (const TooDeep&) {
    return Json(Json::value_t::discarded);
  }
}

/// Member `key` of `object` if there is one and it is a text, otherwise "".
inline std::string text_in(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// Member `key` of `object` if there is one and it is a number, otherwise 0.
inline double number_in(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : 0;
}

/// Member `key` of `object`, null if there is none.
inline nlohmann::json member_of(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() ? *found : nlohmann::json{};
}

}  // namespace lahar
