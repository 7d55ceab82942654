// The picture of `lahar check --picture`.
#include "runtime/program/model_picture.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/scenario/scenario.h"
#include "runtime/picture/svg.h"
#include "runtime/picture/view.h"

using namespace lahar;

namespace {

std::string picture_of(const std::string& text) {
  std::vector<ModelMark> marks;
  const Scenario scenario = read_scenario_text(text, "", {.overrides = {}, .marks = &marks});
  return model_picture(scenario.model, marks);
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

std::string slope(int cells) {
  return fmt::format(R"({{"title": "A <slope>",
    "mesh": {{"structured": {{"cell_size": {}, "counts": [{}, {}]}},
      "boundary_conditions": {{
        "walls": [{{"nset": "floor", "normal": [0, 1], "friction": 0.5}}],
        "velocity_constraints": [{{"nset": "left", "dir": "x", "velocity": 0}},
                                 {{"nset": "left", "dir": "y", "velocity": 0}}],
        "particles_velocity_constraints": [
          {{"pset": "plate", "dir": "y", "velocity": -0.5, "math_function_id": "push"}}]}}}},
    "math_functions": [{{"name": "push", "type": "Linear", "xvalues": [0, 1],
                         "fxvalues": [0, 1]}}],
    "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                         "left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}}}}}},
    "materials": [{{"name": "clay & sand", "type": "LinearElastic", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}},
                  {{"name": "steel", "type": "LinearElastic", "density": 2000,
                    "youngs_modulus": 1e7, "poisson_ratio": 0.3}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": 2, "material": "clay & sand",
                       "region": {{"box": {{"max": [8, 4]}}}}}}}},
      {{"generator": {{"type": "region", "per_cell": 2, "material": "steel", "pset": "plate",
                       "region": {{"box": {{"min": [2, 4], "max": [4, 5]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"nsteps": 1}}}})",
                     10.0 / cells, cells, cells);
}

}  // namespace

TEST_CASE("a picture of a model names its materials, walls, constraints and gravity") {
  const std::string svg = picture_of(slope(20));
  for (const std::string text :
       {"A &lt;slope&gt;", "clay &amp; sand, 512 particles", "steel, 32 particles",
        "floor: wall, friction 0.5", "left: held in x, y",
        "plate: particles move in y -0.5 m/s times a function", "gravity 9.81 m/s^2",
        "mesh of 400 cells", "x [m]", "y [m]"}) {
    CAPTURE(text);
    CHECK(svg.find(text) != std::string::npos);
  }
  CHECK(svg.find("<slope>") == std::string::npos);
}

TEST_CASE("a picture is hardly larger for a hundred times as many particles") {
  const std::string small = picture_of(slope(20)), large = picture_of(slope(200));
  CHECK(large.size() < 3 * small.size() + 100000);
  CHECK(count(large, "<rect") < 2000);
}

TEST_CASE("a model in three dimensions has a plan and two sections") {
  const std::string svg = picture_of(R"({
    "mesh": {"structured": {"cell_size": 0.5, "counts": [8, 6, 4]},
      "boundary_conditions": {"walls": [{"nset": "base", "normal": [0, 0, 1], "friction": "rough"}]},
      "particles_pore_pressures": {"type": "water_table",
        "water_tables": [{"position": 0, "h0": 1}, {"position": 4, "h0": 0.5}]}},
    "sets": {"nodes": {"base": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}}}},
    "materials": [{"name": "soil", "type": "LinearElastic", "density": 2650,
                   "youngs_modulus": 1e7, "poisson_ratio": 0.3, "porosity": 0.4, "k_x": 1e-3},
                  {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e7,
                   "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": ["soil", "water"],
                   "region": {"box": {"max": [4, 3, 1]}}}}],
    "external_loading_conditions": {"gravity": [0, 0, -9.81]}, "analysis": {"nsteps": 1}})");
  for (const std::string text :
       {"Plan", "Section at y = 1.5 m", "Section at x = 2 m", "base: rough wall", "water table"}) {
    CAPTURE(text);
    CHECK(svg.find(text) != std::string::npos);
  }
}

TEST_CASE("a raster draws boxes where they are, with those in front before others") {
  View view{.name = "", .axes = {0, 1}, .low = {0, 0}, .high = {10, 5}};
  view.fit({300, 300});
  CHECK(view.size[0] == doctest::Approx(300));
  CHECK(view.size[1] == doctest::Approx(150));
  ViewRaster raster(view);
  raster.fill({1, 1}, {2, 2}, 0, 1.0);
  raster.fill({1, 1}, {3, 2}, 1, 0.0);  // behind the first
  raster.fill({20, 1}, {30, 2}, 2);     // outside
  raster.fill({9, 4}, {9, 4}, 3);       // a point
  Svg svg(400, 400);
  raster.draw(svg, [](int value) { return fmt::format("#{}", value); });
  const std::string text = svg.finish();
  CHECK(text.find("x=\"30.00\" y=\"90.00\" width=\"30.00\" height=\"30.00\"") != std::string::npos);
  CHECK(text.find("x=\"60.00\" y=\"90.00\" width=\"30.00\" height=\"30.00\"") != std::string::npos);
  CHECK(count(text, "\"#0\"") == 1);
  CHECK(count(text, "\"#1\"") == 1);
  CHECK(count(text, "\"#2\"") == 0);
  CHECK(count(text, "\"#3\"") == 1);
  CHECK(raster.filled().size() == 201);
}

TEST_CASE("a thin model is stretched, and says so") {
  View view{.name = "Model", .axes = {0, 1}, .low = {0, 0}, .high = {300, 1.25}};
  view.fit({760, 560});
  CHECK(view.size[1] == doctest::Approx(152));
  CHECK(view.stretch() == doctest::Approx(48));
}
