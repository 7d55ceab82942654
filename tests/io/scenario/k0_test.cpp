// Initial stresses of ground at rest, and what a run may end by itself for.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <variant>

#include "io/base/problems.h"
#include "io/scenario/scenario.h"
#include "tests/io/scenario/said.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

struct Ground {
  std::string region = R"({"box": {"min": [0, 0], "max": [4, 3]}})";
  std::string top = R"({"box": {"min": [0, 3], "max": [4, 5]}})";
  std::string k0 = R"("jaky", "materials": [{"material": "clay", "k0": 0.7}])";
  std::string more = "";  ///< in particles_stresses
  std::string gravity = "[0, -10]";
  std::string analysis = "";  ///< beside step and number of steps
};

Model<2> ground(const Ground& parts) {
  return std::get<Model<2>>(
      std::move(read_scenario_text(fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 6]}},
             "particles_stresses": {{"type": "k0", "k0": {}{}}}}},
    "materials": [
      {{"name": "clay", "type": "LinearElastic", "density": 2000, "youngs_modulus": 1e7,
        "poisson_ratio": 0.3}},
      {{"name": "sand", "type": "MohrCoulomb", "density": 1500, "youngs_modulus": 1e7,
        "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 0, "tension_cutoff": 0}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": 2, "material": "clay", "region": {}}}}},
      {{"generator": {{"type": "region", "per_cell": 2, "material": "sand", "region": {}}}}}],
    "external_loading_conditions": {{"gravity": {}}},
    "analysis": {{"shape_functions": "element", {} "dt": 1e-4, "nsteps": 1}}}})",
                                               parts.k0, parts.more, parts.region, parts.top,
                                               parts.gravity, parts.analysis),
                                   "")
                    .model));
}

std::string refusal(const Ground& parts) {
  return refusal_of([&] { ground(parts); });
}

}  // namespace

TEST_CASE("a stress at the beginning that a soil does not bear is warned of") {
  const auto said = [](const char* xx) {
    const Scenario s = read_scenario_text(fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 6]}}}},
      "materials": [{{"name": "sand", "type": "MohrCoulomb", "density": 1500,
                      "youngs_modulus": 1e7, "poisson_ratio": 0.3, "friction": 30, "dilation": 0,
                      "cohesion": 0, "tension_cutoff": 0}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "sand",
        "stress": [-{}e4, -1e4, -1e4, 0, 0, 0], "region": {{"box": {{"max": [4, 3]}}}}}}}}],
      "external_loading_conditions": {{"gravity": [0, -10]}},
      "analysis": {{"dt": 1e-4, "nsteps": 1}}}})",
                                                      xx),
                                          "");
    return format_problems(s.warnings, "warning");
  };
  // The sand bears 1/3 to 3 times the stress of the other directions.
  CHECK(said("0.2").find("'sand' does not bear the stress at the beginning at 100 % of its "
                         "particles") != std::string::npos);
  CHECK(said("0.34").find("does not bear") == std::string::npos);
  CHECK(said("2.9").find("does not bear") == std::string::npos);
  CHECK(said("3.1").find("does not bear") != std::string::npos);
}

namespace {

/// Warnings of 3 m of soil with this law, at rest: up to 54 kPa.
std::string said_at_rest(const std::string& law, const std::string& k0 = "0.7") {
  return warnings_of(read_scenario_text(fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 0.5, "extent": [4, 6]}},
                "particles_stresses": {{"type": "k0", "k0": {}}}}},
      "materials": [{{"name": "soil", "density": 1800, {}}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "soil",
                                     "region": {{"box": {{"max": [4, 3]}}}}}}}}],
      "external_loading_conditions": {{"gravity": [0, -10]}},
      "analysis": {{"dt": 1e-4, "nsteps": 1}}}})",
                                                    k0, law),
                                        ""));
}

}  // namespace

TEST_CASE("so are stresses of ground at rest beyond the yield surface of clay and critical sand") {
  const auto clay = [](const std::string& pc0) {
    return said_at_rest(R"("type": "ModifiedCamClay", "youngs_modulus": 1e7, "poisson_ratio": 0.3,
      "p_ref": 1e5, "e_ref": 1, "ocr": 1, "m": 1, "lambda": 0.2, "kappa": 0.04, "pc0": )" +
                        pc0);
  };
  const auto sand = [](const std::string& image) {
    return said_at_rest(R"("type": "NorSand", "poisson_ratio": 0.2, "reference_pressure": 1e5,
      "friction_cs": 27, "N": 0.3, "lambda": 0.11, "kappa": 0.03, "gamma": 1.3, "chi": 3.5,
      "hardening_modulus": 200, "void_ratio_initial": 0.85, "p_image_initial": )" +
                        image);
  };
  const std::string not_borne = "'soil' does not bear the stress at the beginning at ";
  CHECK(says(clay("2e4"), not_borne));
  CHECK_FALSE(says(clay("2e5"), not_borne));
  CHECK(says(sand("5e3"), not_borne));
  CHECK_FALSE(says(sand("1e5"), not_borne));
}

TEST_CASE("K0 beyond Rankine's stresses is warned of, with these") {
  const auto sand = [](const std::string& k0) {
    return said_at_rest(R"("type": "MohrCoulomb", "youngs_modulus": 1e7, "poisson_ratio": 0.3,
      "friction": 30, "dilation": 0, "cohesion": 0, "tension_cutoff": 0)",
                        k0);
  };
  const std::string not_borne = "which the material soil does not bear: 0.33 to 3";
  CHECK(says(sand("0.3"), not_borne));
  CHECK(says(sand("3.5"), not_borne));
  CHECK_FALSE(says(sand("0.33"), "does not bear"));  // 1/3 with two digits
}

TEST_CASE("level layers at rest have the weight above them, and K0 of it across") {
  for (const double surcharge : {0.0, 1000.0}) {
    const Model<2> model = ground({.more = fmt::format(R"(, "surcharge": {})", surcharge)});
    const auto& p = model.particles;
    REQUIRE(p.stress.size() == p.x.size());
    for (std::size_t i = 0; i < p.x.size(); ++i) {
      const double y = p.x[i][1];
      const bool sand = p.material[i] == 1;
      const double weight = surcharge + 10 * (sand ? 1500 * (5 - y) : 1500 * 2 + 2000 * (3 - y));
      CHECK(p.stress[i][1] == doctest::Approx(-weight));
      CHECK(p.stress[i][0] == doctest::Approx(-(sand ? 0.5 : 0.7) * weight));
      CHECK(p.stress[i][2] == p.stress[i][0]);
      CHECK(p.stress[i][3] == 0);
    }
  }
}

TEST_CASE("what is in the air does not weigh on the ground below it") {
  const Model<2> model = ground({.top = R"({"box": {"min": [1, 4.5], "max": [3, 5.5]}})"});
  const auto& p = model.particles;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const double y = p.x[i][1];
    const double weight = 10 * (p.material[i] == 1 ? 1500 * (5.5 - y) : 2000 * (3 - y));
    CHECK(p.stress[i][1] == doctest::Approx(-weight));
  }
}

TEST_CASE("under a plane slope the weight above follows the ground") {
  // Rows of particles end at the ground: it is known to a part of a cell.
  const Model<2> model =
      ground({.region = R"({"polygon": {"points": [[0, 0], [4, 0], [4, 2], [0, 4]]}})",
              .top = R"({"box": {"min": [0, 5.5], "max": [0.5, 6]}})",
              .k0 = "0.5"});
  const auto& p = model.particles;
  double worst = 0;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    if (p.x[i][0] < 1 || p.material[i] == 1) continue;  // above is other material
    const double depth = 4 - 0.5 * p.x[i][0] - p.x[i][1];
    worst = std::max(worst, std::abs(-p.stress[i][1] / 20000 - depth));
  }
  CHECK(worst < 0.13);  // m; half a particle
}

TEST_CASE("under a slope that cuts cells the weight above follows the ground with all functions") {
  for (const char* functions : {"element", "gimp", "quadratic_spline", "cubic_spline"}) {
    CAPTURE(functions);
    const std::string text = fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 0.5, "extent": [8, 6]}},
               "particles_stresses": {{"type": "k0", "k0": 0.5}}}},
      "geometry": {{"ground": {{"points": [[0, 5.3], [8, 1.7]]}},
                    "till": {{"surface": "ground", "lower_by": 0.8}}}},
      "materials": [{{"name": "clay", "type": "LinearElastic", "density": 2000,
                      "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2,
                      "layers": [{{"below": "ground", "material": "clay"}},
                                 {{"below": "till", "material": "clay"}}]}}}}],
      "external_loading_conditions": {{"gravity": [0, -10]}},
      "analysis": {{"shape_functions": "{}", "dt": 1e-4, "nsteps": 1}}}})",
                                         functions);
    const auto model = std::get<Model<2>>(read_scenario_text(text, "").model);
    double worst = 0;
    for (std::size_t i = 0; i < model.particles.x.size(); ++i) {
      const Vec<2>& x = model.particles.x[i];
      const double depth = 5.3 - 0.45 * x[0] - x[1];
      worst = std::max(worst, std::abs(-model.particles.stress[i][1] / 20000 - depth));
    }
    CHECK(worst < 0.15);  // m
  }
}

TEST_CASE("gravity may act along any axis, either way") {
  const Model<2> model = ground({.k0 = "0.5", .gravity = "[0, 10]"});
  const auto& p = model.particles;
  for (std::size_t i = 0; i < p.x.size(); ++i)
    CHECK(p.stress[i][1] ==
          doctest::Approx(-10 *
                          (p.material[i] == 0 ? 2000 * p.x[i][1] : 6000 + 1500 * (p.x[i][1] - 3))));
}

TEST_CASE("initial stresses at rest are refused where they cannot be found") {
  CHECK(says(refusal({.k0 = "\"jaky\""}), "\"jaky\" needs a friction angle"));
  CHECK(says(refusal({.k0 = "-1"}), "'k0' must be"));
  CHECK(says(refusal({.k0 = R"(1, "materials": [{"material": "silt", "k0": 1}])"}), "silt"));
  const std::string unknown = R"({"box": {"max": [1, 1]}}}}, {"generator": {"type": "region",
      "per_cell": 1, "material": "silt", "region": {"box": {"min": [1, 0], "max": [4, 3]}})";
  CHECK(says(refusal({.region = unknown}), "silt"));
  CHECK(says(refusal({.gravity = "[1, -10]"}), "\"k0\" needs gravity along an axis"));
  CHECK(says(refusal({.gravity = R"({"gravity": [0, -10], "ramping_time": 1})"}),
             "gravity that acts from the beginning"));
}

TEST_CASE("initial stresses at rest are those of the first stage: later ones may tilt gravity") {
  const std::string text = R"({
    "mesh": {"structured": {"cell_size": 1, "extent": [4, 4]},
             "particles_stresses": {"type": "k0", "k0": 0.5}},
    "materials": [{"type": "LinearElastic", "density": 2000, "youngs_modulus": 1e7,
                   "poisson_ratio": 0.2}],
    "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [4, 2]}}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"nsteps": 1},
    "stages": [{"name": "rest"},
      {"name": "tilts", "external_loading_conditions": {"gravity": [1, -10]},
       "place": [{"generator": {"type": "region", "per_cell": 1, "material": 0, "stress": [-5],
                                "region": {"box": {"min": [0, 2], "max": [1, 3]}}}}]},
      {"name": "grows",
       "external_loading_conditions": {"gravity": {"gravity": [0, -20], "ramping_time": 1}}}]})";
  const auto stress = [&](std::size_t stage, std::size_t particle) {
    ScenarioOptions options;
    options.stage = stage;
    const Scenario scenario = read_scenario_text(text, "", options);
    return std::get<Model<2>>(scenario.model).particles.stress.at(particle)[1];
  };
  CHECK(stress(0, 0) == doctest::Approx(-30000));
  for (const std::size_t stage : {1, 2}) CHECK(stress(stage, 8) == -5);
}

TEST_CASE("the end at rest has bounds, and is for runs that have a measure of it") {
  const Model<2> model = ground({.analysis = R"("until": {"imbalance": 1e-2},)"});
  CHECK(model.analysis.until.imbalance == 1e-2);
  CHECK(model.analysis.until.kinetic == within(1e-5, 1e-4));
  CHECK_FALSE(ground({}).analysis.until.on());
  CHECK(says(refusal({.analysis = R"("until": {"imbalance": 1e-2}, "mpm_scheme": "newmark",)"}),
             "'until' is for explicit and for quasi-static steps"));
  CHECK(says(refusal({.analysis = R"("until": {"kinetic_energy": 1e-2},)"}), "'imbalance'"));
}
