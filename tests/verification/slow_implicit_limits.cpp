// Quasi-static steps to limit loads and beyond yield, and with hardly any change of volume: Cook's
// membrane, Prandtl's footing, a thick-walled cylinder.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/verification/case.h"
#include "tests/verification/cook_membrane.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// One quasi-static step.
void make_quasi_static(Model<2>& model) {
  model.analysis.scheme = Scheme::newmark;
  model.analysis.implicit.quasi_static = true;
  model.analysis.step.dt = 1;
  model.analysis.nsteps = 1;
}

/// How far the corner of Cook's membrane goes up, over the load.
double membrane(Index n, bool b_bar) {
  Model<2> model = cook_membrane(n);
  make_quasi_static(model);
  model.analysis.mean_volume = b_bar;
  ImplicitSteps& steps = model.analysis.implicit;
  steps.displacement_tolerance = 0;
  steps.residual_tolerance = 1e-14;
  Simulation simulation(std::move(model));
  simulation.run();
  return cook_corner(simulation);
}

/// A thick-walled cylinder, a = 1, b = 2, of Tresca's material, plastic up to r = c.
constexpr double a = 1, b = 2, c = 1.5, cohesion = 1, E = 1e4, nu = 0.3;

struct Ring {
  double radial, hoop;  ///< largest errors of cells' means over 2 cohesion
  double displacement;  ///< error of that of the last cells, relative
};

Ring cylinder(Index n, int steps, bool b_bar) {
  const Index n_theta = 3 * n / 2;
  Model<2> model = body_of_cells(n, n_theta, [](double s, double t) {
    const double r = a + (b - a) * s, theta = 0.5 * std::numbers::pi * t;
    return Vec<2>(r * std::cos(theta), r * std::sin(theta));
  });
  model.materials = {{.id = 0,
                      .name = "steel",
                      .density = 1000,
                      .law = MohrCoulomb{.youngs_modulus = E,
                                         .poisson_ratio = nu,
                                         .friction = 0,
                                         .dilation = 0,
                                         .cohesion = cohesion,
                                         .tension_cutoff = 1e9}}};
  make_quasi_static(model);
  model.analysis.mean_volume = b_bar;
  // Hill 1950: p = 2 k (ln(c / a) + (1 - c^2 / b^2) / 2).
  const double k = cohesion, pressure = 2 * k * (std::log(c / a) + 0.5 * (1 - c * c / (b * b)));
  const auto node = [&](Index i, Index j) { return i + j * (n + 1); };
  for (Index j = 0; j < n_theta; ++j) {
    const Vec<2> edge = model.mesh->node(node(0, j + 1)) - model.mesh->node(node(0, j));
    const Vec<2> half = 0.5 * pressure * Vec<2>(edge[1], -edge[0]);
    for (const Index at : {j, j + 1})
      for (int d = 0; d < 2; ++d)
        entries_of<NodeForce>(model).push_back(
            {.node = node(0, at), .dir = d, .force = half[d], .function = 0});
  }
  for (Index i = 0; i <= n; ++i) {
    entries_of<NodeVelocity>(model).push_back({node(i, 0), 1, 0});
    entries_of<NodeVelocity>(model).push_back({node(i, n_theta), 0, 0});
  }
  model.functions = {MathFunction{.x = {0, 1}, .f = {0, 1}}};
  model.analysis.step.dt = 1.0 / steps;
  model.analysis.nsteps = steps;
  Simulation simulation(std::move(model));
  simulation.run();
  const State state(simulation.frame());
  Ring worst{};
  for (Index first = 0; first < state.size(); first += 4) {
    double radial = 0, hoop = 0;
    for (Index p = first; p < first + 4; ++p) {
      const double x = state.x(p, 0), y = state.x(p, 1), r2 = x * x + y * y, r = std::sqrt(r2);
      const double xx = state.get("stress", p, 0), yy = state.get("stress", p, 1),
                   xy = state.get("stress", p, 3);
      const double s = (x * x * xx + y * y * yy + 2 * x * y * xy) / r2;
      const double elastic = k * c * c / (b * b);
      const double exact_s =
          r < c ? -pressure + 2 * k * std::log(r / a) : elastic * (1 - b * b / r2);
      const double exact_t = r < c ? exact_s + 2 * k : elastic * (1 + b * b / r2);
      radial += 0.25 * (s - exact_s) / (2 * k);
      hoop += 0.25 * (xx + yy - s - exact_t) / (2 * k);
      if (r > b - (b - a) / static_cast<double>(n)) {
        const double u =
            (x * state.get("displacement", p, 0) + y * state.get("displacement", p, 1)) / r;
        const double exact = (1 + nu) * k * c * c / (b * b) / E * ((1 - 2 * nu) * r + b * b / r);
        worst.displacement = std::max(worst.displacement, std::abs(u / exact - 1));
      }
    }
    worst.radial = std::max(worst.radial, std::abs(radial));
    worst.hoop = std::max(worst.hoop, std::abs(hoop));
  }
  const SolveCounts solves = simulation.info().solves;
  MESSAGE(n << " cells, " << steps << " steps, B-bar " << b_bar << ": radial " << worst.radial
            << ", hoop " << worst.hoop << ", displacement " << worst.displacement << ", iterations "
            << solves.iterations);
  return worst;
}

/// A rough footing that goes down, as in slow_footing.cpp, with 2 x 2 particles per cell, by 0.2 %
/// of its half width in a second. The clay is so rigid that it flows when its shape has hardly
/// changed.
Model<2> footing_model(const std::string& functions, int cells, int steps, bool b_bar) {
  constexpr double G = 5000, poisson = 0.45;
  const double h = 1.0 / cells;
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {h}, "extent": [5, {top}]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "sides", "dir": "x", "velocity": 0}},
               {{"nset": "base", "dir": "x", "velocity": 0}},
               {{"nset": "base", "dir": "y", "velocity": 0}},
               {{"nset": "footing", "dir": "x", "velocity": 0}},
               {{"nset": "footing", "dir": "y", "velocity": -0.002}}]}}}},
    "sets": {{"nodes": {{
      "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                          {{"half_space": {{"point": [5, 0], "normal": [-1, 0]}}}}]}},
      "base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "footing": {{"box": {{"min": [0, {driven}], "max": [{reach}, {top}]}}}}}}}},
    "materials": [
      {{"type": "MohrCoulomb", "density": 1, "youngs_modulus": {E}, "poisson_ratio": {nu},
       "friction": 0, "dilation": 0, "cohesion": 1, "tension_cutoff": 1e9, "softening": false}},
      {{"type": "LinearElastic", "density": 1, "youngs_modulus": {E}, "poisson_ratio": 0}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                     "region": {{"box": {{"min": [0, 0], "max": [5, 3]}}}}}}}},
      {{"generator": {{"type": "region", "per_cell": 2, "material": 1,
                     "region": {{"box": {{"min": [0, 3], "max": [1, {block}]}}}}}}}}],
    "analysis": {{"mpm_scheme": "newmark", "shape_functions": "{functions}", "dt": {dt},
                 "nsteps": {steps}, "scheme_settings": {{"quasi_static": true,
                                              "relative_residual_tolerance": 1e-4}}}}}})",
      fmt::arg("h", h), fmt::arg("top", 3 + 7 * h), fmt::arg("driven", 3 + 2 * h),
      fmt::arg("reach", 1 + h), fmt::arg("E", 2 * G * (1 + poisson)), fmt::arg("nu", poisson),
      fmt::arg("block", 3 + 5 * h), fmt::arg("functions", functions), fmt::arg("dt", 1.0 / steps),
      fmt::arg("steps", steps)));
  model.analysis.mean_volume = b_bar;
  return model;
}

struct Carried {
  double share;  ///< mean pressure that the ground carries in the end, over Prandtl's
  SolveCounts solves;
};

Carried carried(const Model<2>& model, int cells) {
  const double h = 1.0 / cells;
  Simulation simulation(model);
  simulation.run();
  const State state(simulation.frame());
  double ground = 0;
  for (Index p = 0; p < state.size(); ++p)
    if (state.x(p, 1) < 2 * h)
      ground -= state.get("stress", p, 1) * state.get("volume", p) / (2 * h);
  const Carried end{ground / (2 + std::numbers::pi), simulation.info().solves};
  MESSAGE(end.share << " of Prandtl's load, steps " << end.solves.steps << ", iterations "
                    << end.solves.iterations << ", in parts " << end.solves.in_parts << ", cuts "
                    << end.solves.cuts);
  return end;
}

double footing(const std::string& functions, int cells, int steps, bool b_bar) {
  MESSAGE(functions << ", " << cells << " cells, B-bar " << b_bar);
  return carried(footing_model(functions, cells, steps, b_bar), cells).share;
}

}  // namespace

TEST_CASE("quasi-static: Cook's membrane does not lock with the mean of volumetric strains") {
  constexpr double exact = cook_limit;
  const double coarse = membrane(16, true), fine = membrane(32, true), finer = membrane(64, true);
  const double locked = membrane(32, false);
  MESSAGE("16, 32, 64 cells: " << coarse << " " << fine << " " << finer << ", 32 without the mean "
                               << locked);
  CHECK(fine == test::within(0.02, exact));
  CHECK(finer == test::within(0.01, exact));
  CHECK(finer == test::within(0.01, fine));
  CHECK(fine == test::within(0.02, coarse));
  CHECK(locked < 0.75 * exact);
}

TEST_CASE("quasi-static: a thick-walled cylinder is plastic as far as Hill says") {
  for (const bool b_bar : {false, true}) {
    const Ring coarse = cylinder(16, 10, b_bar), half_step = cylinder(16, 20, b_bar),
               half_cell = cylinder(32, 10, b_bar);
    for (const Ring& ring : {coarse, half_step, half_cell}) {
      CHECK(ring.radial < 0.005);
      CHECK(ring.hoop < 0.005);
      CHECK(ring.displacement < 0.005);
    }
    CHECK(half_step.radial == test::within(0.1, coarse.radial));
    CHECK(half_cell.radial < 0.3 * coarse.radial);
  }
}

// Nodes beside the footing take part in its motion: it acts half a cell wider, by 1 / (2 cells).
TEST_CASE("quasi-static: a strip footing with four particles per cell fails at Prandtl's load") {
  const double coarse = footing("gimp", 8, 10, true), half_step = footing("gimp", 8, 20, true);
  const double fine = footing("gimp", 16, 10, true), fine_half_step = footing("gimp", 16, 20, true);
  const double elements = footing("element", 16, 10, true);
  const double locked = footing("element", 8, 10, false);
  CHECK(fine == test::within(0.03, 1));
  CHECK(elements == test::within(0.03, 1));
  CHECK(half_step == test::within(0.003, coarse));
  CHECK(fine_half_step == test::within(0.003, fine));
  CHECK(coarse / (1 + 0.5 / 8) == test::within(0.02, 1));
  CHECK(fine / (1 + 0.5 / 16) == test::within(0.02, 1));
  CHECK(locked > 1.15);
}

TEST_CASE("quasi-static: adaptive steps bring a footing to the load of fine fixed ones") {
  const double fine = footing("gimp", 4, 20, true);
  Model<2> hasty = footing_model("gimp", 4, 1, true);
  hasty.analysis.implicit.most_iterations = 8;  // too few for all of the settlement at once
  const Carried fixed = carried(hasty, 4);
  CHECK(fixed.solves.in_parts == 1);
  hasty.analysis.step = {.adaptive = true, .dt = 1, .safety = 0.5};
  hasty.analysis.nsteps = 1000;
  hasty.analysis.end_time = 1;
  const Carried adaptive = carried(hasty, 4);
  CHECK(adaptive.solves.cuts > 0);
  CHECK(adaptive.solves.in_parts == 0);
  CHECK(adaptive.solves.steps < 20);
  CHECK(adaptive.share == test::within(1e-3, fine));
}
