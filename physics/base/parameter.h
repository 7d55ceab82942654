/// \file Tables of parameters: what a material or a boundary condition says of its numbers, as data
/// that io/ reads. The input's keys, bounds, help, JSON Schema and reference page follow.
#pragma once

#include <limits>
#include <span>
#include <string_view>

namespace lahar {

/// Values of a number that are allowed.
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

/// A flag that is false where the scenario does not say, and true with the preset "cbgeo".
struct OfPreset {};
inline constexpr OfPreset of_preset;

/// A row of a table. The key of a number without a default, of a sign or of a choice is required; a
/// flag is false where the scenario does not say.
template <class Owner>
struct Parameter {
  std::string_view key;   ///< in the scenario
  std::string_view unit;  ///< "-" dimensionless; angles are in degrees
  std::string_view help;
  double Owner::*number = nullptr;  ///< the member that is set; of these four one is not null
  bool Owner::*flag = nullptr;
  int Owner::*sign = nullptr;                      ///< 1 or -1
  int Owner::*choice = nullptr;                    ///< position of the text in `choices`
  std::span<const std::string_view> choices = {};  ///< texts that are allowed
  Bound bound = Bound::none;
  bool required = false;
  bool by_preset = false;
  double fallback = no_default.value;

  constexpr Parameter(std::string_view k, std::string_view u, std::string_view h,
                      double Owner::*member, Bound b)
      : key(k), unit(u), help(h), number(member), bound(b), required(true) {}
  constexpr Parameter(std::string_view k, std::string_view u, std::string_view h,
                      double Owner::*member, Bound b, Default d)
      : key(k), unit(u), help(h), number(member), bound(b), fallback(d.value) {}
  constexpr Parameter(std::string_view k, std::string_view h, bool Owner::*member)
      : key(k), help(h), flag(member) {}
  constexpr Parameter(std::string_view k, std::string_view h, bool Owner::*member, OfPreset)
      : key(k), help(h), flag(member), by_preset(true) {}
  constexpr Parameter(std::string_view k, std::string_view h, int Owner::*member)
      : key(k), help(h), sign(member), required(true) {}
  constexpr Parameter(std::string_view k, std::string_view h, int Owner::*member,
                      std::span<const std::string_view> texts)
      : key(k), help(h), choice(member), choices(texts), required(true) {}
};

}  // namespace lahar
