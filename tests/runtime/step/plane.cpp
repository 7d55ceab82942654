// Sheets and bodies of revolution: the same bits however the tasks are executed.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "physics/particles/derived_fields.h"
#include "tests/runtime/step/plane_models.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// Steps in which particles cross cells and patches; with USL shorter ones, in which it is stable.
Model<2> in_steps(Model<2> model, Scheme scheme) {
  model.analysis.scheme = scheme;
  model.analysis.nsteps = 60;
  if (scheme == Scheme::usl) model.analysis.step.dt = 1e-3;
  model.output.frame_steps = model.output.history_steps = 10;
  model.watchdog.action = Watchdog::Action::none;
  return model;
}

void check(const Model<2>& model) {
  check_ways(model);
  check_restart(model, 11, 27, {flow(2), serial()});
}

Model<2> yielding(Model<2> model) {
  for (Material& material : model.materials)
    material.law = VonMises{.youngs_modulus = 2000, .poisson_ratio = 0.3, .yield_stress = 100};
  return model;
}

/// Largest and least stress of the components in the plane, largest amount across it.
struct SheetStresses {
  double most[2] = {-HUGE_VAL, -HUGE_VAL}, least[2] = {HUGE_VAL, HUGE_VAL}, across = 0;
  std::vector<double> all;
};

/// A sheet of Mohr-Coulomb whose right and upper sides move, in explicit steps. Its strength in
/// compression along one axis is 17.3 kPa.
SheetStresses moved_sides(double tension_cutoff, double along_x, double along_y) {
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.25, "extent": [1, 1]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "left", "dir": "x", "velocity": 0}},
               {{"nset": "right", "dir": "x", "velocity": {}}},
               {{"nset": "low", "dir": "y", "velocity": 0}},
               {{"nset": "top", "dir": "y", "velocity": {}}}]}}}},
    "sets": {{"nodes": {{"left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                       "low": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                       "right": {{"half_space": {{"point": [1, 0], "normal": [-1, 0]}}}},
                       "top": {{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}}}}}},
    "materials": [{{"type": "MohrCoulomb", "density": 2000, "youngs_modulus": 2e7,
                   "poisson_ratio": 0.3, "friction": 30, "dilation": 10, "cohesion": 5000,
                   "tension_cutoff": {}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0}}}}],
    "analysis": {{"plane": "stress", "mpm_scheme": "musl", "dt": 4e-4, "nsteps": 600}}}})",
      along_x, along_y, tension_cutoff));
  Simulation simulation(std::move(model), {.threads = 1});
  simulation.run();
  const Frame frame = simulation.frame();
  SheetStresses found;
  found.all = frame.find("stress")->values;
  for (std::size_t p = 0; p < frame.id.size(); ++p) {
    for (std::size_t k = 0; k < 2; ++k) {
      found.most[k] = std::max(found.most[k], found.all[6 * p + k]);
      found.least[k] = std::min(found.least[k], found.all[6 * p + k]);
    }
    found.across = std::max(found.across, std::abs(found.all[6 * p + 2]));
  }
  return found;
}

/// A square metre in one quasi-static step that moves its right side by -1 cm; its lower and upper
/// sides, and the left one, stay where they are.
Frame pressed(const std::string& plane) {
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.25, "extent": [1, 1]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "left", "dir": "x", "velocity": 0}},
               {{"nset": "right", "dir": "x", "velocity": -0.01}},
               {{"nset": "low", "dir": "y", "velocity": 0}},
               {{"nset": "top", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                       "low": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                       "right": {{"half_space": {{"point": [1, 0], "normal": [-1, 0]}}}},
                       "top": {{"half_space": {{"point": [0, 1], "normal": [0, -1]}}}}}}}},
    "materials": [{{"type": "LinearElastic", "density": 2000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0}}}}],
    "analysis": {{"plane": "{}", "mpm_scheme": "newmark", "shape_functions": "element",
                 "dt": 1, "nsteps": 1, "scheme_settings": {{"quasi_static": true}}}}}})",
      plane));
  for (const DerivedField& field : derived_fields) model.output.derived_fields.push_back(&field);
  Simulation simulation(std::move(model), {.threads = 1});
  simulation.run();
  return simulation.frame();
}

}  // namespace

TEST_CASE("strains across the plane are in frames, and in what follows from strains") {
  const double nu = 0.3, e = std::log(0.99);
  const double sheet = -nu / (1 - nu) * e;  // no stress acts across the sheet
  const auto check = [&](const std::string& plane, double across) {
    CAPTURE(plane);
    const Frame frame = pressed(plane);
    const auto get = [&](const char* name, std::size_t p, std::size_t k) {
      const FrameColumn& column = *frame.find(name);
      return column.values[p * static_cast<std::size_t>(column.components) + k];
    };
    const auto near = [](double a, double b) { return std::abs(a - b) < 1e-4; };  // 1 % of strains
    const double trace = e + across, dev[] = {e - trace / 3, -trace / 3, across - trace / 3};
    const double square = dev[0] * dev[0] + dev[1] * dev[1] + dev[2] * dev[2];
    const double bulk = 1e6 / (3 * (1 - 2 * nu));
    for (std::size_t p = 0; p < frame.id.size(); ++p) {
      CHECK(near(get("strain", p, 0), e));
      CHECK(near(get("strain", p, 1), 0));
      CHECK(near(get("strain", p, 2), across));
      CHECK(near(get("volumetric_strain", p, 0), trace));
      for (std::size_t k = 0; k < 3; ++k) CHECK(near(get("deviatoric_strain", p, k), dev[k]));
      CHECK(near(get("equivalent_strain", p, 0), std::sqrt(2.0 / 3.0 * square)));
      CHECK(near(get("mean_stress", p, 0) / bulk, -trace));
    }
  };
  check("strain", 0);
  check("axisymmetric", e);
  check("stress", sheet);
}

TEST_CASE("strains across the plane that particles have at the start are kept") {
  for (const Plane plane : {Plane::stress, Plane::axisymmetric}) {
    Model<2> model = in_steps(with_plane(two_discs(), plane), Scheme::usf);
    model.particles.strain.assign(model.particles.x.size(), Voigt{1e-3, 2e-3, 3e-3, 4e-3, 0, 0});
    Simulation simulation(std::move(model), {.threads = 1});
    const Frame frame = simulation.frame();
    for (std::size_t p = 0; p < frame.id.size(); ++p)
      for (std::size_t k = 0; k < 4; ++k)
        CHECK(frame.find("strain")->values[6 * p + k] == 1e-3 * static_cast<double>(k + 1));
  }
}

TEST_CASE("sheets of Mohr-Coulomb whose limit of tension is zero yield as with a little of it") {
  const double strength = 2 * 5000 * std::sqrt(3.0);
  const double moves[][2] = {{0, -0.01}, {-0.01, -0.01}, {0.01, -0.01}, {0.01, 0.01}};
  for (const auto& [x, y] : moves) {
    CAPTURE(x);
    CAPTURE(y);
    const SheetStresses none = moved_sides(0, x, y), little = moved_sides(1e-3, x, y),
                        some = moved_sides(1, x, y);
    CHECK(none.all == little.all);
    for (const SheetStresses* one : {&none, &some}) {
      CHECK(one->across < 1e-9 * strength);
      for (const double least : one->least) CHECK(least > -(1 + 1e-9) * strength);
    }
    for (const double most : none.most) CHECK(most < 0.01);
    if (y < 0) CHECK(std::abs(none.least[1] / -strength - 1) < 1e-3);
    double apart = 0;
    for (std::size_t i = 0; i < none.all.size(); ++i)
      apart = std::max(apart, std::abs(none.all[i] - some.all[i]));
    CHECK(apart < 5e-3 * strength);
  }
}

TEST_CASE("axisymmetric models give the serial loop's bits, and go on from any state") {
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    const auto ring = [&](Model<2> model) {
      return in_steps(with_plane(std::move(model), Plane::axisymmetric), scheme);
    };
    check(ring(two_discs()));
    check(ring(yielding(two_discs())));
    check(ring(distorted(two_discs(), 0.012)));
    for (const ShapeFunctions functions :
         {ShapeFunctions::gimp, ShapeFunctions::cpdi, ShapeFunctions::quadratic_spline})
      check(ring(with_functions(two_discs(), functions)));
    check(ring(dam_break()));
    Model<2> means = ring(two_discs());
    means.analysis.mean_volume = true;
    check(means);
    Model<2> affine = ring(two_discs());
    affine.analysis.affine = Affine::apic;
    affine.analysis.transfer.flip = 0.0;
    check(affine);
    Model<2> adaptive = ring(two_discs());
    adaptive.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
    check(adaptive);
  }
}

TEST_CASE("sheets give the serial loop's bits, and go on from any state") {
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    const auto sheet = [&](Model<2> model) {
      return in_steps(with_plane(std::move(model), Plane::stress), scheme);
    };
    check(sheet(two_discs()));
    check(sheet(yielding(two_discs())));
    Model<2> soil = two_discs();
    for (Material& material : soil.materials)
      material.law = MohrCoulomb{.youngs_modulus = 2000,
                                 .poisson_ratio = 0.3,
                                 .friction = 30,
                                 .dilation = 10,
                                 .cohesion = 20,
                                 .tension_cutoff = 0};
    check(sheet(std::move(soil)));
    check(sheet(distorted(two_discs(), 0.012)));
    for (const ShapeFunctions functions : {ShapeFunctions::gimp, ShapeFunctions::quadratic_spline})
      check(sheet(with_functions(yielding(two_discs()), functions)));
  }
}
