/// \file Rows of the field tables from those that materials and boundary conditions have.
#pragma once

#include <fmt/format.h>

#include <memory>

#include "io/schema/keys.h"
#include "physics/base/parameter.h"

namespace lahar {

/// A text that lives as long as the program, as keys view texts.
inline std::string_view kept_text(std::string text) {
  static std::vector<std::unique_ptr<const std::string>> texts;
  texts.push_back(std::make_unique<const std::string>(std::move(text)));
  return *texts.back();
}

inline void set_bounds(KeySpec& f, Bound bound) {
  switch (bound) {
    case Bound::none:
      break;
    case Bound::positive:
      f.min = 0, f.above_min = true;
      break;
    case Bound::not_negative:
      f.min = 0;
      break;
    case Bound::angle:
      f.min = 0, f.max = 90, f.below_max = true;
      break;
    case Bound::poisson:
      f.min = -1, f.max = 0.5, f.above_min = f.below_max = true;
      break;
  }
}

/// The key of a parameter.
template <class Owner>
KeySpec key_of(const Parameter<Owner>& p) {
  KeySpec f{.key = p.key, .kinds = number, .help = p.help, .unit = p.unit, .required = p.required};
  if (p.flag) {
    f.kinds = boolean;
    if (!p.by_preset) f.fallback = "false";
  }
  if (p.sign) f.kinds = integer, f.min = -1, f.max = 1;
  if (p.choice) {
    f.kinds = text;
    f.allowed.assign(p.choices.begin(), p.choices.end());
  }
  if (p.number && !p.required && p.fallback == p.fallback)
    f.fallback = kept_text(fmt::format("{}", p.fallback));
  set_bounds(f, p.bound);
  return f;
}

}  // namespace lahar
