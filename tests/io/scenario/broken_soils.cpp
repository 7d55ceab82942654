#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

namespace {

// The valid case with another material.
std::vector<Edit> with(const std::string& type, const std::string& parameters) {
  return {replace("mpm.json", R"({"id": 0, "type": "LinearElastic2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3})",
                  "{\"type\": \"" + type + "\", \"density\": 1800,\n     " + parameters + "}")};
}

const std::string clay =
    R"("youngs_modulus": 1e7, "poisson_ratio": 0.3, "p_ref": 1e5, "e_ref": 1.12, "pc0": 3e5, "m": 1.2)";
const std::string sand =
    R"("poisson_ratio": 0.3, "reference_pressure": 1000, "kappa": 0.03, "gamma": 1.3, "lambda": 0.1)";
const std::string state =
    R"("hardening_modulus": 200, "void_ratio_initial": 0.85, "p_image_initial": 87014.6)";

}  // namespace

// clang-format off
TEST_CASE("critical state soils with senseless parameters are refused with what is allowed") {
  const std::vector<Entry> table = {
    {"Cam-Clay that swells more than it is compressed",
     with("ModifiedCamClay2D", clay + R"(, "lambda": 0.03, "kappa": 0.1, "ocr": 1)"),
     {},
     R"(mpm.json:15:5: error: kappa must be less than lambda [/materials/0]
      {"type": "ModifiedCamClay2D", "density": 1800,
      ^
)"},
    {"Cam-Clay, under-consolidated",
     with("ModifiedCamClay2D", clay + R"(, "lambda": 0.1, "kappa": 0.03, "ocr": 0.5)"),
     {},
     R"(mpm.json:15:5: error: ocr must be at least 1 [/materials/0]
      {"type": "ModifiedCamClay2D", "density": 1800,
      ^
)"},
    {"Cam-Clay without its pressures",
     with("ModifiedCamClay2D", R"("youngs_modulus": 1e7, "poisson_ratio": 0.5, "m": -1, "lambda": 0.1, "kappa": 0.03, "ocr": 1)"),
     {},
     R"(mpm.json:15:5: error: 'p_ref' is missing in a material [/materials/0]
      {"type": "ModifiedCamClay2D", "density": 1800,
      ^
  hint: p_ref [Pa]: pressure at which e_ref is given
mpm.json:15:5: error: 'e_ref' is missing in a material [/materials/0]
      {"type": "ModifiedCamClay2D", "density": 1800,
      ^
  hint: e_ref [-]: void ratio of normal consolidation at p_ref
mpm.json:15:5: error: 'pc0' is missing in a material [/materials/0]
      {"type": "ModifiedCamClay2D", "density": 1800,
      ^
  hint: pc0 [Pa]: preconsolidation pressure at the start
mpm.json:16:46: error: 'poisson_ratio' must be greater than -1 and less than 0.5, found 0.5 [/materials/0/poisson_ratio]
       "youngs_modulus": 1e7, "poisson_ratio": 0.5, "m": -1, "lambda": 0.1, "kappa": 0.03, "ocr": 1}
                                               ^
  hint: no volume changes then, and the bulk modulus is infinite: take 0.49 and "b_bar": true in analysis
mpm.json:16:56: error: 'm' must be greater than 0, found -1 [/materials/0/m]
       "youngs_modulus": 1e7, "poisson_ratio": 0.5, "m": -1, "lambda": 0.1, "kappa": 0.03, "ocr": 1}
                                                         ^
)"},
    {"Cam-Clay with bonds of which nothing is said",
     with("ModifiedCamClay2D", clay + R"(, "lambda": 0.1, "kappa": 0.03, "ocr": 1, "bonding": true, "s_h": 0.5)"),
     {},
     R"(mpm.json:15:5: error: "bonding": true needs mc_a [/materials/0]
      {"type": "ModifiedCamClay2D", "density": 1800,
      ^
)"},
    {"Cam-Clay with a subloading surface of which nothing is said",
     with("ModifiedCamClay2D", clay + R"(, "lambda": 0.1, "kappa": 0.03, "ocr": 1, "subloading": true)"),
     {},
     R"(mpm.json:15:5: error: "subloading": true needs subloading_u [/materials/0]
      {"type": "ModifiedCamClay2D", "density": 1800,
      ^
)"},
    {"NorSand with a friction angle of 95 degrees and without a hardening modulus",
     with("NorSand2D", sand + R"(, "friction_cs": 95, "N": 0.3, "chi": 3.5, "void_ratio_initial": 0.85, "p_image_initial": 87014.6)"),
     {},
     R"(mpm.json:15:5: error: 'hardening_modulus' is missing in a material [/materials/0]
      {"type": "NorSand2D", "density": 1800,
      ^
  hint: hardening_modulus [-]: plastic hardening modulus H
mpm.json:16:115: error: 'friction_cs' must be at least 0 and less than 90 [deg], found 95 [/materials/0/friction_cs]
  nce_pressure": 1000, "kappa": 0.03, "gamma": 1.3, "lambda": 0.1, "friction_cs": 95, "N": 0.3, "chi": 3.5, "void_ratio_initial": 0.85, "p_image_initial": 87014.6
                                                                                  ^
)"},
    {"NorSand of which the critical state line is too steep for its dilatancy",
     with("NorSand2D", sand + R"(, "friction_cs": 30, "N": 0.3, "chi": 13, )" + state),
     {},
     R"(mpm.json:15:5: error: chi * lambda must be less than 6 sin(friction_cs) / (3 - sin(friction_cs)) [/materials/0]
      {"type": "NorSand2D", "density": 1800,
      ^
)"},
    {"NorSand whose strength vanishes",
     with("NorSand2D", sand + R"(, "friction_cs": 30, "N": 1, "chi": 3.5, )" + state),
     {},
     R"(mpm.json:15:5: error: N must be less than 1 [/materials/0]
      {"type": "NorSand2D", "density": 1800,
      ^
)"},
    {"NorSand with bonds of which too little is said",
     with("NorSand2D", sand + R"(, "friction_cs": 30, "N": 0.3, "chi": 3.5, "bond_model": true, "p_cohesion_initial": 1e4, )" + state),
     {},
     R"(mpm.json:15:5: error: "bond_model": true needs p_dilation_initial [/materials/0]
      {"type": "NorSand2D", "density": 1800,
      ^
)"},
  };
  check(table, 9);
}

TEST_CASE("critical state soils of the reference's documentation are accepted") {
  CHECK(read(with("ModifiedCamClay2D", R"("poisson_ratio": 0.3, "youngs_modulus": 2E7, "ocr": 1, "pc0": 6.0E+6,
     "m": 1.07, "lambda": 0.11, "kappa": 0.008, "p_ref": 6.0E+6, "e_ref": 0.38,
     "three_invariants": false, "subloading": true, "subloading_u": 100, "bonding": true,
     "mc_a": 1.2E+7, "mc_b": 1, "mc_c": 1.2E+7, "mc_d": 10, "s_h": 1, "m_degradation": 1,
     "m_shear": 2.4E+9)")) == "accepted\n");
  CHECK(read(with("NorSand2D", R"("poisson_ratio": 0.17, "reference_pressure": 1.0E+5, "friction_cs": 27.0, "N": 0.3,
     "lambda": 0.3, "kappa": 0.08, "gamma": 1.0, "chi": 3.5, "hardening_modulus": 200,
     "void_ratio_initial": 0.38, "p_image_initial": 3000000, "bond_model": true,
     "p_cohesion_initial": 1.2E+4, "p_dilation_initial": 2.0E+4, "m_cohesion": 10,
     "m_dilation": 1, "m_modulus": 100, "tolerance": 1.0E-15)")) == "accepted\n");
}
