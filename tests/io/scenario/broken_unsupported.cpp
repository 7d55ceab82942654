#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

// clang-format off
TEST_CASE("what a later version will do is refused, never ignored") {
  const std::vector<Entry> table = {
    {"another element",
     {replace("mpm.json", "ED2Q4", "ED2T3L")},
     {},
     R"(mpm.json:6:18: error: 'cell_type': "ED2T3L" is not supported yet [/mesh/cell_type]
      "cell_type": "ED2T3L",
                   ^
  hint: supported: ED2T3, ED2T6, ED2Q4, ED2Q8, ED2Q9, ED3T4, ED3H8, ED3H20, ED3H27, ED2Q16G, ED3H64G, ED2Q4P2B, ED3H8P2B
)"},
    {"another material",
     {replace("mpm.json", R"("LinearElastic2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3)", R"("BinghamViscoPlastic2D", "density": -1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3)")},
     {},
     R"(mpm.json:15:23: error: 'type': "BinghamViscoPlastic2D" is not supported yet [/materials/0/type]
      {"id": 0, "type": "BinghamViscoPlastic2D", "density": -1000,
                        ^
  hint: supported: LinearElastic, Newtonian, Bingham, MohrCoulomb, ModifiedCamClay, NorSand, DruckerPrager, VonMises, NeoHookean
mpm.json:15:59: error: 'density' must be greater than 0 [kg/m^3], found -1000 [/materials/0/density]
      {"id": 0, "type": "BinghamViscoPlastic2D", "density": -1000,
                                                            ^
)"},
    {"forces of a frame that turns",
     {replace("mpm.json", "\"gravity\": [0, -9.81]", "\"gravity\": [0, -9.81], \"rotation_forces\": {\"omega\": 2}")},
     {},
     R"(mpm.json:18:58: error: 'rotation_forces' is not supported yet [/external_loading_conditions/rotation_forces]
    "external_loading_conditions": {"gravity": [0, -9.81], "rotation_forces": {"omega": 2}},
                                                           ^
)"},
  };
  check(table, 3);
}
