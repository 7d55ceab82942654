// The account of energy with every transfer of velocities: what goes is found somewhere.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

struct Transfer {
  std::string name, settings;  // of velocity_update
};

std::string keys(const Transfer& transfer) {
  return R"("velocity_update": ")" + transfer.name + R"(", "velocity_update_settings": {)" +
         transfer.settings + "}";
}

/// An elastic block that falls on a wall and bounces.
Model<2> falling(const Transfer& transfer, const std::string& scheme, double dt) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.1, "extent": [1, 1.5]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "floor", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"floor": {{"box": {{"max": [9, 0]}}}}}}}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.2}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                                 "region": {{"box": {{"min": [0.25, 0.25], "max": [0.75, 0.75]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"mpm_scheme": "{}", "shape_functions": "quadratic_spline",
                 "patch_particles": 32, "dt": {}, "end_time": 0.4, {}}}}})",
      scheme, dt, keys(transfer)));
}

/// Two elastic blocks that collide.
Model<2> colliding(const Transfer& transfer, double dt) {
  return model_of_text<2>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.1, "extent": [2, 1]}}}},
    "materials": [{{"name": "left", "type": "LinearElastic", "density": 1000,
                   "youngs_modulus": 1e6, "poisson_ratio": 0.2}},
                  {{"name": "right", "type": "LinearElastic", "density": 1000,
                   "youngs_modulus": 1e6, "poisson_ratio": 0.2}}],
    "particles": [
      {{"generator": {{"type": "region", "per_cell": 2, "material": "left",
          "region": {{"box": {{"min": [0.4, 0.3], "max": [0.9, 0.7]}}}},
          "velocity": [1, 0]}}}},
      {{"generator": {{"type": "region", "per_cell": 2, "material": "right",
          "region": {{"box": {{"min": [1.05, 0.35], "max": [1.55, 0.75]}}}},
          "velocity": [-1, 0]}}}}],
    "analysis": {{"mpm_scheme": "musl", "shape_functions": "quadratic_spline",
                 "patch_particles": 32, "dt": {}, "end_time": 0.2, "interface": true, "contact": {{"friction": 0.3}}, {}}}}})",
      dt, keys(transfer)));
}

const std::vector<Transfer> transfers = {{"flip", R"("relaxation": 0)"},
                                         {"flip", R"("relaxation": 0.05)"},
                                         {"xpic", R"("order": 1)"},
                                         {"xpic", R"("order": 2)"},
                                         {"xpic", R"("order": 3)"},
                                         {"fmpm", R"("order": 2)"},
                                         {"fmpm", R"("order": 3)"},
                                         {"apic", ""},
                                         {"apic", R"("relaxation": 0.2)"},
                                         {"tpic", ""},
                                         {"tpic", R"("relaxation": 0.2)"},
                                         {"apic", R"("relaxation": 0)"},
                                         {"asflip", ""},
                                         {"asflip", R"("relaxation": 0)"},
                                         {"asflip", R"("relaxation": 0.2)"}};

/// Largest balance over the run, as a share of the largest kinetic energy.
double worst_balance(Model<2> model) {
  double balance = 0, kinetic = 0;
  model.output.history_steps = 5;
  Observer observer;
  observer.history = [&](const HistoryRow& row) {
    balance = std::max(balance, std::abs(row.balance));
    kinetic = std::max(kinetic, row.kinetic);
  };
  Simulation simulation(std::move(model), {}, observer);
  simulation.run();
  return balance / kinetic;
}

}  // namespace

// What the second mapping smooths was counted as given to particles: 0.10 with APIC without
// relaxation, 0.06 with others. Measured 0.010 to 0.011, and half of it with half the step.
TEST_CASE("the account of blocks that collide closes with every transfer, and with the step") {
  for (const Transfer& transfer : transfers)
    for (const double dt : {3e-4, 1.5e-4}) {
      const double worst = worst_balance(colliding(transfer, dt));
      CAPTURE(transfer.name);
      CAPTURE(transfer.settings);
      CAPTURE(dt);
      CHECK(worst < (dt > 2e-4 ? 0.015 : 0.008));
    }
}

// USL has strains of velocities that particles do not get: TPIC 0.08 and, with half the step, 0.10.
// MUSL at most 0.014, and half of it.
TEST_CASE("the account of a block that falls on held nodes closes with every transfer") {
  for (const std::string scheme : {"usl", "musl"})
    for (const Transfer& transfer : transfers)
      for (const double dt : {3e-4, 1.5e-4}) {
        const double worst = worst_balance(falling(transfer, scheme, dt));
        CAPTURE(scheme);
        CAPTURE(transfer.name);
        CAPTURE(transfer.settings);
        CAPTURE(dt);
        CHECK(worst < (scheme == "usl" ? 0.12 : dt > 2e-4 ? 0.02 : 0.01));
      }
}

// What the second mapping smooths is not given to particles. It was counted as if it were: 0.28 of
// the work with PIC, 0.44 with XPIC of order 2, 0.57 with order 5.
TEST_CASE("the account of water that sloshes closes with every transfer that damps in each step") {
  for (const Transfer& transfer : std::vector<Transfer>{{"xpic", R"("order": 1)"},
                                                        {"xpic", R"("order": 2)"},
                                                        {"xpic", R"("order": 5)"},
                                                        {"fmpm", R"("order": 2)"},
                                                        {"apic", ""},
                                                        {"tpic", ""}}) {
    Model<2> model = model_of_text<2>(fmt::format(
        R"({{
    "mesh": {{"structured": {{"cell_size": 0.02, "extent": [0.2, 0.6]}},
             "boundary_conditions": {{"velocity_constraints": [
               {{"nset": "sides", "dir": "x", "velocity": 0}},
               {{"nset": "floor", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{
      "floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
      "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                          {{"half_space": {{"point": [0.2, 0], "normal": [-1, 0]}}}}]}}}}}},
    "materials": [{{"type": "Newtonian", "density": 1000, "bulk_modulus": 4e5,
                   "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "per_cell": 3, "material": 0,
                   "region": {{"box": {{"max": [0.1, 0.2]}}}}}}}}],
    "external_loading_conditions": {{"gravity": [0, -9.81]}},
    "analysis": {{"mpm_scheme": "musl", "shape_functions": "quadratic_spline",
                 "patch_particles": 64, "time_step": {{"adaptive": true, "safety": 0.4}},
                 "end_time": 0.8, {}}}}})",
        keys(transfer)));
    Simulation simulation(std::move(model));
    simulation.run();
    const HistoryRow end = simulation.history();
    CAPTURE(transfer.name);
    CAPTURE(transfer.settings);
    CHECK(end.external > 5);
    CHECK(std::abs(end.balance) < 0.03 * end.external);
  }
}

// With musl its second mapping made energy of the load: a tenth of the work in 3 s with GIMP, and
// the bar tore in cells half as large. Two oscillations with a period of 0.65 s are what the ramp
// leaves, of 4 J of 8 kJ.
TEST_CASE("an elastic bar stays as it is under a load that stretches it by 8 %, with defaults") {
  const auto run = [](const std::string& functions, double cell) {
    auto simulation = std::make_unique<Simulation>(model_by_default<2>(fmt::format(
        R"({{
        "mesh": {{"structured": {{"cell_size": {}, "extent": [0.5, 5]}},
          "boundary_conditions": {{"velocity_constraints": [
            {{"nset": "floor", "dir": "y", "velocity": 0}},
            {{"nset": "sides", "dir": "x", "velocity": 0}}]}}}},
        "sets": {{"nodes": {{
          "floor": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}},
          "sides": {{"union": [{{"half_space": {{"point": [0, 0], "normal": [1, 0]}}}},
                              {{"half_space": {{"point": [0.5, 0], "normal": [-1, 0]}}}}]}}}},
          "particles": {{"top": {{"box": {{"min": [0, {}], "max": [0.5, 4]}}}}}}}},
        "math_functions": [{{"name": "ramp", "type": "Linear", "xvalues": [0, 1],
                             "fxvalues": [0, 1]}}],
        "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                       "poisson_ratio": 0.3}}],
        "particles": [{{"generator": {{"type": "region", "material": 0,
                       "region": {{"box": {{"min": [0, 0], "max": [0.5, 4]}}}}}}}}],
        "external_loading_conditions": {{"particle_surface_traction": [
          {{"pset": "top", "dir": 1, "traction": 1e5, "math_function_id": "ramp"}}]}},
        "analysis": {{"shape_functions": "{}", "end_time": 2.5}}}})",
        cell, 4 - 0.5 * cell, functions)));
    simulation->run();
    return simulation;
  };
  for (const std::string functions : {"quadratic_spline", "gimp", "cpdi", "cpdi2"})
    for (const double cell : {0.25, 0.125}) {
      const auto simulation = run(functions, cell);
      const HistoryRow end = simulation->history();
      CAPTURE(functions);
      CAPTURE(cell);
      CHECK(end.kinetic < 0.004 * end.internal);
      CHECK(std::abs(end.balance) < 0.01 * end.external);
    }
}

// With musl the same bodies tore: 0.74 of the force, and nothing in cells half as large.
TEST_CASE("rubber that is pulled to 1.5 of its length holds the force of its law, with defaults") {
  Simulation simulation(model_by_default<2>(R"({
      "mesh": {"structured": {"cell_size": 0.25, "extent": [1, 7]},
        "boundary_conditions": {"velocity_constraints": [
          {"nset": "floor", "dir": "y", "velocity": 0}, {"nset": "sides", "dir": "x", "velocity": 0}],
          "particles_velocity_constraints": [
            {"pset": "top", "dir": "y", "velocity": 1, "math_function_id": "ramp"}]}},
      "sets": {"nodes": {
        "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
        "sides": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                            {"half_space": {"point": [1, 0], "normal": [-1, 0]}}]}},
        "particles": {"top": {"box": {"min": [0, 3.75], "max": [1, 4]}}}},
      "math_functions": [{"name": "ramp", "type": "Linear", "xvalues": [0, 0.4, 9],
                          "fxvalues": [0, 1, 1]}],
      "materials": [{"type": "NeoHookean", "density": 1000, "youngs_modulus": 1e6,
                     "poisson_ratio": 0.3}],
      "particles": [{"generator": {"type": "region", "material": 0,
                     "region": {"box": {"min": [0, 0], "max": [1, 4]}}}}],
      "analysis": {"end_time": 2}})"));
  simulation.run();
  const HistoryRow end = simulation.history();
  CHECK(end.kinetic < 0.01 * end.internal);
  CHECK(std::abs(end.balance) < 0.05 * end.external);
}

// Affine velocities made nine tenths of it within half a second.
TEST_CASE("elastic bodies make no energy by default, with all functions") {
  for (const char* functions : {"quadratic_spline", "gimp", "uniform_gimp", "cpdi", "cpdi2"}) {
    CAPTURE(functions);
    Simulation simulation(model_by_default<2>(fmt::format(
        R"({{
        "mesh": {{"structured": {{"cell_size": 0.05, "extent": [1.4, 0.6]}}}},
        "materials": [{{"name": "m", "type": "LinearElastic", "density": 1000,
          "youngs_modulus": 1e6, "poisson_ratio": 0.3}}],
        "particles": [
          {{"generator": {{"type": "region", "material": "m", "per_cell": 2, "velocity": [0.05, 0],
            "region": {{"box": {{"min": [0.2, 0.2], "max": [0.7, 0.4]}}}}}}}},
          {{"generator": {{"type": "region", "material": "m", "per_cell": 2, "velocity": [-0.05, 0],
            "region": {{"box": {{"min": [0.7, 0.2], "max": [1.2, 0.4]}}}}}}}}],
        "analysis": {{"shape_functions": "{}", "end_time": 0.9}}}})",
        functions)));
    const double before = simulation.history().kinetic;
    simulation.run();
    const bool affine = std::string(functions) == "quadratic_spline";
    CHECK(simulation.history().balance < 0.01 * before);
    CHECK(simulation.history().balance > (affine ? -0.05 : -0.25) * before);  // FLIP, with usl
  }
}
