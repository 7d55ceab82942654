// Where scenarios have B-bar, and with what it is refused.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>
#include <variant>

#include "io/scenario/scenario.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

struct Parts {
  std::string analysis;  ///< beside the step
  std::string type = "P2D";
  std::string generator = R"("type": "region", "per_cell": 2, "material": 0)";
  std::string cell_type = "ED2Q4";
  std::string law = R"("type": "LinearElastic", "youngs_modulus": 1e7, "poisson_ratio": 0.2)";
};

constexpr const char* explicit_step = R"("dt": 1e-5, "nsteps": 1)";
constexpr const char* implicit_step = R"("mpm_scheme": "newmark", "dt": 1e-2, "nsteps": 1)";

Scenario scenario_of(const Parts& parts) {
  return read_scenario_text(
      fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "extent": [1, 2]}}, "cell_type": "{}"}},
    "materials": [{{"density": 2650, "porosity": 0.4, "k_x": 1e-3, {}}},
                  {{"type": "Newtonian", "density": 1000, "bulk_modulus": 1e8,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{{}, "particle_type": "{}"}}}}],
    "analysis": {{{}}}}})",
                  parts.cell_type, parts.law, parts.generator, parts.type, parts.analysis),
      "");
}

bool has_b_bar(const Parts& parts) {
  return std::get<Model<2>>(scenario_of(parts).model).analysis.mean_volume;
}

/// Analysis of these keys and a step.
Parts with(std::string keys, const char* step = explicit_step) {
  return {.analysis = std::move(keys) + step};
}

std::string refusal(const Parts& parts) {
  return refusal_of([&] { scenario_of(parts); });
}

}  // namespace

TEST_CASE("B-bar is off in explicit steps, and on where implicit steps lock without it") {
  const std::string element = R"("shape_functions": "element", )";
  CHECK(!has_b_bar(with("")));
  CHECK(!has_b_bar(with(element)));
  CHECK(has_b_bar(with(element, implicit_step)));
  CHECK(!has_b_bar(with("", implicit_step)));  // quadratic splines
  CHECK(!has_b_bar(with(R"("type": "MPMImplicit2D", )", implicit_step)));
}

TEST_CASE("B-bar is chosen by one key in explicit and implicit steps") {
  for (const char* step : {explicit_step, implicit_step})
    for (const char* functions : {"element", "gimp", "quadratic_spline", "cubic_spline"}) {
      const std::string keys = fmt::format(R"("shape_functions": "{}", )", functions);
      CHECK(has_b_bar(with(keys + R"("b_bar": true, )", step)));
      CHECK(!has_b_bar(with(keys + R"("b_bar": false, )", step)));
    }
  CHECK(has_b_bar(with(R"("scheme_settings": {"b_bar": true}, )", implicit_step)));
  CHECK(!has_b_bar(with(R"("shape_functions": "element", "scheme_settings": {"b_bar": false}, )",
                        implicit_step)));
  CHECK(refusal(with(R"("b_bar": true, "scheme_settings": {"b_bar": false}, )", implicit_step)) ==
        "'b_bar' is false here and true in analysis");
  // As other settings of implicit steps, with a warning.
  CHECK(!has_b_bar(with(R"("scheme_settings": {"b_bar": true}, )")));
}

TEST_CASE("B-bar is chosen by the type of particles in CB-Geo's input") {
  for (const char* step : {explicit_step, implicit_step}) {
    Parts parts = with("", step);
    parts.type = "P2DBBAR";
    CHECK(has_b_bar(parts));
    CHECK(!says(warnings_of(scenario_of(parts)), "B-bar"));
    parts.analysis = R"("b_bar": false, )" + std::string(step);
    CHECK(!has_b_bar(parts));
  }
}

TEST_CASE("B-bar is refused where it makes no sense or is not there yet") {
  for (const std::string functions : {"cpdi", "cpdi2"})
    CHECK(refusal(with(R"("b_bar": true, "shape_functions": ")" + functions + R"(", )")) ==
          "B-bar does not go together with \"shape_functions\": \"" + functions +
              "\": corners of domains follow the gradients at particles, and volumes would not");
  CHECK(refusal(with(R"("b_bar": true, "pressure_smoothing": true, )")) ==
        "B-bar does not go together with 'pressure_smoothing'");
  Parts smoothed = with(R"("pressure_smoothing": true, )");
  smoothed.type = "P2DBBAR";
  CHECK(refusal(smoothed) == "B-bar does not go together with 'pressure_smoothing'");
  Parts wet = with(R"("b_bar": true, )");
  wet.generator = R"("type": "region", "per_cell": 2, "material": [0, 1])";
  CHECK(refusal(wet) == "B-bar is not supported yet for soil with a liquid in its pores");
  wet.analysis = R"("b_bar": false, )" + std::string(explicit_step);
  CHECK(refusal(wet) == "");
}

TEST_CASE("B-bar has no effect in triangles, which is said") {
  Parts parts = with(R"("b_bar": true, )");
  parts.cell_type = "ED2T3";
  CHECK(says(warnings_of(scenario_of(parts)),
             "B-bar has no effect: the strain of such cells is constant"));
  parts.cell_type = "ED2Q9";
  CHECK(!says(warnings_of(scenario_of(parts)), "B-bar"));
}

TEST_CASE("particles with finite strains are as others in explicit steps, which is said") {
  Parts parts = with("");
  parts.type = "P2DFS";
  CHECK(says(warnings_of(scenario_of(parts)), "particles of type \"P2DFS\" are as P2D"));
  CHECK(!has_b_bar(parts));
  parts.law = R"("type": "NeoHookean", "youngs_modulus": 1e7, "poisson_ratio": 0.2)";
  CHECK(!says(warnings_of(scenario_of(parts)), "are as P2D"));
  parts = with("", implicit_step);
  parts.type = "P2DFS";
  CHECK(!says(warnings_of(scenario_of(parts)), "are as P2D"));
}

TEST_CASE("what locks is warned of, unless there is B-bar") {
  const auto locks = [](const std::string& keys) {
    Parts parts = with(keys);
    parts.law = R"("type": "LinearElastic", "youngs_modulus": 1e7, "poisson_ratio": 0.499)";
    return says(warnings_of(scenario_of(parts)), "hardly changes its volume, and locks");
  };
  CHECK(locks(""));
  CHECK(!locks(R"("b_bar": true, )"));
}

TEST_CASE("what yields at constant volume locks, whatever its law is called") {
  const auto locks = [](const std::string& law) {
    Parts parts = with("");
    parts.law = R"("youngs_modulus": 1e7, "poisson_ratio": 0.3, )" + law;
    return says(warnings_of(scenario_of(parts)), "hardly changes its volume, and locks");
  };
  const auto soil = [](const std::string& friction, const std::string& cohesion) {
    return fmt::format(R"("type": "MohrCoulomb", "dilation": 0, "tension_cutoff": 0,
                          "friction": {}, "cohesion": {})",
                       friction, cohesion);
  };
  CHECK(locks(R"("type": "VonMises", "yield_stress": 1e4, "hardening_modulus": 0)"));
  CHECK_FALSE(locks(R"("type": "VonMises", "yield_stress": 1e9, "hardening_modulus": 0)"));
  CHECK(locks(soil("0", "1e4")));
  CHECK_FALSE(locks(soil("30", "1e4")));
  CHECK_FALSE(locks(soil("0", "1e9")));  // it never yields
}
