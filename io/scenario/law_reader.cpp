#include "io/scenario/law_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/schema/keys.h"

namespace lahar {

namespace {

// A law from the keys of its table. What stands for bad values, which were reported, is not used.
template <class LawType>
LawType law_of(const JsonValue& m, const ScenarioInput& in) {
  LawType law{};
  for (const auto& p : LawType::parameters) {
    if (p.flag) law.*p.flag = get_bool(m, p.key).value_or(false);
    if (p.number) law.*p.number = get_number(m, p.key).value_or(p.required ? 1.0 : p.fallback);
  }
  if constexpr (requires { law.as_cbgeo; }) law.as_cbgeo = in.as_cbgeo;
  if constexpr (requires { law.tension_limit; }) {
    const bool unlimited = in.as_cbgeo || in.cbgeo_defaults;
    if (std::isnan(law.tension_limit))
      law.tension_limit = unlimited ? std::numeric_limits<double>::infinity() : 0.0;
  }
  return law;
}

// True if no value of the law is missing or bad: only then can their combination be judged.
template <class LawType>
bool is_complete(const JsonValue& m) {
  const auto& members = m.as<JsonValue::Object>();
  return std::all_of(LawType::parameters.begin(), LawType::parameters.end(), [&](const auto& p) {
    const auto it = std::find_if(members.begin(), members.end(),
                                 [&](const auto& member) { return member.key == p.key; });
    return it == members.end() ? !p.required : it->value.valid();
  });
}

template <class... Laws>
Law choose(const JsonValue& m, std::string_view type, ScenarioInput& in,
           const std::variant<Laws...>*) {
  Law law;
  const auto try_one = [&]<class LawType>(const LawType*) {
    if (type != LawType::name) return;
    const auto made = law_of<LawType>(m, in);
    law = made;
    if (!is_complete<LawType>(m)) return;
    if (const std::string problem = made.problem(); !problem.empty()) return in.error(m, problem);
    const double stiffness = made.wave_modulus();
    bool none = false;
    if constexpr (requires { made.incompressible; }) none = made.incompressible;
    if (!std::isfinite(stiffness) || stiffness < 0 || (stiffness == 0 && !none))
      in.error(
          m,
          fmt::format("the stiffness of compression waves must be a finite number above 0, but "
                      "follows from these values as {} Pa",
                      stiffness),
          "see what the moduli are computed from; stresses are in Pa");
  };
  (try_one(static_cast<const Laws*>(nullptr)), ...);
  return law;
}

}  // namespace

Law read_law(const JsonValue& material, ScenarioInput& in) {
  for (const auto& member : material.as<JsonValue::Object>())
    if (member.value.is<JsonValue::Object>())
      in.error(member.value, fmt::format("'{}' must be a number here", member.key),
               "fields belong to the places of a scenario's model");
  const std::string type = get_text(material, "type").value_or("");
  return choose(material, without_dimension(type), in, static_cast<const Law*>(nullptr));
}

}  // namespace lahar
