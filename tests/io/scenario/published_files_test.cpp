// Published CB-Geo inputs as they are: keys that nobody reads, side files that are not as they say.
#include <doctest/doctest.h>

#include <string>

#include "io/scenario/scenario.h"
#include "tests/io/scenario/broken_case.h"
#include "tests/io/scenario/said.h"
#include "tests/published_consolidation.h"

using namespace lahar;
using namespace lahar::broken;

namespace {

constexpr const char* constraints = R"([{"nset_id": 0, "dir": 1, "velocity": 0.0}])";
constexpr const char* as_cbgeo = "analysis.as_cbgeo=true";

template <int Dim>
Material soil_of(bool as_cbgeo, std::string& warnings) {
  const test::PublishedConsolidation files(Dim, 4, 1e-5, 20001);
  const Scenario scenario = read_scenario(files.file(), {.overrides = {}, .as_cbgeo = as_cbgeo});
  warnings = test::warnings_of(scenario);
  return std::get<Model<Dim>>(scenario.model).materials[0];
}

}  // namespace

TEST_CASE("the published consolidation cases are read with drag, and with what was mended") {
  for (const bool as_cbgeo : {false, true}) {
    CAPTURE(as_cbgeo);
    std::string in_plane, in_space;
    const Material plane = soil_of<2>(as_cbgeo, in_plane);
    const Material space = soil_of<3>(as_cbgeo, in_space);
    for (const Material* soil : {&plane, &space}) {
      REQUIRE(soil->liquid.has_value());
      CHECK(soil->liquid->resistance[0] == doctest::Approx(9810 / 1e-3));
    }
    for (const char* part : {"'pore_pressure_constraints' is ignored", "'mu' is ignored",
                             "'gravity' is ignored here", "'intrinsic_permeability' is missing"})
      CHECK(test::says(in_plane, part));
    CHECK(test::says(in_plane, "'stress_update': usf is ignored") == as_cbgeo);
    for (const char* part : {"'mu' is ignored", "'intrinsic_permeability' is missing"})
      CHECK(test::says(in_space, part));
  }
}

// clang-format off
TEST_CASE("side files that are not as they say: refused, and with as_cbgeo read with a warning") {
  const std::vector<Edit> more_particles = {write("particles.txt", "2\n0.25 0.5\n0.75 0.5\n1.5 0.5\n1.75 0.5\n")};
  const std::vector<Edit> more_cells = {replace("mesh.txt", "6 2", "6 1")};
  const std::vector<Edit> no_velocities = {
      replace("mpm.json", constraints, R"([{"file": "v.txt"}])"), write("v.txt", "# node dir velocity\n0 0\n1 1\n2 1 0.5\n2 0 \n")};
  const std::vector<Edit> no_friction = {
      replace("mpm.json", constraints, std::string(constraints) + R"(, "friction_constraints": [{"file": "f.txt"}])"), write("f.txt", "0 1 -1\t0.1\n1 1 -1\n")};
  const std::vector<Edit> no_beta = {
      replace("mpm.json", constraints, std::string(constraints) + R"(, "nodal_euler_angles": "e.txt")"), write("e.txt", "0 0.1\n1 0.1 0.2\n")};
  const std::vector<Edit> no_direction = {
      replace("mpm.json", constraints, R"([{"file": "v.txt"}])"), write("v.txt", "0\n")};
  const std::vector<Edit> other_stresses = {
      replace("mpm.json", R"("cell_type")", R"("particles_stresses": "s.txt", "cell_type")"),
      write("s.txt", "1\n0 0 0 0 0 0\n0 0 0 0 0 0\n0 0 0 0 0 0\n")};
  const std::vector<Entry> table = {
    {"more particles", more_particles, {},
     R"(particles.txt:4:1: error: unexpected row after 2 particles
  1.5 0.5
  ^
  hint: the count in the first row is too small, or there are rows too many
)"},
    {"more particles, as CB-Geo", more_particles, {as_cbgeo},
     R"(accepted
particles.txt:4: warning: the first row counts 2 particles, the file has 4; all are read
  1.5 0.5
  hint: CB-Geo MPM does not look at that number; without --as-cbgeo this is an error
)"},
    {"fewer particles, as CB-Geo", {write("particles.txt", "5\n0.25 0.5\n0.75 0.5\n1.5 0.5\n")}, {as_cbgeo},
     R"(accepted
particles.txt: warning: the first row counts 5 particles, the file has 3; all are read
  hint: CB-Geo MPM does not look at that number; without --as-cbgeo this is an error
)"},
    {"more cells", more_cells, {},
     R"(mesh.txt:10:1: error: unexpected row after 1 cells
  1 2 5 4
  ^
  hint: the count in the first row is too small, or there are rows too many
)"},
    {"more cells, as CB-Geo", more_cells, {as_cbgeo},
     R"(accepted
mesh.txt:10: warning: the first row counts 1 cells, the file has 2; all are read
  1 2 5 4
  hint: CB-Geo MPM does not look at that number; without --as-cbgeo this is an error
)"},
    {"other stresses, as CB-Geo", other_stresses, {as_cbgeo},
     R"(accepted
s.txt:3: warning: the first row counts 1 rows of stresses, the file has 3; all are read
  0 0 0 0 0 0
  hint: CB-Geo MPM does not look at that number; without --as-cbgeo this is an error
)"},
    {"constraints without velocities", no_velocities, {},
     R"(v.txt:2:4: error: the velocity is missing
  0 0
     ^
v.txt:3:4: error: the velocity is missing
  1 1
     ^
v.txt:5:5: error: the velocity is missing
  2 0
     ^
)"},
    {"constraints without velocities, as CB-Geo", no_velocities, {as_cbgeo},
     R"(accepted
v.txt: warning: the velocity is missing in 3 rows: 0 is taken (lines 2-3, 5)
  hint: CB-Geo MPM sets no value there, and takes what its memory holds
)"},
    {"friction without its coefficient", no_friction, {},
     R"(f.txt:2:7: error: the friction coefficient is missing
  1 1 -1
        ^
)"},
    {"friction without its coefficient, as CB-Geo", no_friction, {as_cbgeo},
     R"(accepted
f.txt: warning: the friction coefficient is missing in 1 row: 0 is taken (line 2)
  hint: CB-Geo MPM sets no value there, and takes what its memory holds
)"},
    {"angles without the last one", no_beta, {},
     R"(e.txt:1:6: error: beta is missing
  0 0.1
       ^
)"},
    {"angles without the last one, as CB-Geo", no_beta, {as_cbgeo},
     R"(accepted
e.txt: warning: beta is missing in 1 row: 0 is taken (line 1)
  hint: CB-Geo MPM sets no value there, and takes what its memory holds
)"},
    {"a constraint without its direction, as CB-Geo", no_direction, {as_cbgeo},
     R"(v.txt:1:2: error: the direction is missing
  0
   ^
)"},
  };
  check(table, 13);
}
// clang-format on
