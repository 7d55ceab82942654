// Sheets: no stress across their plane, and a thickness that changes.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "tests/verification/vibration.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double E = 1e6, nu = 0.3;
const std::string elastic =
    R"("type": "LinearElastic", "youngs_modulus": 1e6, "poisson_ratio": 0.3)";

/// A sheet of 1 x 1 m in cells of `h`, which is held along x at x = 0 and along y at y = 0, and
/// whose edge at x = 1 m moves by `by` in each quasi-static step; with `both` that at y = 1 m, too.
struct Sheet {
  std::string law = elastic;
  double h = 0.25, by = 1e-6;
  int steps = 1;
  bool both = false;
  std::string functions = "element";
};

State pulled(const Sheet& sheet) {
  const std::string other =
      sheet.both ? fmt::format(R"(, {{"nset": "top", "dir": "y", "displacement": {}}})", sheet.by)
                 : "";
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {h}, "extent": [1.5, 1.5]}},
             "boundary_conditions": {{
               "velocity_constraints": [{{"nset": "left", "dir": "x", "velocity": 0}},
                                        {{"nset": "low", "dir": "y", "velocity": 0}}],
               "displacement_constraints": [
                 {{"nset": "right", "dir": "x", "displacement": {by}}}{other}]}}}},
    "sets": {{"nodes": {{"left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                       "low": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                       "right": {{"half_space": {{"point": [1, 0], "normal": [-1, 0]}}}},
                       "top": {{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}}}}}},
    "materials": [{{{law}, "density": 1000}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"max": [1, 1]}}}}}}}}],
    "analysis": {{"plane": "stress", "mpm_scheme": "newmark", "shape_functions": "{f}", "dt": 1,
                 "nsteps": {n}, "scheme_settings": {{"quasi_static": true,
                   "relative_residual_tolerance": 1e-9}}}}}})",
      fmt::arg("h", sheet.h), fmt::arg("by", sheet.by), fmt::arg("other", other),
      fmt::arg("law", sheet.law), fmt::arg("f", sheet.functions), fmt::arg("n", sheet.steps)));
  Simulation simulation(std::move(model), {.threads = 1});
  simulation.run();
  return State(simulation.frame());
}

double mean_stress(const State& state, int k) {
  return mean(
      state, [](Index) { return true; }, [&](Index p) { return state.get("stress", p, k); });
}

double largest(const State& state, int k) {
  double most = 0;
  for (Index p = 0; p < state.size(); ++p)
    most = std::max(most, std::abs(state.get("stress", p, k)));
  return most;
}

}  // namespace

TEST_CASE("plane stress: a sheet that is pulled has the stress E eps, and becomes thinner") {
  for (const std::string functions : {"element", "gimp"})
    for (const double h : {0.25, 0.125}) {
      const double eps = 1e-6;
      const State state = pulled({.h = h, .by = eps, .functions = functions});
      for (Index p = 0; p < state.size(); ++p) {
        CHECK(state.get("stress", p, 0) == test::within(1e-5, E * eps));
        for (int k = 1; k < 4; ++k) CHECK(std::abs(state.get("stress", p, k)) < 1e-5 * E * eps);
        CHECK(state.get("volume", p) / (h * h / 4) - 1 == test::within(1e-4, (1 - 2 * nu) * eps));
      }
    }
}

TEST_CASE("plane stress: a sheet that is pulled both ways has the stress E eps / (1 - nu)") {
  const State state = pulled({.by = 1e-6, .both = true});
  CHECK(mean_stress(state, 0) == test::within(1e-5, E * 1e-6 / (1 - nu)));
  CHECK(mean_stress(state, 1) == test::within(1e-5, E * 1e-6 / (1 - nu)));
}

// Neo-Hookean: sigma = mu (a^2 - b^2) / J along the stretch a, with b across, where lambda ln J +
// mu (b^2 - 1) = 0 and J = a b^2.
TEST_CASE("plane stress: rubber that is pulled by a tenth has the stress of a bar") {
  const double mu = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu)), a = 1.1;
  double b = 1;
  for (int k = 0; k < 50; ++k)
    b -= (lambda * std::log(a * b * b) + mu * (b * b - 1)) / (2 * lambda / b + 2 * mu * b);
  for (const double h : {0.5, 0.25}) {
    const State state =
        pulled({.law = R"("type": "NeoHookean", "youngs_modulus": 1e6, "poisson_ratio": 0.3)",
                .h = h,
                .by = a - 1});
    CHECK(mean_stress(state, 0) == test::within(1e-6, mu * (a * a - b * b) / (a * b * b)));
    CHECK(largest(state, 2) < 1e-6 * E);
    for (Index p = 0; p < state.size(); ++p)
      CHECK(state.get("volume", p) / (h * h / 4) == test::within(1e-6, a * b * b));
  }
}

TEST_CASE("plane stress: laws yield at their strength under stress along one axis") {
  const std::string stiff = R"("youngs_modulus": 1e6, "poisson_ratio": 0.3)";
  // Von Mises, pulled one way and both: the yield stress.
  for (const bool both : {false, true})
    for (const int steps : {4, 8}) {
      CAPTURE(both);
      const State metal =
          pulled({.law = fmt::format(R"("type": "VonMises", {}, "yield_stress": 1000)", stiff),
                  .by = 4e-3 / steps,
                  .steps = steps,
                  .both = both});
      CHECK(mean_stress(metal, 0) == test::within(1e-4, 1000));
      CHECK(std::abs(mean_stress(metal, 1) - (both ? 1000 : 0)) < 0.1);
      CHECK(largest(metal, 2) < 1e-3);
    }
  // Mohr-Coulomb, compressed: 2 c cos(phi) / (1 - sin(phi)).
  const double phi = 30 * pi / 180, strength = 2 * 500 * std::cos(phi) / (1 - std::sin(phi));
  for (const int steps : {4, 8}) {
    const State soil =
        pulled({.law = fmt::format(R"("type": "MohrCoulomb", {}, "friction": 30, "dilation": 0,
                               "cohesion": 500, "tension_cutoff": 100, "softening": false)",
                                   stiff),
                .by = -4e-3 / steps,
                .steps = steps});
    CHECK(mean_stress(soil, 0) == test::within(1e-3, -strength));
    CHECK(std::abs(mean_stress(soil, 1)) < 1e-3 * strength);
    CHECK(largest(soil, 2) < 1e-6 * strength);
  }
}

namespace {

/// A strip of two rows of cells that is held at x = 0, set into its lowest mode: its period is a
/// share of the exact one.
Vibration strip(double h, const std::string& scheme, double courant, bool held_sides) {
  constexpr double L = 5, c = 31.6227766017;  // sqrt(E / rho)
  const double width = 2 * h, dt = courant * h / (1.16 * c), exact = 4 * L / c;
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"origin": [0, {low}], "cell_size": {h}, "extent": [6, {t}]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "left", "dir": "x", "velocity": 0}}{sides}]}}}},
    "sets": {{"nodes": {{"left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}}}}}},
    "materials": [{{{law}, "density": 1000}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                   "region": {{"box": {{"min": [0, 0], "max": [{L}, {w}]}}}}}}}}],
    "analysis": {{"plane": "stress", "mpm_scheme": "{scheme}", "shape_functions":
                 "quadratic_spline", "dt": {dt}, "nsteps": {n}}},
    "post_processing": {{"history_steps": 10}}}})",
      fmt::arg("low", -2 * h), fmt::arg("h", h), fmt::arg("t", width + 4 * h),
      fmt::arg("sides", held_sides ? R"(, {"nset": -1, "dir": "y", "velocity": 0})" : ""),
      fmt::arg("law", elastic), fmt::arg("L", L), fmt::arg("w", width), fmt::arg("scheme", scheme),
      fmt::arg("dt", dt), fmt::arg("n", std::lround(0.3 * exact / dt))));
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.push_back({0.01 * std::sin(0.5 * pi * x[0] / L), 0});
  Vibration found = vibrate(std::move(model), 0);
  found.period /= exact;
  return found;
}

}  // namespace

TEST_CASE(
    "plane stress: waves in strips have sqrt(E / rho), in sheets sqrt(E / (1 - nu^2) / rho)") {
  for (const std::string scheme : {"usf", "usl", "musl"})
    for (const double h : {0.25, 0.125}) {
      CAPTURE(scheme);
      CAPTURE(h);
      for (const bool held : {false, true}) {
        const Vibration coarse = strip(h, scheme, 0.4, held),
                        half_step = strip(h, scheme, 0.2, held);
        for (const Vibration& found : {coarse, half_step})
          CHECK(found.period == test::within(0.012, held ? std::sqrt(1 - nu * nu) : 1));
        CHECK(coarse.imbalance < 0.02);
        CHECK(half_step.imbalance < 0.7 * coarse.imbalance);
      }
    }
}

// Plane strain with E (1 + 2 nu) / (1 + nu)^2 and nu / (1 + nu) has the same stresses in the plane
// as plane stress with E and nu: here around a notch, in motion.
TEST_CASE("plane stress: small strains are those of plane strain with other elastic constants") {
  for (const std::string scheme : {"usf", "usl", "musl"})
    for (const std::string functions : {"element", "gimp", "cpdi", "quadratic_spline"}) {
      CAPTURE(scheme);
      CAPTURE(functions);
      const auto run = [&](const std::string& plane, double modulus, double ratio) {
        Model<2> model = model_of_text<2>(fmt::format(
            R"({{
          "mesh": {{"structured": {{"origin": [-1, -1], "cell_size": 0.25, "extent": [4, 4]}}}},
          "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": {},
                         "poisson_ratio": {}}}],
          "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0, "region":
            {{"difference": [{{"box": {{"min": [0, 0], "max": [2, 2]}}}},
                            {{"box": {{"min": [0.5, 0.5], "max": [2, 1]}}}}]}}}}}}],
          "analysis": {{"plane": "{}", "mpm_scheme": "{}", "shape_functions": "{}", "dt": 1e-3,
                       "nsteps": 100}}}})",
            modulus, ratio, plane, scheme, functions));
        for (const Vec<2>& x : model.particles.x)
          model.particles.velocity.push_back({1e-5 * x[1] * x[0], -2e-5 * x[1]});
        Simulation simulation(std::move(model));
        simulation.run();
        return State(simulation.frame());
      };
      const double one = 1 + nu;
      const State sheet = run("stress", E, nu),
                  plane = run("strain", E * (1 + 2 * nu) / (one * one), nu / one);
      double most = 0, difference = 0;
      for (Index p = 0; p < sheet.size(); ++p)
        for (const int k : {0, 1, 3}) {
          most = std::max(most, std::abs(sheet.get("stress", p, k)));
          difference =
              std::max(difference, std::abs(sheet.get("stress", p, k) - plane.get("stress", p, k)));
        }
      CHECK(most > 0.1);
      CHECK(difference < 1e-4 * most);
      CHECK(largest(sheet, 2) < 1e-9 * most);
    }
}
