// Prescribed velocities that are functions of time: motions, energy, and the promise of equal bits.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/runtime/step/restart_checks.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double end_time = 0.3, frequency = 2 * std::numbers::pi / 0.25, amplitude = 0.4;

/// w = 0.4 sin(2 pi (t + 0.05 s) / 0.25 s) m/s; its integral from the start.
double velocity_at(double t) {
  return amplitude * std::sin(frequency * (t + 0.05));
}
double path_at(double t) {
  return amplitude / frequency * (std::cos(frequency * 0.05) - std::cos(frequency * (t + 0.05)));
}

/// A block of 2 x 1 m in a mesh of 4 x 2 m.
Model<2> block(const std::string& constraints, const std::string& analysis, double dt) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.25, "extent": [4, 2]}},
      "boundary_conditions": {{{}}}}},
    "sets": {{"nodes": {{"left": {{"half_space": {{"point": [1, 0], "normal": [1, 0]}}}},
                         "right": {{"half_space": {{"point": [3, 0], "normal": [-1, 0]}}}}}}}},
    "math_functions": [{{"name": "shake", "type": "Sin", "x0": -0.05, "a": {},
                         "xrange": [-1, 10]}}],
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                    "poisson_ratio": 0}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                    "region": {{"box": {{"min": [1, 0], "max": [3, 1]}}}}}}}}],
    "analysis": {{{}, "dt": {}, "nsteps": {}, "patch_particles": 32}}}})",
      constraints, frequency, analysis, dt, std::lround(end_time / dt)));
}

std::string scheme(const std::string& name, const std::string& more = "") {
  return fmt::format(R"("mpm_scheme": "{}"{})", name, more);
}

std::string shaken(const std::string& set, double velocity = amplitude) {
  return fmt::format(
      R"("velocity_constraints": [{{"nset_id": -1, "dir": "y", "velocity": 0}},
        {{{}, "dir": "x", "velocity": {}, "math_function_id": "shake"}}])",
      set, velocity);
}

const std::string all = R"("nset_id": -1)";

struct Motion {
  double path = 0, velocity = 0, balance = 0, kinetic = 0;  ///< largest differences, and energy
};

/// All particles at each end of a step against the functions above.
Motion worst_of(Model<2> model, double lag = 0) {
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.push_back({velocity_at(0) + 0 * x[0], 0});
  Motion worst;
  Simulation simulation(model, {.threads = 2});
  const Frame start = simulation.frame();
  const HistoryRow first = simulation.history();
  while (simulation.step() < model.analysis.nsteps) {
    simulation.advance(1);
    const Frame now = simulation.frame();
    const auto& v = now.find("velocity")->values;
    for (std::size_t k = 0; k < v.size(); k += 2) {
      const double moved = now.coordinates[k] - start.coordinates[k];
      worst.path = std::max(worst.path, std::abs(moved - path_at(now.time)));
      worst.velocity = std::max(worst.velocity, std::abs(v[k] - velocity_at(now.time - lag)));
    }
    const HistoryRow row = simulation.history();
    worst.kinetic = std::max(worst.kinetic, row.kinetic);
    worst.balance = std::max(worst.balance, std::abs(row.kinetic - first.kinetic + row.internal +
                                                     row.damping - row.external));
  }
  return worst;
}

}  // namespace

TEST_CASE("nodes that follow a function of time move particles by its integral, to second order") {
  for (const std::string name : {"usf", "usl", "musl", "newmark"}) {
    CAPTURE(name);
    const Motion coarse = worst_of(block(shaken(all), scheme(name), 2e-3));
    const Motion fine = worst_of(block(shaken(all), scheme(name), 1e-3));
    CHECK(coarse.path < 2e-5);  // of 0.03 m
    CHECK(coarse.path > 3.8 * fine.path);
    CHECK(coarse.velocity < 1e-12);
    CHECK(coarse.kinetic > 150);
    CHECK(coarse.balance < 1e-9 * coarse.kinetic);
  }
}

// Particles kept the velocity that they had, 0 with FLIP, and no energy was counted.
TEST_CASE("what nodes prescribe from the first step on, constant or not, particles have after it") {
  constexpr double velocity = 2;
  const std::string constant = R"("velocity_constraints": [
    {"nset_id": -1, "dir": "y", "velocity": 0}, {"nset_id": -1, "dir": "x", "velocity": 2}])";
  for (const std::string& constraints : {constant, shaken(all)})
    for (const std::string name : {"usf", "usl", "musl", "newmark"})
      for (const std::string update : {"flip", "apic", "pic"}) {
        if (name == "newmark" && update != "flip") continue;
        Model<2> model =
            block(constraints, scheme(name, R"(, "velocity_update": ")" + update + '"'), 1e-3);
        model.analysis.nsteps = 10;
        Simulation simulation(model, {.threads = 2});
        simulation.run();
        const HistoryRow row = simulation.history();
        const double v = constraints == constant ? velocity : velocity_at(row.time);
        CAPTURE(name);
        CAPTURE(update);
        CHECK(row.momentum[0] == within(0.02, row.mass * v));
        CHECK(row.kinetic == within(0.04, 0.5 * row.mass * v * v));
        CHECK(row.external == within(0.02, row.kinetic));
        // Particles that take velocities of nodes have those of the middle of the step.
        if (constraints != constant && update != "flip") continue;
        CHECK(std::abs(row.balance) < 1e-9 * row.kinetic);
        if (constraints != constant) continue;
        CHECK(row.momentum[0] == doctest::Approx(row.mass * v).epsilon(1e-12));
        CHECK(row.external == doctest::Approx(row.kinetic).epsilon(1e-12));
      }
}

TEST_CASE(
    "a body that moves as its nodes prescribe is not pushed, and CB-Geo's keeps its velocity") {
  Model<2> model = block(R"("velocity_constraints": [{"nset_id": -1, "dir": "x", "velocity": 2}])",
                         scheme("usf", R"(, "velocity_update": "flip")"), 1e-3);
  model.analysis.nsteps = 1;
  model.analysis.sudden_velocities = false;
  Simulation theirs(model);
  theirs.run();
  CHECK(theirs.history().momentum[0] == 0);
  model.analysis.sudden_velocities = true;
  model.particles.velocity.assign(model.particles.x.size(), Vec<2>(2, 0));
  Simulation moving(model);
  moving.run();
  CHECK(std::abs(moving.history().external) < 1e-9);
}

TEST_CASE("adaptive steps follow a function of time as well") {
  for (const std::string name : {"usf", "usl", "musl"}) {
    Model<2> model = block(shaken(all), scheme(name), 2e-3);
    model.analysis.step = {.adaptive = true, .dt = 2e-3, .safety = 0.3};
    model.analysis.nsteps = 200;
    const Motion worst = worst_of(model);
    CAPTURE(name);
    CHECK(worst.path < 2e-5);
    CHECK(worst.velocity < 1e-12);
    CHECK(worst.balance < 1e-9 * worst.kinetic);
  }
}

TEST_CASE("nodes with axes of their own follow a function of time along these") {
  for (const std::string name : {"usf", "usl", "musl", "newmark"}) {
    Model<2> model = block(shaken(all), scheme(name), 2e-3);
    const double c = std::cos(0.5), t = std::sin(0.5);
    Eigen::Matrix2d axes;
    axes << c, -t, t, c;
    for (Index n = 0; n < model.mesh->n_nodes(); n += 2) model.node_frames.push_back({n, axes});
    for (NodeVelocity& v : entries_of<NodeVelocity>(model))
      if (v.node % 2 == 0) v = {v.node, v.dir, amplitude * (v.dir == 0 ? c : -t), 0};
    CAPTURE(name);
    const Motion worst = worst_of(model);
    CHECK(worst.path < 2e-5);
    CHECK(worst.velocity < 1e-12);
    CHECK(worst.balance < 1e-9 * worst.kinetic);
  }
}

TEST_CASE("nodes with a prescribed acceleration move as with the velocity that is its integral") {
  const auto end_of = [](const std::string& list) {
    Model<2> model = model_of_text<2>(fmt::format(
        R"({{
      "mesh": {{"structured": {{"cell_size": 0.25, "extent": [4, 2]}},
        "boundary_conditions": {{{}}}}},
      "sets": {{"nodes": {{"left": {{"half_space": {{"point": [1, 0], "normal": [1, 0]}}}}}}}},
      "math_functions": [
        {{"name": "record", "type": "Linear", "xvalues": [0, 0.1, 0.2], "fxvalues": [1, 1, 0]}},
        {{"name": "ramp", "type": "Linear", "xvalues": [0, 9], "fxvalues": [0, 9]}}],
      "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                      "poisson_ratio": 0}}],
      "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                      "region": {{"box": {{"min": [1, 0], "max": [3, 1]}}}}}}}}],
      "analysis": {{"dt": 1e-3, "nsteps": 200}}}})",
        list));
    Simulation simulation(model, {.threads = 2});
    simulation.advance(200);
    return simulation.frame();
  };
  const auto largest_difference = [](const Frame& a, const Frame& b) {
    double largest = 0;
    for (std::size_t k = 0; k < a.coordinates.size(); ++k)
      largest = std::max(largest, std::abs(a.coordinates[k] - b.coordinates[k]));
    return largest;
  };
  const Frame accelerated =
      end_of(R"("acceleration_constraints": [{"nset": "left", "dir": "x", "acceleration": 3}])");
  const Frame driven = end_of(R"("velocity_constraints": [
      {"nset": "left", "dir": "x", "velocity": 3, "math_function_id": "ramp"}])");
  CHECK(largest_difference(accelerated, driven) < 1e-12);

  // All nodes: 3 m/s^2 for 0.1 s, then less until 0 at 0.2 s.
  const Frame all_nodes = end_of(R"("acceleration_constraints": [
      {"nset_id": -1, "dir": "x", "acceleration": 3, "math_function_id": "record"}])");
  const double velocity = 3 * 0.15, path = 3 * (0.005 + 0.01 + 0.01 / 3);
  double centre = 0;
  for (std::size_t k = 0; k < all_nodes.coordinates.size(); k += 2) {
    CHECK(all_nodes.find("velocity")->values[k] == doctest::Approx(velocity).epsilon(1e-12));
    centre += all_nodes.coordinates[k] / static_cast<double>(all_nodes.coordinates.size() / 2);
  }
  CHECK(centre - 2 == within(1e-4, path));
}

TEST_CASE("particles that follow a function of time move by its integral") {
  const std::string driven = R"("particles_velocity_constraints": [
    {"pset_id": -1, "dir": "x", "velocity": 0.4, "math_function_id": "shake"},
    {"pset_id": -1, "dir": "y", "velocity": 0}])";
  for (const std::string name : {"usf", "usl", "musl"})
    for (const bool adaptive : {false, true}) {
      CAPTURE(name);
      CAPTURE(adaptive);
      Model<2> model = block(driven, scheme(name), 2e-3);
      if (adaptive) {
        model.analysis.step = {.adaptive = true, .dt = 2e-3, .safety = 0.9};
        model.analysis.nsteps = 150;
      }
      const Motion worst = worst_of(model, adaptive ? 0.0 : 1e-3);  // velocities of the middle
      CHECK(worst.path < 2e-5);
      if (!adaptive) CHECK(worst.velocity < 1e-12);
      // The first step begins with the velocity at the start, not half a step before it.
      CHECK(worst.balance < 1e-9 * worst.kinetic);
    }
}

TEST_CASE("the work of a piston that swings is the energy of the bar that it shakes") {
  for (const std::string name : {"usf", "usl", "musl"}) {
    CAPTURE(name);
    double drift[2] = {0, 0}, energy = 0;
    for (const int k : {0, 1}) {
      Model<2> model = block(shaken(R"("nset": "left")", 0.05), scheme(name), k == 0 ? 4e-4 : 1e-4);
      Simulation simulation(model, flow(2));
      const HistoryRow start = simulation.history();
      while (simulation.step() < model.analysis.nsteps) {
        simulation.advance(10);
        const HistoryRow row = simulation.history();
        drift[k] = std::max(drift[k], std::abs(row.kinetic + row.internal + row.damping -
                                               row.external - start.kinetic));
        energy = std::max(energy, row.kinetic + row.internal);
      }
    }
    CHECK(energy > 2);  // [J]
    CHECK(drift[0] < 0.05 * energy);
    CHECK(drift[1] < 0.02 * energy);
  }
}

TEST_CASE("functions of time of constraints give equal bits, and leave no state behind") {
  for (const std::string name : {"usf", "usl", "musl"})
    for (const bool adaptive : {false, true}) {
      CAPTURE(name);
      CAPTURE(adaptive);
      Model<2> model = block(shaken(R"("nset": "left")"), scheme(name), 1e-3);
      if (adaptive) model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.4};
      model.analysis.nsteps = 120;
      model.output.frame_steps = model.output.history_steps = 20;
      check_ways(model);
      check_restart(model, 37, 80);
      ParticleVelocity drive{.particles = {}, .dir = 0, .velocity = 0.4, .function = 0};
      for (Index p = 0; p < model.particles.size(); ++p)
        if (model.particles.x[static_cast<std::size_t>(p)][0] > 2.5) drive.particles.push_back(p);
      model.particle_velocities = {drive};
      model.analysis.drives_nodes = model.analysis.particles_follow_time = true;
      check_ways(model);
      check_restart(model, 37, 80);
      check_restart(in_contact(model), 37, 80, {flow(2)});
    }
}

TEST_CASE("implicit steps with functions of time have the same bits on any threads") {
  Model<2> model = block(shaken(R"("nset": "left")"), scheme("newmark"), 2e-3);
  model.analysis.nsteps = 40;
  model.output.frame_steps = model.output.history_steps = 10;
  const Outcome reference = run(model, {.threads = 1});
  REQUIRE(reference.error == "");
  CHECK(same_bits(run(model, {.threads = 2}), reference));
  // It goes on from any step.
  Simulation first(model, {.threads = 2});
  first.advance(17);
  const StoredState middle(first.state());
  Simulation second(model, {.threads = 1}, {}, middle.view());
  second.advance(23);
  CHECK(same_bits(second.frame(), reference.frames.back()));
}

TEST_CASE("a constraint whose function is always one has the bits of a constant") {
  for (const std::string name : {"usf", "usl", "musl", "newmark"}) {
    CAPTURE(name);
    Model<2> constant = block(shaken(R"("nset": "left")"), scheme(name), 1e-3);
    for (NodeVelocity& v : entries_of<NodeVelocity>(constant)) v.function = -1;
    Model<2> timed = constant;
    timed.functions = {{.kind = MathFunction::Kind::linear, .x = {0, 1}, .f = {1, 1}}};
    for (NodeVelocity& v : entries_of<NodeVelocity>(timed)) v.function = 0;
    timed.analysis.nsteps = constant.analysis.nsteps = 60;
    CHECK(same_bits(run(timed, serial()), run(constant, serial())));
  }
}

TEST_CASE("a liquid in pores follows a function of time as its skeleton does") {
  for (const std::string name : {"usf", "usl", "musl"})
    for (const std::string constraint :
         {R"({"nset_id": -1, "dir": "x", "velocity": 0.4, "math_function_id": "shake"})",
          R"({"nset_id": -1, "dir": "x", "velocity": 0.4, "math_function_id": "shake",
              "phase": "skeleton"},
             {"nset_id": -1, "dir": 2, "velocity": 0.4, "math_function_id": "shake"})"}) {
      Model<2> model = model_of_text<2>(fmt::format(
          R"({{
        "mesh": {{"structured": {{"cell_size": 0.25, "extent": [4, 1]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset_id": -1, "dir": "y", "velocity": 0}}, {}]}}}},
        "math_functions": [{{"name": "shake", "type": "Sin", "x0": -0.05, "a": {},
                             "xrange": [-1, 10]}}],
        "materials": [
          {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e6,
            "poisson_ratio": 0.3, "porosity": 0.4, "k_x": 1e-2}},
          {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e7,
            "dynamic_viscosity": 1e-3}}],
        "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"],
          "per_cell": 2, "region": {{"box": {{"min": [1, 0], "max": [3, 1]}}}}}}}}],
        "analysis": {{{}, "dt": 4e-4, "nsteps": 200}}}})",
          constraint, frequency, scheme(name)));
      for (std::size_t p = 0; p < model.particles.x.size(); ++p)
        model.particles.velocity.push_back({velocity_at(0), 0});
      CAPTURE(name);
      CHECK(model.liquid_velocities.size() > 0);
      Simulation simulation(model, flow(2));
      const HistoryRow start = simulation.history();
      simulation.run();
      const Frame end = simulation.frame();
      const HistoryRow row = simulation.history();
      for (const char* phase : {"velocity", "liquid_velocity"}) {
        const auto& v = end.find(phase)->values;
        for (std::size_t k = 0; k < v.size(); k += 2)
          CHECK(std::abs(v[k] - velocity_at(end.time)) < 1e-12);
      }
      CHECK(std::abs(row.kinetic - start.kinetic + row.internal + row.damping - row.external) <
            1e-9 * (start.kinetic + std::abs(row.external)));
    }
}

TEST_CASE("a piston that follows a function of time moves water that keeps its volume") {
  // A closed tank would have no motion; this one is open above. The level rises as the piston goes.
  Model<2> model = model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.1, "extent": [1, 1]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "piston", "dir": "x", "velocity": {}, "math_function_id": "shake"}},
        {{"nset": "end", "dir": "x", "velocity": 0}}, {{"nset": "floor", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"piston": {{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                         "end": {{"half_space": {{"point": [1, 0], "normal": [-1, 0]}}}},
                         "floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}}}},
    "math_functions": [{{"name": "shake", "type": "Sin", "x0": -0.05, "a": {}, "xrange": [-1, 10]}}],
    "materials": [{{"type": "Newtonian", "density": 1000, "bulk_modulus": 1e7,
                    "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                    "region": {{"box": {{"max": [1, 0.5]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"mpm_scheme": "projection", "dt": 2e-3, "nsteps": 20}}}})",
      amplitude, frequency));
  Simulation simulation(model, {.threads = 2});
  const Frame start = simulation.frame();
  simulation.run();
  const Frame end = simulation.frame();
  double risen = 0;
  const std::size_t n = start.coordinates.size() / 2;
  for (std::size_t p = 0; p < n; ++p)
    risen += (end.coordinates[2 * p + 1] - start.coordinates[2 * p + 1]) / static_cast<double>(n);
  // Water of depth d is pushed together by x: d grows by d x / L, its centre by half of that.
  CHECK(risen == within(0.1, 0.5 * 0.5 * path_at(end.time)));
}
