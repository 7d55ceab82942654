// The account of energy with every transfer of velocities: what goes is found somewhere.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

/// Affine velocities beside what FLIP keeps: 0.10 without relaxation, 0.08 with that of asflip, and
/// 0.7 of it with half the step.
bool keeps_affine(const Transfer& transfer) {
  return transfer.name == "asflip" ||
         (transfer.name == "apic" && transfer.settings.ends_with(": 0"));
}

/// Largest balance over the run, as a share of the largest kinetic energy.
double worst_balance(Model<2> model) {
  double balance = 0, kinetic = 0;
  model.output.history_steps = 5;
  Observer observer;
  observer.history = [&](const HistoryRow& row) {
    balance = std::max(balance, std::abs(row.balance));
    kinetic = std::max(kinetic, row.kinetic);
  };
  Simulation<2> simulation(std::move(model), {}, observer);
  simulation.run();
  return balance / kinetic;
}

}  // namespace

// What stays is the work of forces at velocities of nodes against that of stress at filtered ones.
TEST_CASE("the account of blocks that collide closes with every transfer") {
  // Contact was counted twice where transfers are counted at nodes, and the affine part was not:
  // 0.19 with PIC, 0.15 with XPIC, 0.12 with FMPM, 0.14 with APIC that relaxes.
  for (const Transfer& transfer : transfers)
    for (const double dt : {3e-4, 1.5e-4}) {
      const double worst = worst_balance(colliding(transfer, dt));
      CAPTURE(transfer.name);
      CAPTURE(transfer.settings);
      CAPTURE(dt);
      CHECK(worst < (keeps_affine(transfer) ? (dt > 2e-4 ? 0.11 : 0.075)
                     : dt > 2e-4            ? 0.06
                                            : 0.04));
    }
}

// TPIC 0.12 and, with half the step, 0.14 (MUSL), the others at most 0.09.
TEST_CASE("the account of a block that falls on held nodes closes with every transfer") {
  for (const std::string scheme : {"usl", "musl"})
    for (const Transfer& transfer : transfers)
      for (const double dt : {3e-4, 1.5e-4}) {
        const double worst = worst_balance(falling(transfer, scheme, dt));
        CAPTURE(scheme);
        CAPTURE(transfer.name);
        CAPTURE(transfer.settings);
        CAPTURE(dt);
        CHECK(worst < 0.15);
      }
}
