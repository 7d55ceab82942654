// Bodies on rigid ones that cut the mesh at any angle: they slide, stick and roll as theory says;
// what they take from each other is kept.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "tests/verification/rigid_incline.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// An elastic disc of 0.25 m on a plane that falls by `degrees`: its mean acceleration along the
/// plane over sin t g. It swings on the plane, on which gravity puts it at once.
struct Disc {
  double degrees, friction, h, end;
  bool by_default = false;  ///< else FLIP with functions of elements
  double share_of_fall() const;
};

double Disc::share_of_fall() const {
  const Incline at{.angle = degrees * pi / 180, .friction = friction};
  const double radius = 0.25;
  const std::string text = fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {}, "extent": [2, 2.2]}}}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e7,
                   "poisson_ratio": 0.3}}],
    "rigid_bodies": [{{"region": {{"half_space": {{"point": {}, "normal": [{}, {}]}}}},
                      "friction": {}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
      "region": {{"sphere": {{"centre": {}, "radius": {}}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, {}]}},
    "analysis": {{"mpm_scheme": "musl", "end_time": {}}},
    "post_processing": {{"history_steps": 10}}}})",
      h, at.place(0, 0), at.sine(), at.cosine(), friction, at.place(0, radius), radius, -g, end);
  Observer observer;
  double vt = 0, tt = 0;  // of the line through all velocities
  observer.history = [&](const HistoryRow& row) {
    const double along = row.momentum[0] * at.cosine() - row.momentum[1] * at.sine();
    vt += along / row.mass * row.time;
    tt += row.time * row.time;
  };
  Simulation simulation(by_default ? model_by_default<2>(text) : model_of_text<2>(text),
                        {.threads = 2}, observer);
  simulation.run();
  return vt / tt / (g * at.sine());
}

}  // namespace

TEST_CASE("rigid bodies: a disc that does not slide rolls with two thirds of the acceleration") {
  CHECK(Disc{30, 0, 0.025, 0.4}.share_of_fall() == doctest::Approx(1).epsilon(1e-9));
  for (const double h : {0.025, 0.0125})
    CHECK(Disc{30, 0.6, h, 0.4}.share_of_fall() == test::within(0.035, 2.0 / 3));
}

// Friction acts at centres of particles, inside of the disc by half of one: its lever arm is as
// much too short, and so is the radius by which the disc rolls.
TEST_CASE("rigid bodies: by default it rolls too slowly by an error that falls with the cell") {
  for (const auto& [degrees, end, most] : {std::tuple(10, 0.6, 0.05), {30, 0.5, 0.035}}) {
    const auto error = [&](double h) {
      const Disc disc{static_cast<double>(degrees), 0.6, h, end, true};
      return 1 - 1.5 * disc.share_of_fall();
    };
    const double coarse = error(0.025), fine = error(0.0125);
    MESSAGE(fmt::format("{} degrees: {:.2f} % too slow, {:.2f} % with half the cell", degrees,
                        100 * coarse, 100 * fine));
    CHECK(coarse > 0);
    CHECK(coarse < most);
    CHECK(fine < 0.65 * coarse);
  }
}

TEST_CASE("rigid bodies: what a free body loses of momentum and of its moment, material gets") {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.05, "extent": [2, 1.5]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3}],
    "rigid_bodies": [{"region": {"sphere": {"centre": [0.4, 0.72], "radius": 0.15}},
                      "density": 2000, "velocity": [2, 0.3], "friction": 0.3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0.6, 0.5], "max": [1.2, 1]}}}}],
    "analysis": {"mpm_scheme": "musl", "end_time": 0.2, "velocity_update": "flip"},
    "post_processing": {"history_steps": 10}})");
  const double mass = model.rigid_bodies[0].mass;
  CHECK(mass == test::within(1e-4, 2000 * pi * 0.15 * 0.15));
  CHECK(model.rigid_bodies[0].inertia(2, 2) == test::within(1e-4, 0.5 * mass * 0.15 * 0.15));
  Observer observer;
  double slowest = 2;
  int touching = 0;
  observer.history = [&](const HistoryRow& row) {
    const RigidBodyRow& body = row.bodies.at(0);
    slowest = std::min(slowest, body.velocity[0]);
    touching += body.force[0] != 0;
    // The forces of the step that comes are on both sides of the balance.
    CHECK(row.momentum[0] + mass * body.velocity[0] == doctest::Approx(2 * mass).epsilon(1e-12));
    CHECK(row.momentum[1] + mass * body.velocity[1] == doctest::Approx(0.3 * mass).epsilon(1e-12));
  };
  Simulation simulation(model, {.threads = 2}, observer);
  simulation.run();
  CHECK(slowest < 0.5);  // it was stopped
  CHECK(touching > 5);
}

namespace {

/// A free disc of 0.15 m on a plane that falls by 20 degrees, after 0.3 s. Soft particles elsewhere
/// have steps in which a disc in contact would fall by its own way.
RigidBodyRow disc_on_plane(const Incline& at, const std::string& inertia, double youngs_modulus,
                           double dt) {
  Simulation simulation(model_of_text<2>(fmt::format(
                            R"({{
      "mesh": {{"structured": {{"cell_size": 0.05, "extent": [2, 2]}}}},
      "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": {},
                     "poisson_ratio": 0.3}}],
      "rigid_bodies": [
        {{"region": {{"half_space": {{"point": {}, "normal": [{}, {}]}}}}, "friction": {}}},
        {{"region": {{"sphere": {{"centre": {}, "radius": 0.15}}}}, "mass": 100{}}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                   "region": {{"box": {{"min": [1.8, 1.8], "max": [1.9, 1.9]}}}}}}}}],
      "external_loading_conditions": {{"gravity": [0, {}]}},
      "analysis": {{"mpm_scheme": "musl", "dt": {}, "nsteps": {}}}}})",
                            youngs_modulus, at.place(0, 0), at.sine(), at.cosine(), at.friction,
                            at.place(0, 0.15), inertia, -g, dt, std::lround(0.3 / dt))),
                        {.threads = 1});
  simulation.run();
  return simulation.history().bodies.at(1);
}

}  // namespace

TEST_CASE("rigid bodies: a free disc rolls and slides on a fixed one as rigid bodies do") {
  constexpr double thin = 100 * 0.15 * 0.15;  // [kg m^2] of a hollow cylinder
  for (const auto& [youngs_modulus, dt] : {std::pair(1e8, 1e-4), {1e5, 2e-3}})
    for (const auto& [friction, inertia, share] :
         {std::tuple(0.0, 0.0, 1.0), {0.5, 0.0, 2.0 / 3}, {0.5, thin, 0.5}, {0.5, thin / 4, 0.8}}) {
      CAPTURE(friction);
      CAPTURE(inertia);
      CAPTURE(dt);
      const Incline at{.angle = pi / 9, .friction = friction};
      const std::string given = inertia > 0 ? fmt::format(R"(, "inertia": {})", inertia) : "";
      const RigidBodyRow disc = disc_on_plane(at, given, youngs_modulus, dt);
      const double speed = disc.velocity[0] * at.cosine() - disc.velocity[1] * at.sine();
      CHECK(speed == test::within(0.01, share * g * at.sine() * 0.3));
      if (friction > 0) CHECK(-disc.spin[2] * 0.15 == test::within(0.02, speed));
    }
}

TEST_CASE("rigid bodies: a block that falls on one does not come back with more energy") {
  for (const auto& [functions, safety, most_drift] : {std::tuple("element", 0.5, 0.07),
                                                      {"gimp", 0.5, 0.07},
                                                      {"quadratic_spline", 0.5, 0.07},
                                                      {"element", 0.1, 0.02},
                                                      {"quadratic_spline", 0.1, 0.02}}) {
    CAPTURE(functions);
    CAPTURE(safety);
    Model<2> model = model_of_text<2>(fmt::format(
        R"({{
      "mesh": {{"structured": {{"cell_size": 0.05, "extent": [1, 1.5]}}}},
      "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                     "poisson_ratio": 0}}],
      "rigid_bodies": [{{"region": {{"half_space": {{"point": [0, 0.213], "normal": [0, 1]}}}}}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
        "region": {{"box": {{"min": [0.3, 0.3], "max": [0.7, 0.6]}}}}, "velocity": [0, -1]}}}}],
      "analysis": {{"mpm_scheme": "musl", "end_time": 0.1, "shape_functions": "{}",
                   "velocity_update": "flip",
                   "time_step": {{"adaptive": true, "safety": {}}}}},
      "post_processing": {{"history_steps": 10}}}})",
        functions, safety));
    Observer observer;
    double most = 0, least = 1e9;
    const double start = 0.5 * 1000 * 0.4 * 0.3;
    observer.history = [&](const HistoryRow& row) {
      most = std::max(most, row.kinetic);
      least = std::min(least, row.kinetic);
      CHECK(std::abs(row.balance) < most_drift * start);
      CHECK(row.damping > -1e-9 * start);
    };
    Simulation simulation(std::move(model), {.threads = 1}, observer);
    simulation.run();
    CHECK(most < 1.001 * start);
    CHECK(least < 0.5 * start);
    CHECK(simulation.history().momentum[1] > 0.25 * 1000 * 0.4 * 0.3);  // it is thrown back
  }
}

namespace {

/// Water at rest on a bed that cuts the mesh, 0.18 m deep; pressures up to 0.8 % of its modulus.
Model<2> pool_on_bed(const char* functions, const char* cut_cells) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.05, "extent": [1.2, 0.9]}}}},
    "materials": [{{"type": "Newtonian", "density": 1000, "bulk_modulus": 2.2e5,
                   "dynamic_viscosity": 1e-3}}],
    "geometry": {{"bed": {{"points": [[0, 0.3], [0.1, 0.3], [0.6, 0.12], [1.1, 0.31], [1.2, 0.31]]}}}},
    "rigid_bodies": [{{"region": {{"below": "bed"}}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 3, {} "material": 0,
      "region": {{"difference": [{{"box": {{"min": [0.1, 0], "max": [1.1, 0.3]}}}},
                                {{"below": "bed"}}]}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"mpm_scheme": "musl", "end_time": 1, "shape_functions": "{}"}},
    "post_processing": {{"history_steps": 1}}}})",
      cut_cells, functions));
}

}  // namespace

TEST_CASE(
    "rigid bodies: no particle of a column of water is inside of the tank that it stands in, "
    "however small a part of its cell it fills") {
  for (const char* functions : {"quadratic_spline", "element", "gimp"})
    for (const char* cut_cells : {"", R"("cut_cells": "centres",)"}) {
      CAPTURE(functions);
      CAPTURE(cut_cells);
      Model<2> model = pool_on_bed(functions, cut_cells);
      const SolidPtr<2> bed = model.rigid_bodies[0].solid;
      double force = 0, deepest = 0;
      int rows = 0;
      Observer observer;
      observer.history = [&](const HistoryRow& row) {
        if (row.time < 0.2) return;
        force += row.bodies.at(0).force[1];
        ++rows;
      };
      Simulation simulation(std::move(model), {.threads = 2}, observer);
      double lightest = 1;
      while (!simulation.finished()) {
        simulation.advance(100);
        const State state(simulation.frame());
        for (Index p = 0; p < state.size(); ++p) {
          const double inside = -bed->nearest({state.x(p, 0), state.x(p, 1)}).distance;
          deepest = std::max(deepest, inside / 0.05);
          lightest = std::min(lightest, 9 * state.get("mass", p) / (1000 * 0.05 * 0.05));
        }
      }
      MESSAGE(fmt::format("{}: deepest {:.2e} of a cell, lightest {:.2f} of a part", functions,
                          deepest, lightest));
      CHECK(deepest < 1e-9);
      if (*cut_cells == 0) CHECK(lightest < 0.2);
      // Its weight is on the bed.
      const HistoryRow row = simulation.history();
      CHECK(force / rows == test::within(0.01, -row.mass * g));
    }
}

namespace {

/// Mean force [N/m] on a plate that a jet of water of 0.2 m hits at 2 m/s, while the flow is
/// steady; with the defaults that users have.
double force_of_jet(double h) {
  Model<2> model = model_by_default<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {}, "extent": [2, 4]}}}},
    "materials": [{{"type": "Newtonian", "density": 1000, "bulk_modulus": 4e5,
                   "dynamic_viscosity": 1e-3}}],
    "rigid_bodies": [{{"region": {{"half_space": {{"point": [1.613, 0], "normal": [-1, 0]}}}}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
      "region": {{"box": {{"min": [0.3, 1.9], "max": [1.6, 2.1]}}}}, "velocity": [2, 0]}}}}],
    "analysis": {{"end_time": 0.55, "locate_particles": false}},
    "post_processing": {{"history_steps": 1}}}})",
      h));
  Observer observer;
  double impulse = 0, time = 0;
  observer.history = [&](const HistoryRow& row) {
    if (row.time < 0.25 || row.time > 0.5) return;
    impulse += row.dt * row.bodies.at(0).force[0];
    time += row.dt;
  };
  Simulation simulation(std::move(model), {.threads = 2}, observer);
  simulation.run();
  return impulse / time;
}

}  // namespace

TEST_CASE("rigid bodies: a jet of water pushes a plate with the momentum that it loses") {
  const double expected = 1000 * 0.2 * 2 * 2;
  for (const double h : {0.025, 0.0125}) CHECK(force_of_jet(h) == test::within(0.05, expected));
}

namespace {

/// Where a disc of 0.15 m comes to rest that falls on sand from 0.15 m above it [m].
RigidBodyRow disc_in_sand(double h) {
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {}, "extent": [2, 1.5]}},
      "boundary_conditions": {{"velocity_constraints": [{{"nset": "sides", "dir": "x",
                                                        "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"sides": {{"union": [
      {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
      {{"half_space": {{"point": [2, 0], "normal": [-1, 0]}}}}]}}}}}},
    "materials": [{{"type": "MohrCoulomb", "density": 1600, "youngs_modulus": 1e7,
                   "poisson_ratio": 0.3, "friction": 33, "dilation": 0, "cohesion": 0,
                   "tension_cutoff": 0}}],
    "rigid_bodies": [
      {{"region": {{"half_space": {{"point": [0, 0.1], "normal": [0, 1]}}}}, "friction": 0.5}},
      {{"region": {{"sphere": {{"centre": [1, 0.9], "radius": 0.15}}}}, "density": 2500,
       "friction": 0.4}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
      "region": {{"box": {{"min": [0, 0.1], "max": [2, 0.6]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"mpm_scheme": "musl", "end_time": 0.6}},
    "post_processing": {{"history_steps": 50}}}})",
      h));
  Simulation simulation(std::move(model), {.threads = 2});
  simulation.run();
  return simulation.history().bodies.at(1);
}

}  // namespace

TEST_CASE(
    "rigid bodies: a disc that falls into sand comes to rest, deeper by two fifths at most "
    "with half the cell") {
  const RigidBodyRow coarse = disc_in_sand(0.05), fine = disc_in_sand(0.025);
  const double start = 0.6 + 0.15;  // it touches the sand
  for (const RigidBodyRow& disc : {coarse, fine}) {
    CHECK(std::abs(disc.velocity[1]) < 0.05);
    CHECK(std::abs(disc.place[0] - 1) < 0.01);
    CHECK(start - disc.place[1] > 0.02);
  }
  CHECK(coarse.place[1] == test::within(0.02, fine.place[1]));
  CHECK(start - fine.place[1] < 1.4 * (start - coarse.place[1]));
}

namespace {

/// The block of Incline in quasi-static steps that raise gravity from zero.
Model<2> at_rest(const Incline& incline, const char* functions) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.05, "extent": [2.5, 2.5]}}}},
    "materials": [{{"type": "LinearElastic", "density": 2000, "youngs_modulus": 1e7,
                   "poisson_ratio": 0.2}}],
    "rigid_bodies": [{{"region": {{"half_space": {{"point": {}, "normal": [{}, {}]}}}},
                      "friction": {}}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
      "region": {{"polygon": {{"points": [{}, {}, {}, {}]}}}}}}}}],
    "external_loading_conditions": {{"gravity": {{"gravity": [0, {}], "ramping_time": 1}}}},
    "analysis": {{"mpm_scheme": "newmark", "dt": 0.25, "nsteps": 4, "shape_functions": "{}",
                 "scheme_settings": {{"quasi_static": true}}}}}})",
      incline.place(0, 0), incline.sine(), incline.cosine(), incline.friction, incline.place(0, 0),
      incline.place(0.6, 0), incline.place(0.6, 0.15), incline.place(0, 0.15), -g, functions));
}

}  // namespace

TEST_CASE(
    "rigid bodies: quasi-static steps put the weight of a block on the plane that carries it") {
  for (const char* functions : {"element", "quadratic_spline"}) {
    CAPTURE(functions);
    const Incline incline{.angle = 15 * pi / 180, .friction = 0.6};
    Simulation simulation(at_rest(incline, functions), {.threads = 2});
    simulation.run();
    const HistoryRow row = simulation.history();
    CHECK(row.bodies.at(0).force[1] == test::within(1e-4, -row.mass * g));
    CHECK(std::abs(row.bodies.at(0).force[0]) < 1e-4 * row.mass * g);
    const State state(simulation.frame());
    for (Index p = 0; p < state.size(); ++p) CHECK(std::abs(state.get("displacement", p)) < 1e-3);
  }
}

TEST_CASE("rigid bodies: there is no equilibrium of a block on a plane that is too steep") {
  const Incline incline{.angle = 15 * pi / 180, .friction = 0.2};
  Simulation simulation(at_rest(incline, "element"), {.threads = 1});
  CHECK_THROWS_AS(simulation.run(), SimulationError);
}

// The springs of all particles together would throw a body that is lighter than part of a cell.
TEST_CASE("rigid bodies: light plates rest on soil and on water with the step of the material") {
  struct Bed {
    const char* material;
    double k0, density, settles;
  };
  for (const auto& [material, k0, density, settles] :
       {Bed{R"("type": "LinearElastic", "density": 2000, "youngs_modulus": 1e6,
              "poisson_ratio": 0.2)",
            0.25, 300, 0.001},
        Bed{R"("type": "LinearElastic", "density": 2000, "youngs_modulus": 1e6,
              "poisson_ratio": 0.2)",
            0.25, 20, 0.001},
        Bed{R"("type": "MohrCoulomb", "density": 2000, "youngs_modulus": 1e7, "poisson_ratio": 0.3,
              "friction": 30, "dilation": 0, "cohesion": 1000, "tension_cutoff": 0)",
            0.5, 300, 0.001},
        Bed{R"("type": "Newtonian", "density": 1000, "bulk_modulus": 1e6, "dynamic_viscosity": 1)",
            1, 100, 0.02}}) {
    CAPTURE(material);
    CAPTURE(density);
    Simulation simulation(model_of_text<2>(fmt::format(R"({{
      "mesh": {{"structured": {{"cell_size": 0.25, "extent": [4, 3]}},
        "boundary_conditions": {{"velocity_constraints": [
          {{"nset": "floor", "dir": "y", "velocity": 0}}, {{"nset": "sides", "dir": "x", "velocity": 0}}]}},
        "particles_stresses": {{"type": "k0", "k0": {1}}}}},
      "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
        "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                            {{"half_space": {{"point": [4, 0], "normal": [-1, 0]}}}}]}}}}}},
      "materials": [{{"name": "bed", {0}}}],
      "particles": [{{"generator": {{"type": "region", "material": "bed", "per_cell": 2,
        "region": {{"box": {{"min": [0, 0], "max": [4, 1]}}}}}}}}],
      "rigid_bodies": [{{"name": "plate", "density": {2}, "friction": 0.3,
        "region": {{"box": {{"min": [1.5, 1], "max": [2.5, 1.05]}}}}}}],
      "external_loading_conditions": {{"gravity": [0, -9.81]}},
      "analysis": {{"preset": "lahar", "end_time": 1}}}})",
                                                       material, k0, density)));
    double fastest = 0;
    while (!simulation.finished()) {
      simulation.advance(20);
      const auto& v = simulation.history().bodies.back().velocity;
      fastest = std::max(fastest, std::hypot(v[0], v[1]));
    }
    const RigidBodyRow plate = simulation.history().bodies.back();
    MESSAGE(fmt::format("{} kg/m^3: at most {:.4f} m/s, sinks by {:.5f} m", density, fastest,
                        1.025 - plate.place[1]));
    CHECK(fastest < 0.1);
    CHECK(std::abs(plate.place[1] - 1.025) < settles);
    CHECK(std::abs(plate.rotation[2]) < 0.02);
  }
}

namespace {

/// An elastic block that lies on a floor and at a wall without friction, and a plate on it.
constexpr double pressed_E = 1e6, pressed_nu = 0.3, squeeze = 0.01, side = 0.4;

/// `push` is a function of time: the speed of the plate downwards over `squeeze` per second.
Simulation pressed_block(double cell, const std::string& push, const std::string& analysis) {
  return Simulation(model_by_default<2>(fmt::format(
      R"({{
        "mesh": {{"structured": {{"cell_size": {0}, "extent": [0.8, 0.6]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset": "floor", "dir": "y", "velocity": 0}},
            {{"nset": "left", "dir": "x", "velocity": 0}}]}}}},
        "sets": {{"nodes": {{"floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
                           "left": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}}}}}},
        "materials": [{{"name": "m", "type": "LinearElastic", "density": 1000,
          "youngs_modulus": {1}, "poisson_ratio": {2}}}],
        "particles": [{{"generator": {{"type": "region", "material": "m", "per_cell": 2,
          "region": {{"box": {{"min": [0, 0], "max": [{3}, {3}]}}}}}}}}],
        "rigid_bodies": [{{"name": "plate",
          "region": {{"box": {{"min": [-1, {3}], "max": [2, 1.4]}}}},
          "velocity": [0, -{4}], "math_function_id": "push"}}],
        "math_functions": [{{"name": "push", "type": "Linear", {5}}}],
        "analysis": {{{6}}}}})",
      cell, pressed_E, pressed_nu, side, squeeze, push, analysis)));
}

/// Mean vertical stress of its lower half [Pa].
double stress_below(const Simulation& simulation) {
  const State now(simulation.frame());
  return mean(
      now, [&](Index p) { return now.x(p, 1) < side / 2; },
      [&](Index p) { return now.get("stress", p, 1); });
}

}  // namespace

// Its upper side lies on a line of the grid: nodes beyond it have little mass. It gave way, by 11 %
// after a second and by 19 % after four, with an energy that nothing had.
TEST_CASE("rigid bodies: an elastic block that a plate presses bears its load, and goes on to") {
  for (const auto& [cell, safety] : {std::pair{0.05, 0.4}, {0.05, 0.2}, {0.025, 0.4}}) {
    CAPTURE(cell);
    CAPTURE(safety);
    Simulation simulation =
        pressed_block(cell, R"("xvalues": [0, 0.5, 0.5001, 10], "fxvalues": [2, 2, 0, 0])",
                      fmt::format(R"("end_time": 4, "time_step": {{"safety": {}}},
          "damping": {{"type": "Cundall", "damping_factor": 0.3}})",
                                  safety));
    simulation.run();
    // Contact yields by p / M of half a cell.
    CHECK(stress_below(simulation) ==
          test::within(0.04, -pressed_E / (1 - pressed_nu * pressed_nu) * squeeze / side));
    const HistoryRow row = simulation.history();
    CHECK(std::abs(row.balance) < 0.015 * row.internal);
  }
}

TEST_CASE("rigid bodies: a plate presses a block by equilibria, and lets it go") {
  const double pressure = pressed_E / (1 - pressed_nu * pressed_nu) * squeeze / side;
  for (const auto& [cell, steps] : {std::pair{0.05, 8}, {0.05, 16}, {0.025, 8}}) {
    CAPTURE(cell);
    CAPTURE(steps);
    Simulation simulation = pressed_block(
        cell, R"("xvalues": [0, 1, 1.000001, 3], "fxvalues": [1, 1, -1, -1])",
        fmt::format(R"("mpm_scheme": "newmark", "scheme_settings": {{"quasi_static": true}},
          "dt": {}, "nsteps": {})",
                    1.0 / steps, 2 * steps + 1));
    simulation.advance(steps);
    // Contact yields by p / M of half a cell.
    CHECK(stress_below(simulation) == test::within(0.035, -pressure));
    const HistoryRow pressed = simulation.history();
    const double force = pressed.bodies.back().force[1];
    CHECK(force == test::within(0.035, pressure * side));
    // Half of the force on its way, within what stresses of finite strains are not elastic.
    CHECK(pressed.external == test::within(0.03, 0.5 * force * squeeze));
    CHECK(std::abs(pressed.balance) < 0.01 * pressed.internal);
    simulation.advance(steps + 1);
    CHECK(std::abs(stress_below(simulation)) < 1e-3 * pressure);
    CHECK(std::abs(simulation.history().external) < 0.02 * pressed.external);
  }
}
