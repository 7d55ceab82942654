// Table of materials.
#include "io/fields.h"

namespace lahar {

namespace {

using Types = std::vector<std::string_view>;

const Types elastic = {"LinearElastic", "Bingham", "MohrCoulomb", "ModifiedCamClay",
                       "HenckyHyperElastic"};
const Types with_nu = {"LinearElastic",   "Bingham", "MohrCoulomb",
                       "ModifiedCamClay", "NorSand", "HenckyHyperElastic"};
const Types fluid = {"Newtonian", "Bingham"};
const Types mohr_coulomb = {"MohrCoulomb"};
const Types cam_clay = {"ModifiedCamClay"};
const Types nor_sand = {"NorSand"};

Field positive(std::string_view key, std::string_view unit, std::string_view help,
               const Types& only) {
  return {.key = key,
          .kinds = number,
          .help = help,
          .unit = unit,
          .required = true,
          .min = 0,
          .above_min = true,
          .only = only};
}

Field not_negative(std::string_view key, std::string_view unit, std::string_view help,
                   const Types& only) {
  return {.key = key,
          .kinds = number,
          .help = help,
          .unit = unit,
          .required = true,
          .min = 0,
          .only = only};
}

Field optional(std::string_view key, std::string_view unit, std::string_view help,
               const Types& only) {
  return {.key = key, .kinds = number, .help = help, .unit = unit, .only = only};
}

Field planned(std::string_view key, std::string_view unit, std::string_view help,
              const Types& only) {
  return {.key = key,
          .kinds = number,
          .help = help,
          .unit = unit,
          .support = Support::planned,
          .only = only};
}

Field angle(std::string_view key, std::string_view help, const Types& only) {
  return {.key = key,
          .kinds = number,
          .help = help,
          .unit = "degrees",
          .required = true,
          .min = 0,
          .max = 90,
          .below_max = true,
          .only = only};
}

Field flag(std::string_view key, std::string_view help, const Types& only) {
  return {.key = key, .kinds = boolean, .help = help, .fallback = "false", .only = only};
}

std::vector<Field> fields() {
  return {
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
       .allowed = {"LinearElastic", "Newtonian"},
       .planned = {"Bingham", "MohrCoulomb", "ModifiedCamClay", "NorSand", "HenckyHyperElastic",
                   "BinghamViscoPlastic"}},
      {.key = "density",
       .kinds = number,
       .help = "initial density",
       .unit = "kg/m^3",
       .required = true,
       .min = 0,
       .above_min = true},
      positive("youngs_modulus", "Pa", "Young's modulus", elastic),
      {.key = "poisson_ratio",
       .kinds = number,
       .help = "Poisson's ratio",
       .unit = "-",
       .required = true,
       .min = -1,
       .max = 0.5,
       .above_min = true,
       .below_max = true,
       .only = with_nu},
      positive("bulk_modulus", "Pa", "bulk modulus of the fluid", {"Newtonian"}),
      not_negative("dynamic_viscosity", "Pa s", "viscosity", {"Newtonian"}),
      flag("incompressible", "true: the law adds no pressure", fluid),
      not_negative("tau0", "Pa", "yield stress", {"Bingham"}),
      not_negative("mu", "Pa s", "plastic viscosity", {"Bingham"}),
      positive("critical_shear_rate", "1/s", "shear rate below which it is rigid", {"Bingham"}),
      angle("friction", "friction angle", mohr_coulomb),
      angle("dilation", "dilation angle", mohr_coulomb),
      not_negative("cohesion", "Pa", "cohesion", mohr_coulomb),
      not_negative("tension_cutoff", "Pa", "largest tension", mohr_coulomb),
      flag("softening", "true: strength falls with plastic strain", mohr_coulomb),
      angle("residual_friction", "friction angle after softening", mohr_coulomb),
      angle("residual_dilation", "dilation angle after softening", mohr_coulomb),
      not_negative("residual_cohesion", "Pa", "cohesion after softening", mohr_coulomb),
      not_negative("peak_pdstrain", "-", "plastic deviatoric strain where softening begins",
                   mohr_coulomb),
      not_negative("residual_pdstrain", "-", "plastic deviatoric strain where it ends",
                   mohr_coulomb),
      positive("p_ref", "Pa", "reference pressure", cam_clay),
      positive("e_ref", "-", "void ratio at the reference pressure", cam_clay),
      positive("pc0", "Pa", "initial preconsolidation pressure", cam_clay),
      positive("ocr", "-", "overconsolidation ratio", cam_clay),
      positive("m", "-", "slope of the critical state line in p-q", cam_clay),
      positive("lambda", "-", "slope of the compression line", {"ModifiedCamClay", "NorSand"}),
      positive("kappa", "-", "slope of the swelling line", {"ModifiedCamClay", "NorSand"}),
      flag("three_invariants", "true: strength depends on the Lode angle", cam_clay),
      flag("subloading", "true: subloading surface", cam_clay),
      optional("subloading_u", "-", "rate of the subloading surface", cam_clay),
      flag("bonding", "true: bonded soil", cam_clay),
      optional("s_h", "-", "hydrate saturation", cam_clay),
      optional("mc_a", "-", "bonding parameter a", cam_clay),
      optional("mc_b", "-", "bonding parameter b", cam_clay),
      optional("mc_c", "-", "bonding parameter c", cam_clay),
      optional("mc_d", "-", "bonding parameter d", cam_clay),
      optional("m_degradation", "-", "rate of degradation", cam_clay),
      optional("m_shear", "-", "stiffness per hydrate saturation", cam_clay),
      positive("reference_pressure", "Pa", "reference pressure", nor_sand),
      angle("friction_cs", "friction angle at the critical state", nor_sand),
      not_negative("N", "-", "volumetric coupling", nor_sand),
      positive("gamma", "-", "void ratio of the critical state line", nor_sand),
      not_negative("chi", "-", "dilatancy coefficient", nor_sand),
      positive("hardening_modulus", "-", "hardening modulus", nor_sand),
      positive("void_ratio_initial", "-", "initial void ratio", nor_sand),
      positive("p_image_initial", "Pa", "initial image pressure", nor_sand),
      flag("bond_model", "true: bonded sand", nor_sand),
      optional("p_cohesion_initial", "Pa", "initial cohesion pressure", nor_sand),
      optional("p_dilation_initial", "Pa", "initial dilation pressure", nor_sand),
      optional("m_cohesion", "-", "degradation of cohesion", nor_sand),
      optional("m_dilation", "-", "degradation of dilation", nor_sand),
      optional("m_modulus", "-", "stiffness per bond pressure", nor_sand),
      {.key = "tolerance",
       .kinds = number,
       .help = "tolerance of the return mapping (NorSand); "
               "elsewhere ignored by the reference",
       .support = Support::ignored},
      {.key = "porosity",
       .kinds = number,
       .help = "ignored by the reference",
       .support = Support::ignored},
      planned("shear_modulus", "Pa", "shear modulus (dialect of the fork)", cam_clay),
      planned("volumetric_gamma", "-", "compressibility (dialect of the fork)", {"Bingham"}),
      planned("regularization_parameter", "s", "regularization (dialect of the fork)", {"Bingham"}),
      {.key = "stress_rate",
       .kinds = text,
       .help = "objective stress rate (dialect of the fork)",
       .support = Support::planned,
       .only = {"LinearElastic"}},
  };
}

}  // namespace

const Section& materials_section() {
  static const Section section{
      .name = "a material",
      .path = "materials[]",
      .help = "A constitutive law with its parameters. Angles are in degrees.",
      .discriminator = "type",
      .fields = fields(),
      .dimension_suffix = true};
  return section;
}

}  // namespace lahar
