// Bodies of revolution: x is the radius, y the axis.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/verification/curved_quarter.h"
#include "tests/verification/vibration.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double pi = std::numbers::pi;
constexpr const char* all_functions[] = {
    "element", "gimp", "uniform_gimp", "cpdi", "cpdi2", "quadratic_spline", "cubic_spline"};
constexpr const char* schemes[] = {"usf", "usl", "musl"};

/// A body between two radii and two heights in a grid of square cells.
struct Body {
  double h = 0.25;                                 ///< [m]
  double inner = 0, outer = 1, low = 0, high = 1;  ///< [m]
  double width = 2, height = 2;                    ///< [m] of the grid
  int per_cell = 2;
  std::string law = R"("type": "LinearElastic", "youngs_modulus": 1000, "poisson_ratio": 0.3)";
  double density = 1;
  std::string constraints = "";  ///< of velocities; sets: low, high, inner, outer
  std::string analysis = R"("dt": 1e-3, "nsteps": 1)";
  std::string generator = "";  ///< more keys
  double gravity = 0;
};

Model<2> model_of(const Body& b) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {h}, "extent": [{w}, {t}]}},
             "boundary_conditions": {{"velocity_constraints": [{constraints}]}}}},
    "sets": {{"nodes": {{
      "low": {{"half_space": {{"point": [0, {low}], "normal": [0, 1]}}}},
      "high": {{"half_space": {{"point": [0, {high}], "normal": [0, -1]}}}},
      "inner": {{"half_space": {{"point": [{inner}, 0], "normal": [1, 0]}}}},
      "outer": {{"half_space": {{"point": [{outer}, 0], "normal": [-1, 0]}}}}}}}},
    "materials": [{{{law}, "density": {rho}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": {n}, "material": 0{more},
                   "region": {{"box": {{"min": [{inner}, {low}], "max": [{outer}, {high}]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, {g}]}},
    "analysis": {{"plane": "axisymmetric", {analysis}}},
    "post_processing": {{"history_steps": 10}}}})",
      fmt::arg("h", b.h), fmt::arg("w", b.width), fmt::arg("t", b.height),
      fmt::arg("constraints", b.constraints), fmt::arg("low", b.low), fmt::arg("high", b.high),
      fmt::arg("inner", b.inner), fmt::arg("outer", b.outer), fmt::arg("law", b.law),
      fmt::arg("rho", b.density), fmt::arg("n", b.per_cell), fmt::arg("more", b.generator),
      fmt::arg("g", b.gravity), fmt::arg("analysis", b.analysis)));
}

/// Particles begin with the velocity that `field` gives at their place.
template <class Field>
void move(Model<2>& model, Field field) {
  model.particles.velocity.clear();
  for (const Vec<2>& x : model.particles.x) model.particles.velocity.push_back(field(x));
}

std::string with(const std::string& functions, const std::string& scheme, double dt, Index n) {
  return fmt::format(R"("shape_functions": "{}", "mpm_scheme": "{}", "dt": {}, "nsteps": {})",
                     functions, scheme, dt, n);
}

}  // namespace

TEST_CASE("axisymmetric: the mass of a cylinder is pi R^2 H rho, that of a tube the difference") {
  for (const double inner : {0.0, 0.5}) {
    const Model<2> region = model_of({.inner = inner, .high = 1.5, .per_cell = 3, .density = 700});
    const double exact = pi * (1 - inner * inner) * 1.5 * 700;
    double sum = 0;
    for (const double V : region.particles.volume) sum += 700 * V;
    CHECK(sum == doctest::Approx(exact).epsilon(1e-13));
    Simulation simulation(Model<2>{region});
    CHECK(simulation.history().mass == doctest::Approx(exact).epsilon(1e-13));
  }
}

TEST_CASE("axisymmetric: a body that moves along the axis keeps its energy, and has no stress") {
  for (const std::string functions : all_functions)
    for (const std::string scheme : schemes) {
      CAPTURE(functions);
      CAPTURE(scheme);
      Model<2> model =
          model_of({.low = 0.25, .high = 0.75, .analysis = with(functions, scheme, 1e-3, 400)});
      move(model, [](const Vec<2>&) { return Vec<2>(0, 2); });
      Simulation simulation(std::move(model));
      const HistoryRow before = simulation.history();
      simulation.run();
      const HistoryRow after = simulation.history();
      CHECK(after.kinetic == doctest::Approx(before.kinetic).epsilon(1e-11));
      CHECK(after.momentum[1] == doctest::Approx(before.momentum[1]).epsilon(1e-11));
      const State end(simulation.frame());
      for (Index p = 0; p < end.size(); ++p)
        for (int k = 0; k < 4; ++k) CHECK(std::abs(end.get("stress", p, k)) < 1e-9);
    }
}

// v = (a x, b y): strain rates a, b and a around the axis, for every kind of functions.
TEST_CASE("axisymmetric: a body that widens evenly has the same strain around the axis") {
  constexpr double a = 1e-4, b = -3e-5, E = 1000, nu = 0.3, dt = 1e-3;
  const double G = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  for (const std::string functions : all_functions)
    for (const std::string scheme : schemes) {
      CAPTURE(functions);
      CAPTURE(scheme);
      Model<2> model =
          model_of({.width = 1, .height = 1, .analysis = with(functions, scheme, dt, 1)});
      move(model, [](const Vec<2>& x) { return Vec<2>(a * x[0], b * x[1]); });
      // The field at nodes is the exact one.
      model.analysis.transfer.flip = 1.0;
      for (Index node = 0; node < model.mesh->n_nodes(); ++node)
        for (int d = 0; d < 2; ++d)
          entries_of<NodeVelocity>(model).push_back(
              {node, d, (d == 0 ? a : b) * model.mesh->node(node)[d]});
      auto& held = entries_of<NodeVelocity>(model);
      std::stable_sort(held.begin(), held.end(), [](const auto& p, const auto& q) {
        return std::pair(p.node, p.dir) < std::pair(q.node, q.dir);
      });
      held.erase(std::unique(held.begin(), held.end(),
                             [](const auto& p, const auto& q) {
                               return p.node == q.node && p.dir == q.dir;
                             }),
                 held.end());
      Simulation simulation(std::move(model));
      const State start(simulation.frame());
      simulation.run();
      const State end(simulation.frame());
      const double volumetric = dt * (2 * a + b), mean = lambda * volumetric;
      for (Index p = 0; p < end.size(); ++p) {
        CHECK(end.get("stress", p, 0) == test::within(1e-9, mean + 2 * G * a * dt));
        CHECK(end.get("stress", p, 1) == test::within(1e-9, mean + 2 * G * b * dt));
        CHECK(end.get("stress", p, 2) == test::within(1e-9, mean + 2 * G * a * dt));
        CHECK(end.get("volume", p) / start.get("volume", p) ==
              doctest::Approx(1 + volumetric).epsilon(1e-12));
      }
    }
}

// It begins with the motion that it ends with, so that there are no waves.
TEST_CASE(
    "axisymmetric: a cylinder between smooth plates has the stress E eps, and -nu eps across") {
  constexpr double E = 1000, nu = 0.3, eps = -1e-3;
  for (const std::string functions : {"element", "gimp", "quadratic_spline"})
    for (const double h : {0.5, 0.25}) {
      CAPTURE(functions);
      CAPTURE(h);
      Model<2> model =
          model_of({.h = h,
                    .width = 2,
                    .height = 1,
                    .density = 0.01,
                    .constraints = R"({"nset": "low", "dir": 1, "velocity": 0},
                             {"nset": "high", "dir": 1, "velocity": -0.001})",
                    .analysis = with(functions, "usf", 2e-4, 5000) +
                                R"(, "damping": {"type": "Viscous", "damping_factor": 20})"});
      move(model, [&](const Vec<2>& x) { return Vec<2>(-nu * eps * x[0], eps * x[1]); });
      Simulation simulation(std::move(model));
      simulation.run();
      const State end(simulation.frame());
      const auto all = [](Index) { return true; };
      const auto stress = [&](int k) {
        return mean(end, all, [&](Index p) { return end.get("stress", p, k); });
      };
      CHECK(stress(1) == test::within(0.005, E * eps));
      CHECK(std::abs(stress(0)) < 0.005 * std::abs(E * eps));
      CHECK(std::abs(stress(2)) < 0.005 * std::abs(E * eps));
      const double wider =
          mean(end, all, [&](Index p) { return end.get("displacement", p, 0) / end.x(p, 0); });
      CHECK(wider == test::within(0.01, -nu * eps));
    }
}

// Thin, and free along the axis: it swings as a mass on the spring of its circle.
TEST_CASE("axisymmetric: a thin ring breathes with the frequency sqrt(E / rho) / R") {
  constexpr double c = 31.6227766017, R = 1.0;  // sqrt(E / rho)
  const double exact = 2 * pi * R / c;
  for (const std::string functions : {"element", "gimp", "quadratic_spline"})
    for (const std::string scheme : schemes) {
      double coarse = 0;
      for (const double courant : {0.4, 0.2}) {
        CAPTURE(functions);
        CAPTURE(scheme);
        CAPTURE(courant);
        const double h = 0.025, dt = courant * h / (c * 1.16);
        Model<2> model =
            model_of({.h = h,
                      .inner = R - 0.05,
                      .outer = R + 0.05,
                      .low = 0.1,
                      .high = 0.2,
                      .width = 1.2,
                      .height = 0.3,
                      .analysis = with(functions, scheme, dt, std::lround(0.5 * exact / dt))});
        move(model, [](const Vec<2>&) { return Vec<2>(0.01, 0); });
        const Vibration found = vibrate(std::move(model), 0);
        CHECK(found.period == test::within(0.01, exact));
        CHECK(found.imbalance < 0.01);
        if (courant == 0.2) CHECK(found.imbalance < 0.7 * coarse + 1e-6);
        coarse = found.imbalance;
        CHECK(found.kept > 0.98);
      }
    }
}

// The lowest mode of a rod that is held at its foot: T = 4 L sqrt(rho / E).
TEST_CASE("axisymmetric: a slender cylinder vibrates along its axis with sqrt(E / rho)") {
  constexpr double c = 31.6227766017, L = 5.0;
  for (const double h : {0.25, 0.125}) {
    CAPTURE(h);
    const double dt = 0.3 * h / (c * 1.16), exact = 4 * L / c;
    Model<2> model =
        model_of({.h = h,
                  .outer = 0.5,
                  .high = L,
                  .width = 0.75,
                  .height = L + 0.5,
                  .constraints = R"({"nset": "low", "dir": 1, "velocity": 0})",
                  .analysis = with("quadratic_spline", "musl", dt, std::lround(0.3 * exact / dt))});
    move(model, [](const Vec<2>& x) { return Vec<2>(0, 0.01 * std::sin(0.5 * pi * x[1] / L)); });
    const Vibration found = vibrate(std::move(model), 1);
    CHECK(found.period == test::within(0.01, exact));
    CHECK(found.imbalance < 0.015);
  }
}

namespace {

/// Lame: a tube of radii 1 and 2 under internal pressure p, held along its axis.
struct LameError {
  double radial, hoop;  ///< largest errors of means over cells, over p
};

Model<2> tube(double h, const std::string& analysis, double nu, double p) {
  Model<2> model =
      model_of({.h = h,
                .inner = 1,
                .outer = 2,
                .high = 2 * h,
                .width = 2 + 2 * h,
                .height = 2 * h,
                .law = fmt::format(
                    R"("type": "LinearElastic", "youngs_modulus": 1e6, "poisson_ratio": {})", nu),
                .density = 1000,
                .constraints = R"({"nset": -1, "dir": 1, "velocity": 0})",
                .analysis = analysis});
  for (Index node = 0; node < model.mesh->n_nodes(); ++node) {
    const Vec<2> x = model.mesh->node(node);
    if (std::abs(x[0] - 1) > 1e-9) continue;
    const bool end = x[1] < 1e-9 || x[1] > 2 * h - 1e-9;
    entries_of<NodeForce>(model).push_back(
        {.node = node, .dir = 0, .force = p * 2 * pi * 1.0 * h * (end ? 0.5 : 1.0)});
  }
  return model;
}

LameError lame_error(const State& state, double h, double p) {
  const auto cells = static_cast<std::size_t>(std::lround(1 / h));
  std::vector<double> r(cells), t(cells), exact_r(cells), exact_t(cells);
  for (Index i = 0; i < state.size(); ++i) {
    const double x = state.x(i, 0);
    const auto c = static_cast<std::size_t>((x - 1) / h);
    const double V = state.get("volume", i);
    r[c] += V * state.get("stress", i, 0);
    t[c] += V * state.get("stress", i, 2);
    exact_r[c] += V * p / 3 * (1 - 4 / (x * x));
    exact_t[c] += V * p / 3 * (1 + 4 / (x * x));
  }
  LameError worst{0, 0};
  for (std::size_t c = 0; c < cells; ++c) {
    const double volume = 2 * pi * (1 + (static_cast<double>(c) + 0.5) * h) * h * 2 * h;
    worst.radial = std::max(worst.radial, std::abs(r[c] - exact_r[c]) / volume / p);
    worst.hoop = std::max(worst.hoop, std::abs(t[c] - exact_t[c]) / volume / p);
  }
  return worst;
}

}  // namespace

TEST_CASE("axisymmetric: a thick-walled tube under internal pressure has Lame's stresses") {
  const std::string implicit =
      R"("mpm_scheme": "newmark", "dt": 1, "nsteps": 1, "shape_functions": "element",
         "scheme_settings": {"quasi_static": true, "relative_residual_tolerance": 1e-10})";
  double before = 1;
  for (const double h : {1.0 / 8, 1.0 / 16}) {
    Simulation simulation(tube(h, implicit, 0.3, 10));
    simulation.run();
    const LameError error = lame_error(State(simulation.frame()), h, 10);
    CAPTURE(h);
    CHECK(error.hoop < (h > 0.1 ? 0.02 : 0.01));
    CHECK(error.radial < (h > 0.1 ? 0.02 : 0.01));
    CHECK(error.hoop < before);
    before = error.hoop;
  }
  for (const std::string scheme : schemes) {
    const double h = 1.0 / 16;
    for (const double dt : {6e-4, 3e-4}) {
      CAPTURE(scheme);
      Simulation simulation(tube(h,
                                 with("element", scheme, dt, std::lround(3 / dt)) +
                                     R"(, "damping": {"type": "Viscous", "damping_factor": 10})",
                                 0.3, 10));
      simulation.run();
      const LameError error = lame_error(State(simulation.frame()), h, 10);
      CHECK(error.hoop < 0.01);
      CHECK(error.radial < 0.01);
    }
  }
}

// u_r(a) = p a / E' (...) in plane strain: (1 + nu) p / (3 E) ((1 - 2 nu) r + 4 / r) for radii
// 1, 2.
TEST_CASE("axisymmetric: a tube of rubber widens as Lame's does if volumetric strains are means") {
  constexpr double nu = 0.499, p = 10, E = 1e6, h = 1.0 / 8;
  const std::string motion = with("element", "musl", 2e-5, 60000) +
                             R"(, "damping": {"type": "Viscous", "damping_factor": 40})",
                    solve =
                        R"("mpm_scheme": "newmark", "dt": 1, "nsteps": 1,
      "shape_functions": "element",
      "scheme_settings": {"quasi_static": true, "relative_residual_tolerance": 1e-10})";
  const auto ratio = [&](const std::string& steps, bool b_bar) {
    Simulation simulation(tube(h, steps + fmt::format(R"(, "b_bar": {})", b_bar), nu, p));
    simulation.run();
    const State end(simulation.frame());
    return mean(
        end, [](Index) { return true; },
        [&](Index i) {
          const double r = end.x(i, 0);
          return end.get("displacement", i, 0) /
                 ((1 + nu) * p / (3 * E) * ((1 - 2 * nu) * r + 4 / r));
        });
  };
  for (const std::string& steps : {motion, solve}) {
    CHECK(ratio(steps, true) == test::within(0.01, 1));
    CHECK(ratio(steps, false) < 0.9);
  }
}

TEST_CASE("axisymmetric: water at rest has the pressure of its depth") {
  for (const std::string functions : {"gimp", "quadratic_spline"})
    for (const double h : {0.125, 0.0625}) {
      CAPTURE(functions);
      CAPTURE(h);
      const double c = 20;  // m/s
      Model<2> model = model_of(
          {.h = h,
           .width = 1,
           .height = 1.5,
           .law = R"("type": "Newtonian", "bulk_modulus": 4e5, "dynamic_viscosity": 0)",
           .density = 1000,
           .constraints = R"({"nset": "low", "dir": 1, "velocity": 0},
                             {"nset": "outer", "dir": 0, "velocity": 0})",
           .analysis = with(functions, "musl", 0.2 * h / c, std::lround(3 / (0.2 * h / c))) +
                       R"(, "damping": {"type": "Viscous", "damping_factor": 10})",
           .gravity = -10});
      Simulation simulation(std::move(model));
      simulation.run();
      const State end(simulation.frame());
      // Well below the surface, which is known to a cell.
      for (int row = 0; (row + 0.5) * h < 0.7; ++row) {
        const double y = (row + 0.5) * h;
        const auto in_row = [&](Index p) { return std::abs(end.x(p, 1) - y) < 0.5 * h; };
        const double depth = mean(end, in_row, [&](Index p) { return 1 - end.x(p, 1); });
        CHECK(mean(end, in_row, [&](Index p) { return end.get("pressure", p); }) ==
              test::within(0.06, 1000 * 10 * depth));
      }
    }
}

// Functions end at the axis: what they miss there must not pull the innermost rings down.
TEST_CASE("axisymmetric: water that begins with the pressure of its depth stays where it is") {
  for (const std::string functions : {"gimp", "quadratic_spline"})
    for (const int per_cell : {2, 3}) {
      Simulation simulation(model_of_text<2>(fmt::format(
          R"({{
        "mesh": {{"structured": {{"cell_size": 0.1, "extent": [1, 1.2]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset": "low", "dir": "y", "velocity": 0}},
            {{"nset": "outer", "dir": "x", "velocity": 0}}]}},
          "particles_stresses": {{"type": "k0", "k0": 1}}}},
        "sets": {{"nodes": {{
          "low": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
          "outer": {{"half_space": {{"point": [1, 0], "normal": [-1, 0]}}}}}}}},
        "particles": [{{"generator": {{"type": "region", "per_cell": {}, "material": "water",
          "region": {{"box": {{"min": [0, 0], "max": [1, 1]}}}}}}}}],
        "materials": [{{"name": "water", "type": "Newtonian", "density": 1000,
                        "bulk_modulus": 2e6, "dynamic_viscosity": 1e-3}}],
        "external_loading_conditions": {{"gravity": [0, -9.81]}},
        "analysis": {{"plane": "axisymmetric", "shape_functions": "{}", "end_time": 3}}}})",
          per_cell, functions)));
      simulation.run();
      const State end(simulation.frame());
      double most = 0;
      for (Index p = 0; p < end.size(); ++p)
        for (const int d : {0, 1}) most = std::max(most, std::abs(end.get("displacement", p, d)));
      CAPTURE(functions);
      CAPTURE(per_cell);
      CHECK(most < 1e-9);
    }
}

// sigma_r = p a^3 / (b^3 - a^3) (1 - b^3 / r^3), sigma_t = p a^3 / (b^3 - a^3) (1 + b^3 / (2 r^3)).
TEST_CASE("axisymmetric: a hollow ball under internal pressure has Lame's stresses") {
  constexpr double p = 10;
  const CurvedQuarter shell;  // half a hollow ball
  Model<2> model;
  model.analysis.plane = Plane::axisymmetric;
  model.mesh = shell.mesh();
  model.materials = {{.id = 0,
                      .name = "steel",
                      .density = 1000,
                      .law = LinearElastic{.youngs_modulus = 1e6, .poisson_ratio = 0.3}}};
  fill_with_gauss_points(model);
  for (Index j = 0; j < shell.n_theta; ++j) {
    const Vec<2> a = model.mesh->node(shell.node(0, j)), b = model.mesh->node(shell.node(0, j + 1)),
                 edge = b - a;
    // With the functions of both nodes, over the ring of the edge.
    for (int end = 0; end < 2; ++end) {
      const double r = end == 0 ? (2 * a[0] + b[0]) / 6 : (a[0] + 2 * b[0]) / 6;
      const Vec<2> force = 2 * pi * r * p * Vec<2>(edge[1], -edge[0]);
      for (int d = 0; d < 2; ++d)
        entries_of<NodeForce>(model).push_back(
            {.node = shell.node(0, j + end), .dir = d, .force = force[d]});
    }
  }
  shell.hold_sides(model);
  model.analysis.scheme = Scheme::newmark;
  model.analysis.implicit.quasi_static = true;
  model.analysis.step.dt = 1;
  model.analysis.nsteps = 1;
  Simulation simulation(std::move(model));
  simulation.run();
  const State state(simulation.frame());
  double worst_r = 0, worst_t = 0;
  for (Index first = 0; first < state.size(); first += 4) {
    double r = 0, t = 0, hoop = 0, exact_r = 0, exact_t = 0;
    for (Index i = first; i < first + 4; ++i) {
      const double x = state.x(i, 0), y = state.x(i, 1), r2 = x * x + y * y,
                   cube = 8 / std::pow(r2, 1.5);
      const double xx = state.get("stress", i, 0), yy = state.get("stress", i, 1),
                   xy = state.get("stress", i, 3);
      const double radial = (x * x * xx + y * y * yy + 2 * x * y * xy) / r2;
      r += 0.25 * radial;
      t += 0.25 * (xx + yy - radial);
      hoop += 0.25 * state.get("stress", i, 2);
      exact_r += 0.25 * p / 7 * (1 - cube);
      exact_t += 0.25 * p / 7 * (1 + cube / 2);
    }
    worst_r = std::max(worst_r, std::abs(r - exact_r) / p);
    worst_t = std::max({worst_t, std::abs(t - exact_t) / p, std::abs(hoop - exact_t) / p});
  }
  CHECK(worst_r < 0.01);
  CHECK(worst_t < 0.01);
}

// One and two particles per cell direction: the face is far from the centre of the outer ones.
TEST_CASE(
    "axisymmetric: a cylinder under an even pressure has this stress, whatever its particles") {
  constexpr double pressure = 1e5;
  for (const int per_cell : {1, 2, 3})
    for (const double cell : {0.5, 0.25}) {
      CAPTURE(per_cell);
      CAPTURE(cell);
      Simulation simulation(
          model_of_text<2>(fmt::format(R"({{
        "mesh": {{"structured": {{"cell_size": {0}, "extent": [1.5, 2]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset": "ends", "dir": "y", "velocity": 0}}]}}}},
        "sets": {{"nodes": {{"ends": {{"union": [
            {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
            {{"half_space": {{"point": [0, 2], "normal": [0, -1]}}}}]}}}},
          "particles": {{"side": {{"half_space": {{"point": [{1}, 0], "normal": [-1, 0]}}}}}}}},
        "materials": [{{"name": "m", "type": "LinearElastic", "density": 1800,
                       "youngs_modulus": 2e7, "poisson_ratio": 0}}],
        "particles": [{{"generator": {{"type": "region", "material": "m", "per_cell": {2},
          "region": {{"box": {{"min": [0, 0], "max": [1, 2]}}}}}}}}],
        "external_loading_conditions": {{"particle_surface_traction": [
          {{"pset": "side", "dir": "x", "traction": -{3}}}]}},
        "analysis": {{"preset": "lahar", "mpm_scheme": "newmark", "plane": "axisymmetric",
          "shape_functions": "element", "scheme_settings": {{"quasi_static": true}},
          "dt": 1, "nsteps": 1}}}})",
                                       cell, 1 - 0.75 * cell / per_cell, per_cell, pressure)));
      simulation.run();
      const State state(simulation.frame());
      double radial = 0;
      for (Index p = 0; p < state.size(); ++p) radial += state.get("stress", p, 0);
      radial /= static_cast<double>(state.size());
      MESSAGE(fmt::format("{} per cell of {} m: {:.5f} of the pressure", per_cell, cell,
                          -radial / pressure));
      CHECK(radial == test::within(0.01, -pressure));
    }
}
