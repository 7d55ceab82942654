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

}  // namespace

// clang-format off
TEST_CASE("materials with senseless parameters are refused with what is allowed") {
  const std::vector<Entry> table = {
    {"a soil with everything wrong, and something missing",
     with("MohrCoulomb2D", R"("youngs_modulus": -1, "poisson_ratio": 0.5, "friction": 95, "dilation": 0, "cohesion": -5)"),
     {},
     R"(mpm.json:15:5: error: 'tension_cutoff' is missing in a material [/materials/0]
      {"type": "MohrCoulomb2D", "density": 1800,
      ^
  hint: tension_cutoff [Pa]: largest tension
mpm.json:16:24: error: 'youngs_modulus' must be greater than 0 [Pa], found -1 [/materials/0/youngs_modulus]
       "youngs_modulus": -1, "poisson_ratio": 0.5, "friction": 95, "dilation": 0, "cohesion": -5}
                         ^
mpm.json:16:45: error: 'poisson_ratio' must be greater than -1 and less than 0.5, found 0.5 [/materials/0/poisson_ratio]
       "youngs_modulus": -1, "poisson_ratio": 0.5, "friction": 95, "dilation": 0, "cohesion": -5}
                                              ^
  hint: no volume changes then, and the bulk modulus is infinite: take 0.49 and "b_bar": true in analysis
mpm.json:16:62: error: 'friction' must be at least 0 and less than 90 [degrees], found 95 [/materials/0/friction]
       "youngs_modulus": -1, "poisson_ratio": 0.5, "friction": 95, "dilation": 0, "cohesion": -5}
                                                               ^
mpm.json:16:93: error: 'cohesion' must be at least 0 [Pa], found -5 [/materials/0/cohesion]
  _modulus": -1, "poisson_ratio": 0.5, "friction": 95, "dilation": 0, "cohesion": -5}
                                                                                  ^
)"},
    {"a tension cut-off above the apex",
     with("MohrCoulomb2D", R"("youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 2000, "tension_cutoff": 5000)"),
     {},
     R"(mpm.json:15:5: error: 'tension_cutoff' must be at most the tension at the apex, cohesion cot(friction) = 3464.1 Pa, found 5000 [/materials/0]
      {"type": "MohrCoulomb2D", "density": 1800,
      ^
)"},
    {"more dilation than friction",
     with("MohrCoulomb2D", R"("youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 20, "dilation": 25, "cohesion": 2000, "tension_cutoff": 0)"),
     {},
     R"(mpm.json:15:5: error: 'dilation' must be at most 'friction' = 20 degrees, found 25 [/materials/0]
      {"type": "MohrCoulomb2D", "density": 1800,
      ^
)"},
    {"no strength at all",
     with("MohrCoulomb2D", R"("youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 0, "dilation": 0, "cohesion": 0, "tension_cutoff": 0)"),
     {},
     R"(mpm.json:15:5: error: 'cohesion' and 'friction' must not both be 0: the material would have no strength; a fluid is "type": "Newtonian" [/materials/0]
      {"type": "MohrCoulomb2D", "density": 1800,
      ^
)"},
    {"softening of which too little is said",
     with("MohrCoulomb2D", R"("youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 2000, "tension_cutoff": 0, "softening": true, "residual_friction": 20)"),
     {},
     R"(mpm.json:15:5: error: 'residual_dilation' is needed where 'softening' is true [/materials/0]
      {"type": "MohrCoulomb2D", "density": 1800,
      ^
)"},
    {"softening that ends before it begins",
     with("MohrCoulomb2D", R"("youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 2000, "tension_cutoff": 0, "softening": true, "residual_friction": 20, "residual_dilation": 0, "residual_cohesion": 0, "peak_pdstrain": 0.1, "residual_pdstrain": 0.05)"),
     {},
     R"(mpm.json:15:5: error: 'residual_pdstrain' must be greater than 'peak_pdstrain' = 0.1, found 0.05 [/materials/0]
      {"type": "MohrCoulomb2D", "density": 1800,
      ^
)"},
    {"a cone cut off above its tip",
     with("DruckerPrager2D", R"("youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 2000, "tension_cutoff": 5000)"),
     {},
     R"(mpm.json:15:5: error: 'tension_cutoff' must be at most the mean stress at the cone's tip, cohesion cot(friction) = 3464.1 Pa, found 5000 [/materials/0]
      {"type": "DruckerPrager2D", "density": 1800,
      ^
)"},
  };
  check(table, 7);
}
// clang-format on
