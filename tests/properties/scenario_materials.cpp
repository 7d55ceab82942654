// Materials of generated scenarios: every law, so soft that steps may be long.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tests/properties/scenario_parts.h"

namespace lahar::test {

namespace {

constexpr double soil_pressure = 2000;  ///< [Pa] at the start
constexpr double pore_wave = 20;        ///< [m/s] of the liquid in pores

Json elastic(Choices& choices, const std::string& of, const char* type) {
  return {{"type", type},
          {"density", choices.number(of + "density", 1000, 800, 2000)},
          {"youngs_modulus", choices.number(of + "stiffness", 5e4, 1e4, 1e5)},
          {"poisson_ratio", choices.number(of + "poisson", 0.25, 0, 0.4)}};
}

Json fluid(Choices& choices, const std::string& of) {
  Json law{{"type", "Newtonian"},
           {"density", 1000},
           {"bulk_modulus", choices.number(of + "stiffness", 4e4, 1e4, 8e4)},
           {"dynamic_viscosity", choices.number(of + "viscosity", 0, 0.5, 20)}};
  if (choices.chance(of + "incompressible", 8)) law["incompressible"] = true;
  if (choices.chance(of + "tension", 30)) law["tension_limit"] = 500;
  return law;
}

Json bingham(Choices& choices, const std::string& of) {
  Json law = elastic(choices, of, "Bingham");
  law["tau0"] = choices.number(of + "strength", 100, 0, 500);
  law["mu"] = choices.number(of + "viscosity", 5, 0, 20);
  law["critical_shear_rate"] = 0.01;
  return law;
}

void add_strength(Choices& choices, const std::string& of, Json& law) {
  law["friction"] = choices.number(of + "friction", 30, 5, 40);
  law["dilation"] = choices.chance(of + "dilation", 50) ? 0.3 * law["friction"].get<double>() : 0.0;
  law["cohesion"] = choices.number(of + "strength", 200, 0, 1000);
  law["tension_cutoff"] =
      choices.chance(of + "tension", 50) ? 0.5 * law["cohesion"].get<double>() : 0.0;
}

Json mohr_coulomb(Choices& choices, const std::string& of) {
  Json law = elastic(choices, of, "MohrCoulomb");
  add_strength(choices, of, law);
  if (!choices.chance(of + "softening", 50)) return law;
  law["softening"] = true;
  law["residual_friction"] = 0.7 * law["friction"].get<double>();
  law["residual_dilation"] = 0;
  law["residual_cohesion"] = 0.5 * law["cohesion"].get<double>();
  law["peak_pdstrain"] = choices.chance(of + "peak", 50) ? 0.01 : 0.0;
  law["residual_pdstrain"] = choices.chance(of + "slow", 50) ? 2.0 : 0.2;
  return law;
}

Json clay(Choices& choices, const std::string& of) {
  Json law{{"type", "ModifiedCamClay"},
           {"density", 1800},
           {"youngs_modulus", 1e5},
           {"poisson_ratio", 0.3},
           {"p_ref", 1e5},
           {"e_ref", 1.12},
           {"pc0", 4000},
           {"ocr", 1.5},
           {"m", 1.2},
           {"lambda", 0.1},
           {"kappa", 0.03}};
  if (choices.chance(of + "lode", 30)) law["three_invariants"] = true;
  if (choices.chance(of + "subloading", 30)) {
    law["subloading"] = true;
    law["subloading_u"] = 10;
  }
  if (choices.chance(of + "bonding", 30)) {
    law["bonding"] = true;
    law.update({{"s_h", 0.3},
                {"mc_a", 2e4},
                {"mc_b", 1.6},
                {"mc_c", 1e4},
                {"mc_d", 1.2},
                {"m_degradation", 1.0},
                {"m_shear", 1e5}});
  }
  return law;
}

Json norsand(Choices& choices, const std::string& of) {
  Json law{{"type", "NorSand"},
           {"density", 1800},
           {"poisson_ratio", 0.3},
           {"reference_pressure", 1000},
           {"friction_cs", 30},
           {"N", 0.3},
           {"lambda", 0.1},
           {"kappa", 0.03},
           {"gamma", 1.3},
           {"chi", 3.5},
           {"hardening_modulus", 200},
           {"void_ratio_initial", choices.chance(of + "loose", 40) ? 1.1 : 0.85},
           {"p_image_initial", choices.number(of + "strength", 3000, 1500, 8000)}};
  if (choices.chance(of + "bonding", 30)) {
    law["bond_model"] = true;
    law.update({{"p_cohesion_initial", 500},
                {"p_dilation_initial", 500},
                {"m_cohesion", 5},
                {"m_dilation", 5},
                {"m_modulus", 5}});
  }
  return law;
}

Json law_of(Choices& choices, const std::string& of) {
  switch (choices.pick(of + "law", choices.chance(of + "soil", 30) ? 9 : 7)) {
    case 1:
      return fluid(choices, of);
    case 2:
      return mohr_coulomb(choices, of);
    case 3: {
      Json law = elastic(choices, of, "VonMises");
      law["yield_stress"] = choices.number(of + "strength", 1000, 100, 4000);
      if (choices.chance(of + "hardening", 50)) law["hardening_modulus"] = 2e4;
      return law;
    }
    case 4: {
      Json law = elastic(choices, of, "DruckerPrager");
      add_strength(choices, of, law);
      return law;
    }
    case 5:
      return elastic(choices, of, "NeoHookean");
    case 6:
      return bingham(choices, of);
    case 7:
      return clay(choices, of);
    case 8:
      return norsand(choices, of);
    default:
      return elastic(choices, of, "LinearElastic");
  }
}

/// A parameter differs from place to place.
void add_field(Choices& choices, const std::string& of, const Outline& outline, Json& law,
               GeneratedCase& made) {
  std::vector<const char*> keys;
  for (const char* key : {"cohesion", "youngs_modulus", "yield_stress", "bulk_modulus", "tau0",
                          "dynamic_viscosity", "p_image_initial"})
    if (law.contains(key) && law[key].get<double>() > 0) keys.push_back(key);
  const int chosen = choices.pick(of + "key", static_cast<int>(keys.size()));
  const char* key = keys[static_cast<std::size_t>(chosen)];
  law[key] = lahar::test::field_of(choices, of, outline, law[key].get<double>(), made);
  if (keys.size() == 1 || !choices.chance(of + "two", 30)) return;
  const char* other = keys[static_cast<std::size_t>(chosen == 0 ? 1 : 0)];
  law[other] = lahar::test::field_of(choices, of + "two.", outline, law[other].get<double>(), made);
}

/// About the speed of waves at the start [m/s].
double wave_of(const Json& law) {
  double modulus = law.value("bulk_modulus", 0.0);
  if (law.contains("youngs_modulus")) {
    const double nu = law["poisson_ratio"];
    modulus = law["youngs_modulus"].get<double>() * (1 - nu) / ((1 + nu) * (1 - 2 * nu));
  }
  const bool soil = law["type"] == "ModifiedCamClay" || law["type"] == "NorSand";
  if (soil) modulus = 2.0 * 2.0 / 0.03 * soil_pressure;
  return std::sqrt(modulus / law["density"].get<double>());
}

}  // namespace

Json material_of(const Outline& outline, int number) {
  const int material = number % static_cast<int>(outline.solids());
  return outline.pores ? Json{material, outline.solids()} : Json(material);
}

Json materials_of(Choices& choices, Outline& outline, GeneratedCase& made) {
  Json all = Json::array();
  const int count = choices.chance("materials.one", 30) ? 1 : outline.bodies;
  for (int m = 0; m < count; ++m) {
    const std::string of = name("material", m, "");
    Json law = law_of(choices, of);
    const bool is_fluid = law["type"] == "Newtonian" || law["type"] == "Bingham";
    const bool holds = outline.pores || outline.solves == "equilibrium";
    if (holds && is_fluid) law = elastic(choices, of, "NeoHookean");
    const bool is_soil = law["type"] == "ModifiedCamClay" || law["type"] == "NorSand";
    if (outline.is_implicit() && outline.dim == 3 && is_soil)  // steps would take seconds
      law = elastic(choices, of, "LinearElastic");
    if (outline.projects() && !outline.pores && !is_fluid)
      law = choices.chance(of + "bingham", 40) ? bingham(choices, of) : fluid(choices, of);
    const std::string type = law["type"];
    outline.materials.push_back(type);
    outline.opens |= type != "LinearElastic" && type != "VonMises" && type != "NeoHookean";
    outline.has_soil |= type == "ModifiedCamClay" || type == "NorSand";
    outline.wave = std::max(outline.wave, wave_of(law));
    if (outline.fields && choices.chance(of + "field", 70)) {
      add_field(choices, of + "field.", outline, law, made);
      outline.wave *= std::sqrt(1.5);
    }
    if (outline.pores) {
      law["porosity"] = choices.number(of + "porosity", 0.4, 0.2, 0.6);
      law["k_x"] = choices.chance(of + "open", 50) ? 1e-2 : 1e-4;
      if (choices.chance(of + "layered", 30)) law["k_y"] = 1e-3;
      outline.wave = std::sqrt(outline.wave * outline.wave + pore_wave * pore_wave);
    }
    all.push_back(std::move(law));
  }
  if (outline.pores) {
    all.push_back(
        {{"type", "Newtonian"},
         {"density", 1000},
         {"bulk_modulus", outline.projects() && choices.chance("pores.stiff", 50) ? 2e9 : 4e4},
         {"dynamic_viscosity", 1e-3}});
    outline.materials.emplace_back("Newtonian");
    outline.opens = true;
  }
  return all;
}

}  // namespace lahar::test
