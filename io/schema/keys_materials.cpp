// Table of materials: rows of all of them, and those of each law's own table.
#include <fmt/format.h>

#include <algorithm>

#include "io/schema/keys_parameter.h"
#include "physics/materials/materials.h"

namespace lahar {

namespace {

template <class LawType>
inline constexpr bool is_native = false;
template <class LawType>
requires LawType::native inline constexpr bool is_native<LawType> = true;

const Section& field_section() {
  static const Section section{
      .name = "a field of a material",
      .path = "materials[].PARAMETER",
      .help =
          "A parameter that differs from place to place, in place of its number: a random "
          "field (mean, cov, correlation_length, seed), a profile over depth (at_depth, "
          "below), or a map (raster). A particle keeps the value of its place at the beginning.",
      .keys = {
          {.key = "mean", .kinds = number, .help = "mean of a random field", .native = true},
          {.key = "cov",
           .kinds = number,
           .help = "coefficient of variation: standard deviation over mean",
           .unit = "-",
           .min = 0,
           .max = 5,
           .native = true},
          {.key = "distribution",
           .kinds = text,
           .help = "of the values at a place",
           .fallback = "\"lognormal\"",
           .allowed = {"lognormal", "normal"},
           .native = true},
          {.key = "correlation_length",
           .kinds = vector | number,
           .help = "scale of fluctuation along each axis, or one for all: the integral of the "
                   "correlation over a line",
           .unit = "m",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "correlation",
           .kinds = text,
           .help = "gaussian: exp(-pi (t/l)^2) for a distance t; exponential: exp(-2 |t|/l). Over "
                   "several axes their product",
           .fallback = "\"gaussian\"",
           .allowed = {"gaussian", "exponential"},
           .native = true},
          {.key = "seed",
           .kinds = integer,
           .help = "which of all random fields; fields of the same seed, lengths and correlation "
                   "rise and fall together",
           .fallback = "0",
           .min = 0,
           .native = true},
          {.key = "min", .kinds = number, .help = "least value", .native = true},
          {.key = "max", .kinds = number, .help = "largest value", .native = true},
          {.key = "at_depth",
           .kinds = points,
           .help = "rows of a depth [m] and the value there, ascending; linear between them",
           .native = true},
          {.key = "below",
           .kinds = number | text,
           .help = "level from which depths count downwards along the last axis, or the name of a "
                   "surface of geometry",
           .unit = "m",
           .native = true},
          {.key = "raster",
           .kinds = file | texts,
           .help =
               "ESRI ASCII grid or GeoTIFF of the value at each place in plan, bilinear between "
               "centres of its cells; a list: tiles that lie beside each other",
           .native = true},
          {.key = "classes",
           .kinds = integer,
           .help = "number of values that the field has",
           .fallback = "64",
           .min = 2,
           .max = 1000,
           .native = true},
      }};
  return section;
}

template <class LawType>
KeySpec key_of_law(const Parameter<LawType>& p) {
  KeySpec f = key_of(p);
  if (p.number) {
    f.kinds |= object;
    f.section = field_section;
  }
  f.native = is_native<LawType>;
  f.only = {LawType::name};
  return f;
}

// True if the rows say the same of their keys.
bool agree(const KeySpec& a, const KeySpec& b) {
  return a.key == b.key && a.kinds == b.kinds && a.help == b.help && a.unit == b.unit &&
         a.fallback == b.fallback && a.required == b.required && a.min == b.min && a.max == b.max &&
         a.above_min == b.above_min && a.below_max == b.below_max && a.support == b.support &&
         a.native == b.native;
}

// A row for the keys of each law; laws of which the rows agree share one.
template <class... Laws>
void add_laws(std::vector<KeySpec>& keys, const std::variant<Laws...>*) {
  const auto add = [&]<class LawType>(const Parameter<LawType>& p) {
    KeySpec spec = key_of_law(p);
    const auto same = std::find_if(keys.begin(), keys.end(),
                                   [&](const KeySpec& other) { return agree(spec, other); });
    if (same == keys.end())
      keys.push_back(std::move(spec));
    else
      same->only.push_back(LawType::name);
  };
  const auto add_all = [&](const auto& parameters) {
    for (const auto& p : parameters) add(p);
  };
  (add_all(Laws::parameters), ...);
}

template <class... Laws>
std::vector<std::string_view> names_of(const std::variant<Laws...>*) {
  return {Laws::name...};
}

std::vector<std::string_view> laws_without(std::string_view key, const std::vector<KeySpec>& keys) {
  std::vector<std::string_view> names = names_of(static_cast<const Law*>(nullptr));
  for (const KeySpec& spec : keys)
    if (spec.key == key)
      for (const auto owner : spec.only) std::erase(names, owner);
  return names;
}

KeySpec planned(std::string_view key, std::string_view unit, std::string_view help,
                std::vector<std::string_view> only) {
  return {.key = key,
          .kinds = number,
          .help = help,
          .unit = unit,
          .support = Support::planned,
          .only = std::move(only)};
}

std::vector<KeySpec> material_keys() {
  std::vector<KeySpec> all = {
      {.key = "id",
       .kinds = integer,
       .help = "id; default: the position in the list",
       .min = 0,
       .max = 65535},
      {.key = "name", .kinds = text, .help = "name, usable in place of the id", .native = true},
      {.key = "type",
       .kinds = text,
       .help = "constitutive law; may end in 2D or 3D",
       .required = true,
       .allowed = names_of(static_cast<const Law*>(nullptr)),
       .planned = {}},
      {.key = "density",
       .kinds = number,
       .help = "initial density",
       .unit = "kg/m^3",
       .required = true,
       .min = 0,
       .above_min = true},
  };
  // Laws of the reference code and of its fork.
  for (const std::string_view later : {"Bingham", "HenckyHyperElastic", "BinghamViscoPlastic"})
    if (std::find(all[2].allowed.begin(), all[2].allowed.end(), later) == all[2].allowed.end())
      all[2].planned.push_back(later);
  add_laws(all, static_cast<const Law*>(nullptr));
  all.push_back({.key = "tolerance",
                 .kinds = number,
                 .help = "ignored by CB-Geo MPM",
                 .support = Support::ignored,
                 .only = laws_without("tolerance", all)});
  all.push_back({.key = "porosity",
                 .kinds = number,
                 .help = "volume of pores by whole volume at the beginning, of a skeleton with a "
                         "liquid in its pores. `density` then is that of the grains",
                 .unit = "-",
                 .min = 0,
                 .max = 1,
                 .above_min = true,
                 .below_max = true});
  all.push_back(
      planned("shear_modulus", "Pa", "shear modulus (dialect of the fork)", {"ModifiedCamClay"}));
  all.push_back(
      planned("volumetric_gamma", "-", "compressibility (dialect of the fork)", {"Bingham"}));
  all.push_back(planned("regularization_parameter", "s", "regularization (dialect of the fork)",
                        {"Bingham"}));
  for (const std::string_view key : {"packing_fraction", "packing_fraction_minimum"})
    all.push_back(
        planned(key, "-",
                "volume of grains over the whole: looser soil has no stress (dialect of the fork)",
                {"MohrCoulomb"}));
  for (const std::string_view k : {"k_x", "k_y", "k_z"})
    all.push_back({.key = k,
                   .kinds = number,
                   .help = "hydraulic conductivity [m/s] along an axis, or, with "
                           "intrinsic_permeability, permeability [m^2]; default k_x",
                   .unit = "m/s",
                   .min = 0,
                   .above_min = true});
  all.push_back({.key = "intrinsic_permeability",
                 .kinds = boolean,
                 .help = "k_x, k_y and k_z are permeabilities [m^2]; default false"});
  all.push_back({.key = "mu",
                 .kinds = any,
                 .help = "write dynamic_viscosity",
                 .support = Support::older,
                 .instead = "dynamic_viscosity",
                 .only = {"Newtonian"}});
  const auto older = [&](std::string_view key, std::string_view help) {
    all.push_back({.key = key,
                   .kinds = any,
                   .help = help,
                   .support = Support::older,
                   .only = {"MohrCoulomb"}});
  };
  older("friction_angle", "write friction");
  older("dilation_angle", "write dilation");
  older("residual_friction_angle", "write residual_friction");
  older("residual_dilation_angle", "write residual_dilation");
  for (const std::string_view key : {"peak_EPDS", "peak_epds"})
    older(key, "write peak_pdstrain, and \"softening\": true");
  for (const std::string_view key : {"crit_EPDS", "critical_epds"})
    older(key, "write residual_pdstrain, and \"softening\": true");
  all.push_back({.key = "stress_rate",
                 .kinds = text,
                 .help = "as analysis.stress_rate, which is for all materials",
                 .allowed = {"jaumann", "none"},
                 .only = {"LinearElastic"}});
  return all;
}

}  // namespace

const Section& materials_section() {
  static const Section section{
      .name = "a material",
      .path = "materials[]",
      .help = "A constitutive law with its parameters. Angles are in degrees.",
      .discriminator = "type",
      .keys = material_keys(),
      .dimension_suffix = true};
  return section;
}

}  // namespace lahar
