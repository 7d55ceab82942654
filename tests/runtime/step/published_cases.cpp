// Published CB-Geo cases against the states that the reference code computed.
#include "tests/published_cases.h"

#include <doctest/doctest.h>

#include <filesystem>

#include "io/results/compare.h"
#include "tests/runtime/step/models.h"

namespace fs = std::filesystem;
using namespace lahar;
using namespace lahar::test;

namespace {

/// The published cases beside the repository; empty if they are not there.
fs::path cases() {
  const fs::path folder = fs::path(LAHAR_SOURCE_DIR).parent_path() / "shared" / "cases";
  if (fs::exists(folder)) return folder;
  MESSAGE("no published cases beside the repository: skipped");
  return {};
}

struct Case {
  const char* name;
  double tolerance;  ///< relative to the largest magnitude of a field
  bool as_cbgeo = false;
  Index fewer_steps = 0;  ///< than the reference is said to have done
};

constexpr Case agreeing[] = {
    // All fields are those after one update less: velocities, places and pressures alike.
    {"2d_consolidation_explicit", 1e-10, true, 1},
    {"2d_hydrostatic_quad", 1e-8},
    {"2d_hydrostatic_quad_usl", 1e-8},
    // Stays elastic, with stresses that are rounding about zero: measured 3e-6, angles 1.2e-5.
    {"2d_mc_uniaxial_compression", 1e-4},
    {"2d_newmark_block", 1e-10, true, 1},
    {"2d_plate_with_hole_cartesian_1000", 1e-8},
    {"2d_sliding_block", 1e-8},
    {"2d_uniaxial_stress", 1e-8},
    {"2d_uniaxial_traction_nodal_forces", 1e-8},
    {"3d_dam_break_1000", 1e-6},
    {"3d_hydrostatic_mesh1_1000_usl", 1e-8},
    {"3d_uniaxial_stress", 1e-8},
};

}  // namespace

TEST_CASE("published cases end in the state that the reference code computed") {
  const fs::path folder = cases();
  if (folder.empty()) return;
  for (const Case& c : agreeing) {
    CAPTURE(c.name);
    REQUIRE(fs::exists(folder / c.name));
    Scenario scenario =
        read_scenario(folder / c.name / "case.json", {.overrides = {}, .as_cbgeo = c.as_cbgeo});
    const Frame end = std::visit(
        [&](auto& model) {
          model.analysis.nsteps -= c.fewer_steps;
          Simulation simulation(std::move(model));
          simulation.run();
          return simulation.frame();
        },
        scenario.model);
    Tolerances tolerances;
    tolerances.rtol = c.tolerance;
    const Comparison comparison =
        compare(end, read_particles(folder / c.name / "reference.csv"), tolerances);
    INFO(comparison.text());
    CHECK(comparison.passed);
    CHECK(comparison.matched == end.size());
    for (const char* field :
         {"coordinates", "displacement", "velocity", "stress", "strain", "volume", "mass"})
      CHECK(std::any_of(comparison.fields.begin(), comparison.fields.end(),
                        [&](const FieldDifference& f) { return f.name == field; }));
  }
}

TEST_CASE("every published case is compared") {
  for (const fs::path& folder : published_cases()) {
    const std::string name = folder.filename();
    CAPTURE(name);
    CHECK(std::any_of(std::begin(agreeing), std::end(agreeing),
                      [&](const Case& c) { return c.name == name; }));
  }
}
