// Parameters of materials that differ from place to place.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "io/base/problems.h"
#include "io/scenario/scenario.h"
#include "io/scenario/stages.h"
#include "tests/io/base/thread_team.h"
#include "tests/within.h"

using namespace lahar;

namespace {

std::string scenario(const std::string& youngs_modulus, const std::string& cohesion,
                     const std::string& more = "", const std::string& analysis = "") {
  return fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "counts": [120, 40]}}}},
    "materials": [{{"name": "rock", "type": "LinearElastic", "density": 2500,
                    "youngs_modulus": 1e9, "poisson_ratio": 0.2}},
                  {{"name": "clay", "type": "MohrCoulomb", "density": 2000,
                    "youngs_modulus": {}, "poisson_ratio": 0.3, "friction": 20, "dilation": 0,
                    "cohesion": {}, "tension_cutoff": 0}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": "rock",
                     "region": {{"box": {{"min": [0, 0], "max": [60, 5]}}}}}}}},
                  {{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
                     "region": {{"box": {{"min": [0, 5], "max": [60, 20]}}}}}}}}{}],
    "analysis": {{"nsteps": 1{}}}}})",
                     youngs_modulus, cohesion, more, analysis);
}

Model<2> model_of(const std::string& text, const Team* team = nullptr) {
  return std::get<Model<2>>(read_scenario_text(text, "", {.overrides = {}, .team = team}).model);
}

std::string problems_of(const std::string& text) {
  try {
    read_scenario_text(text, "");
  } catch (const InputError& error) {
    return format_problems(error.problems());
  }
  return "";
}

const MohrCoulomb& clay_at(const Model<2>& model, std::size_t p) {
  return std::get<MohrCoulomb>(model.materials[model.particles.material[p]].law);
}

const char* const random_cohesion = R"({"mean": 2e4, "cov": 0.3, "correlation_length": [4, 1],
  "seed": 7})";
const char* const deeper = R"({"at_depth": [[0, 1e7], [10, 5e7]], "below": 20})";

}  // namespace

TEST_CASE("a profile over depth is right to 1 % of its range at every particle") {
  const Model<2> model = model_of(scenario(deeper, "1e4"));
  Index clay = 0;
  for (std::size_t p = 0; p < model.particles.x.size(); ++p) {
    if (model.materials[model.particles.material[p]].id != 1) continue;
    ++clay;
    const double depth = 20 - model.particles.x[p][1];
    const double expected = 1e7 + 4e6 * std::min(depth, 10.0);
    CHECK(std::abs(clay_at(model, p).youngs_modulus - expected) < 0.01 * 4e7);
    CHECK(clay_at(model, p).cohesion == 1e4);
  }
  CHECK(clay == 120 * 30 * 4);
}

TEST_CASE("depths count from a surface, where the ground is not level") {
  const std::string text = scenario(
      R"({"at_depth": [[0, 1e7], [10, 5e7]], "below": "ground"})", "1e4",
      R"(], "geometry": {"ground": {"points": [[0, 20], [60, 14]]}}, "math_functions": [)");
  const Model<2> model = model_of(text);
  for (std::size_t p = 0; p < model.particles.x.size(); ++p) {
    if (model.materials[model.particles.material[p]].id != 1) continue;
    const Vec<2>& x = model.particles.x[p];
    const double depth = std::clamp(20 - 0.1 * x[0] - x[1], 0.0, 10.0);
    CHECK(std::abs(clay_at(model, p).youngs_modulus - (1e7 + 4e6 * depth)) < 0.01 * 4e7);
  }
  CHECK(problems_of(scenario(R"({"at_depth": [[0, 1e7]], "below": "grund"})", "1e4"))
            .find("'below' must name a surface; 'grund' is not in geometry") != std::string::npos);
}

TEST_CASE("a random field has its mean, its variation and its correlation among particles") {
  double mean = 0, square = 0, near = 0;
  constexpr int seeds = 30;
  Index n = 0, pairs = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    const Model<2> model = model_of(
        scenario("1e7", fmt::format(R"({{"mean": 2e4, "cov": 0.3, "correlation_length": [4, 1],
                               "seed": {}}})",
                                    seed)));
    const auto& x = model.particles.x;
    for (std::size_t p = 0; p < x.size(); p += 7) {
      if (model.materials[model.particles.material[p]].id != 1) continue;
      const double c = clay_at(model, p).cohesion;
      CHECK(c > 0);
      mean += c;
      square += c * c;
      ++n;
      // Two metres further along x: half of the correlation length.
      if (p + 16 < x.size() && std::abs(x[p + 16][0] - x[p][0] - 2) < 1e-9 &&
          std::abs(x[p + 16][1] - x[p][1]) < 1e-9) {
        near += std::log(c / 2e4) * std::log(clay_at(model, p + 16).cohesion / 2e4);
        ++pairs;
      }
    }
  }
  mean /= static_cast<double>(n);
  const double deviation = std::sqrt(square / static_cast<double>(n) - mean * mean);
  CHECK(mean == test::within(0.02, 2e4));
  CHECK(deviation / mean == test::within(0.05, 0.3));
  REQUIRE(pairs > 1000);
  const double s2 = std::log1p(0.09), offset = -0.5 * s2;  // of the logarithm
  const double correlation = (near / static_cast<double>(pairs) - offset * offset) / s2;
  CHECK(correlation == test::within(0.12, std::exp(-0.25 * 3.14159265)));
}

TEST_CASE("classes of a field have the id and name of their material, and others keep theirs") {
  const Model<2> model = model_of(scenario(deeper, random_cohesion));
  CHECK(model.materials.size() > 100);
  std::set<std::uint16_t> used;
  for (const auto m : model.particles.material) used.insert(m);
  CHECK(used.size() == model.materials.size());  // none is idle
  CHECK(model.materials[0].name == "rock");
  for (std::size_t m = 1; m < model.materials.size(); ++m) {
    CHECK(model.materials[m].id == 1);
    CHECK(model.materials[m].name == "clay");
    CHECK(model.materials[m].density == 2000);
  }
}

TEST_CASE("fields of one seed rise and fall together") {
  const Model<2> model = model_of(scenario(
      R"({"mean": 1e7, "cov": 0.2, "correlation_length": [4, 1], "seed": 7})", random_cohesion));
  CHECK(model.materials.size() < 70);  // not the product of both
}

TEST_CASE("fields are the same for every team that reads a scenario") {
  const std::string text = scenario(deeper, random_cohesion);
  const Model<2> whole = model_of(text);
  for (const int size : {2, 3}) {
    run_team(size, [&](const Team& team) {
      const Model<2> part = model_of(text, &team);
      REQUIRE(part.materials.size() == whole.materials.size());
      for (std::size_t m = 1; m < part.materials.size(); ++m)
        CHECK(std::get<MohrCoulomb>(part.materials[m].law).cohesion ==
              std::get<MohrCoulomb>(whole.materials[m].law).cohesion);
      for (std::size_t p = 0; p < part.particles.x.size(); ++p)
        CHECK(part.particles.material[p] ==
              whole.particles.material[static_cast<std::size_t>(part.particles.id_of(p))]);
    });
  }
}

TEST_CASE("fields that cannot be are refused, with what is possible") {
  const auto said = [](const std::string& cohesion) {
    return problems_of(scenario("1e7", cohesion));
  };
  const auto has = [](const std::string& text, const char* part) {
    CAPTURE(text);
    CHECK(text.find(part) != std::string::npos);
  };
  const char* const one = "'cohesion' needs one of 'mean', 'at_depth' and 'raster'";
  has(said(R"({"seed": 1})"), one);
  has(said(R"({"mean": 1, "at_depth": [[0, 1]]})"), one);
  has(said(R"({"at_depth": [[0, 1]], "below": 20, "cov": 0.1})"),
      "'cov' has no meaning in a profile");
  has(said(R"({"raster": "c.asc"})"), "maps of parameters are for three dimensions");
  has(said(R"({"raster": true})"), "'raster' must be");
  has(said(R"({"mean": []})"), "'mean' must be");
  has(said(R"({"at_depth": 1, "below": 20})"), "'at_depth' must be");
  CHECK(said(R"({"seed": 1})").find("must be a number") == std::string::npos);
  has(said(R"({"mean": 1e4})"), "'cov' is missing in a random field");
  has(said(R"({"mean": 1e4, "cov": 0.1})"), "'correlation_length' is missing in a random field");
  has(said(R"({"mean": 1e4, "cov": 0.1, "correlation_length": [1, 0]})"),
      "'correlation_length' must be greater than 0 [m], found 0");
  has(said(R"({"mean": -1e4, "cov": 0.1, "correlation_length": 1})"),
      "the mean of a log-normal field must be greater than 0, found -10000");
  has(said(R"({"mean": 1e4, "cov": 0.5, "correlation_length": 1, "distribution": "normal"})"),
      "'cohesion' becomes -9.69e+03 in parts of this field; it must be at least 0");
  CHECK(said(R"({"mean": 1e4, "cov": 0.5, "correlation_length": 1, "distribution": "normal",
                 "min": 0})") == "");
  has(said(R"({"at_depth": [[0, 1e4], [10, 2e4]]})"), "'below' is missing beside 'at_depth'");
  has(said(R"({"at_depth": [[5, 1e4], [5, 2e4]], "below": 20})"),
      "depths of 'at_depth' must be ascending");
  has(said(R"({"at_depth": [[0, 1e4]], "below": 20, "slope": 2})"),
      "unknown key 'slope' in a field of a material");
  const std::string injected = R"(, {"generator": {"type": "inject", "cset": "in",
      "nparticles_per_dir": 2, "velocity": [0, 0], "material": "clay"}}],
    "sets": {"cells": {"in": {"box": {"min": [0, 19], "max": [1, 20]}}}}, "math_functions": [)";
  has(problems_of(scenario(deeper, "0", injected)),
      "material 'clay' has fields, which do not go together with particles that come in");
}

namespace {

/// Clay with a profile of stiffness, of which two stages place more, and what the last one changes.
std::string staged(const std::string& changes) {
  std::string text = scenario(deeper, "1e4");
  const auto place = [](int from, int to) {
    return fmt::format(R"([{{"generator": {{"type": "region", "per_cell": 2, "material": "clay",
      "region": {{"box": {{"min": [{}, 20], "max": [{}, 22]}}}}}}}}])",
                       from, to);
  };
  text.insert(text.size() - 1, fmt::format(R"(, "stages": [{{"name": "first"}},
    {{"name": "second", "place": {}}}, {{"name": "third", "place": {}{}}}])",
                                           place(0, 10), place(20, 25), changes));
  text.replace(text.find("[0, 1e7]"), 8, "[-5, 1e6], [0, 1e7]");
  text.replace(text.find("[120, 40]"), 9, "[120, 50]");
  return text;
}

Scenario stage_of(const std::string& text, std::size_t stage, const Team* team = nullptr) {
  ScenarioOptions options;
  options.stage = stage;
  options.team = team;
  return read_scenario_text(text, "", options);
}

}  // namespace

TEST_CASE("particles that stages place leave the classes of others as they were") {
  const std::string text = staged("");
  const Scenario first = stage_of(text, 0), second = stage_of(text, 1), third = stage_of(text, 2);
  check_body(body_of(first), second);
  check_body(body_of(second), third);
  const auto& before = std::get<Model<2>>(second.model);
  const auto& after = std::get<Model<2>>(third.model);
  CHECK(std::get<Model<2>>(first.model).materials.size() < before.materials.size());
  REQUIRE(before.particles.x.size() < after.particles.x.size());
  for (std::size_t p = 0; p < before.particles.x.size(); ++p)
    REQUIRE(after.particles.material[p] == before.particles.material[p]);
  for (std::size_t p = before.particles.x.size(); p < after.particles.x.size(); ++p)
    CHECK(clay_at(after, p).youngs_modulus < 1e7);
  run_team(3, [&](const Team& team) {
    const Scenario part = stage_of(text, 2, &team);
    CHECK(part.classes == third.classes);
    const auto& particles = std::get<Model<2>>(part.model).particles;
    for (std::size_t p = 0; p < particles.x.size(); ++p)
      REQUIRE(particles.material[p] ==
              after.particles.material[static_cast<std::size_t>(particles.id_of(p))]);
  });
}

TEST_CASE("a stage cannot move a field where particles are that another stage placed") {
  std::string materials = staged("");
  materials = materials.substr(materials.find("\"materials\""));
  materials = materials.substr(0, materials.find("\"particles\""));
  materials.replace(materials.find("-5, 1e6"), 7, "-1, 1e6");
  const std::string text = staged(", " + materials.substr(0, materials.rfind(',')));
  const StageBody before = body_of(stage_of(text, 1));
  const Scenario third = stage_of(text, 2);
  CHECK_THROWS_WITH_AS(check_body(before, third), doctest::Contains("where fields of materials"),
                       InputError);
}

TEST_CASE("no stage can give particles a material with fields") {
  const std::string text =
      staged(R"(, "change_material": [{"region": {"all": true}, "material": "clay"}])");
  CHECK_NOTHROW(stage_of(text, 1));
  CHECK_THROWS_WITH_AS(stage_of(text, 2),
                       doctest::Contains("material 'clay' has fields, which do not go together "
                                         "with 'change_material'"),
                       InputError);
}

TEST_CASE("a random field that changes within a particle is warned of") {
  const auto rough = [](const std::string& length) {
    const std::string field =
        fmt::format(R"({{"mean": 2e4, "cov": 0.3, "correlation_length": {}, "seed": 7}})", length);
    const Scenario s = read_scenario_text(scenario("1e7", field), "");
    return format_problems(s.warnings, "warning").find("is below the distance of particles") !=
           std::string::npos;
  };
  CHECK(rough("0.1"));
  CHECK(rough("[4, 0.1]"));
  CHECK_FALSE(rough("[4, 1]"));
}
