// What a simulation conserves, and what its history says about it.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// A block that vibrates freely: stretched along x, compressed along y at start.
Model<2> vibrating_block() {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [4, 4]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.3}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [1, 1], "max": [3, 3]}}}}],
    "analysis": {"dt": 5e-4, "nsteps": 400, "patch_particles": 64}})");
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.push_back(Vec<2>(x[0] - 2, 2 - x[1]) * 0.05);
  return model;
}

double total_mass(const Frame& frame) {
  double mass = 0;
  for (const double m : frame.find("mass")->values) mass += m;
  return mass;
}

/// Sums before and after a run.
struct Ends {
  HistoryRow start, end;
};

Ends run_through(const Model<2>& model) {
  Simulation simulation(model, flow(2));
  const HistoryRow start = simulation.history();
  simulation.run();
  return {start, simulation.history()};
}

/// `tolerance` as a share of the mass at the largest speed.
void check_momentum(const Ends& ends, double tolerance) {
  const double scale = ends.end.mass * ends.end.max_speed;
  for (std::size_t d = 0; d < 2; ++d)
    CHECK(std::abs(ends.end.momentum[d] - ends.start.momentum[d]) < tolerance * scale);
}

}  // namespace

TEST_CASE("every particle keeps its mass to the last bit") {
  for (const Scheme scheme : schemes) {
    Model<2> model = two_discs();
    model.analysis.scheme = scheme;
    model.analysis.nsteps = 35;
    Simulation simulation(model, flow(2));
    const Frame start = simulation.frame();
    simulation.run();
    const Frame end = simulation.frame();
    CHECK(same_bits(start.find("mass")->values, end.find("mass")->values));
    CHECK(simulation.history().mass == doctest::Approx(total_mass(start)).epsilon(1e-13));
  }
}

TEST_CASE("a collision keeps the momentum of all particles to rounding") {
  for (const Scheme scheme : schemes)
    for (const double flip : {1.0, 0.0}) {
      Model<2> model = two_discs();
      model.analysis.scheme = scheme;
      model.analysis.transfer.flip = flip;
      model.analysis.nsteps = 35;
      check_momentum(run_through(model), 1e-13);
    }
}

TEST_CASE("filters of the velocity transfer keep momentum to rounding, and the speed of a block") {
  for (const Scheme scheme : schemes)
    for (const int order : {1, 2, 3}) {
      Model<2> model = two_discs();
      model.analysis.scheme = scheme;
      model.analysis.transfer = {
          .rates = {50.0, 5.0}, .order = order, .filters_change = order == 2};
      if (order > 1) model.analysis.transfer.viscous = 20.0;
      if (order == 3) with_viscosity_of_pressure(model);
      model.analysis.nsteps = 35;
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(order);
      check_momentum(run_through(model), 1e-13);
      check_momentum(run_through(in_contact(model)), 1e-13);

      Model<2> block = vibrating_block();
      block.analysis.scheme = scheme;
      block.analysis.transfer = {.rates = {500.0}, .order = order};
      if (order > 1) block.analysis.transfer.viscous = 300.0;
      if (order == 3) with_viscosity_of_pressure(block);
      for (Vec<2>& v : block.particles.velocity) v = {0.5, -0.3};
      block.analysis.nsteps = 100;
      const auto [start, end] = run_through(block);
      CHECK(end.kinetic == doctest::Approx(start.kinetic).epsilon(1e-12));
      CHECK(std::abs(end.damping) < 1e-12 * start.kinetic);
    }
}

TEST_CASE("contact keeps the momentum of all particles to rounding, of two bodies and of more") {
  for (const Scheme scheme : schemes)
    for (const double flip : {1.0, 0.0})
      for (const int bodies : {2, 3}) {
        Model<2> model = two_discs();
        if (bodies == 3) {
          model.materials.push_back(model.materials[1]);
          for (std::size_t p = 0; p < model.particles.x.size(); ++p)
            if (model.particles.x[p][0] > 0.7) model.particles.material[p] = 2;
        }
        model = in_contact(model);
        model.analysis.scheme = scheme;
        model.analysis.transfer.flip = flip;
        model.analysis.nsteps = 35;
        CAPTURE(static_cast<int>(scheme));
        CAPTURE(flip);
        CAPTURE(bodies);
        const auto [start, end] = run_through(model);
        check_momentum({start, end}, 1e-13);
        CHECK(end.damping > 0);  // what contact takes
        CHECK(std::abs(end.kinetic - start.kinetic) > 0.01 * start.kinetic);
      }
}

TEST_CASE("a collision keeps the momentum with GIMP, CPDI, splines and affine velocities") {
  const auto check = [](ShapeFunctions functions, Affine affine) {
    for (const Scheme scheme : schemes) {
      Model<2> model = with_functions(two_discs(), functions, affine);
      model.analysis.scheme = scheme;
      model.analysis.nsteps = 35;
      CAPTURE(static_cast<int>(functions));
      CAPTURE(static_cast<int>(affine));
      check_momentum(run_through(model), 1e-12);
    }
  };
  for (const Affine affine : {Affine::none, Affine::apic, Affine::tpic})
    for (const ShapeFunctions functions :
         {ShapeFunctions::gimp, ShapeFunctions::uniform_gimp, ShapeFunctions::cpdi,
          ShapeFunctions::cpdi2, ShapeFunctions::quadratic_spline, ShapeFunctions::cubic_spline})
      check(functions, affine);
  check(ShapeFunctions::element, Affine::apic);
}

TEST_CASE("a collision keeps the momentum where particles come apart (ASFLIP)") {
  for (const Scheme scheme : schemes)
    for (const ShapeFunctions functions :
         {ShapeFunctions::element, ShapeFunctions::gimp, ShapeFunctions::cpdi,
          ShapeFunctions::quadratic_spline, ShapeFunctions::cubic_spline}) {
      Model<2> model = separable(two_discs(), functions);
      model.analysis.scheme = scheme;
      model.analysis.nsteps = 35;
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(static_cast<int>(functions));
      check_momentum(run_through(model), 1e-12);
      if (functions == ShapeFunctions::quadratic_spline)
        check_momentum(run_through(in_contact(model)), 1e-12);
    }
}

TEST_CASE("under gravity all functions let bodies fall freely") {
  for (const ShapeFunctions functions :
       {ShapeFunctions::gimp, ShapeFunctions::cpdi, ShapeFunctions::cpdi2,
        ShapeFunctions::quadratic_spline, ShapeFunctions::cubic_spline})
    for (const Affine affine : {Affine::none, Affine::apic}) {
      Model<2> model = with_functions(two_discs(), functions, affine);
      if (affine == Affine::apic && functions != ShapeFunctions::cpdi2)
        model = separable(model, functions);  // what nodes do not have is nothing here
      model.particles.velocity.assign(static_cast<std::size_t>(model.particles.size()), {0.2, 0.1});
      model.gravity = {0.0, -0.5};
      Simulation simulation(model, flow(2));
      const Frame start = simulation.frame();
      simulation.run();
      const Frame end = simulation.frame();
      // The mean of velocities before and after each step would give t^2 / 2; the scheme moves
      // with those after it.
      const double t = end.time, fall = 0.1 * t - 0.5 * t * (t + model.analysis.step.dt) / 2;
      CAPTURE(static_cast<int>(functions));
      double worst = 0;
      for (std::size_t k = 0; k < end.coordinates.size(); k += 2) {
        worst = std::max(worst, std::abs(end.coordinates[k] - start.coordinates[k] - 0.2 * t));
        worst = std::max(worst, std::abs(end.coordinates[k + 1] - start.coordinates[k + 1] - fall));
      }
      CHECK(worst < 1e-11);
    }
}

TEST_CASE("under gravity the momentum grows by m g t, whatever the bodies do to each other") {
  for (const Scheme scheme : schemes) {
    Model<2> model = two_discs();
    model.analysis.scheme = scheme;
    model.analysis.nsteps = 35;
    model.gravity = {0.3, -2.0};
    Simulation simulation(model, flow(2));
    const HistoryRow start = simulation.history();
    simulation.run();
    const HistoryRow end = simulation.history();
    for (int d = 0; d < 2; ++d)
      CHECK(std::abs(end.momentum[d] - start.momentum[d] - end.mass * model.gravity[d] * end.time) <
            1e-12 * end.mass * 2.0 * end.time);
  }
}

TEST_CASE("gravity's work in free fall is the kinetic energy, and m g h but for the time steps") {
  for (const Scheme scheme : schemes) {
    Model<2> model = vibrating_block();
    model.particles.velocity.clear();
    model.analysis.scheme = scheme;
    model.gravity = {0, -9.81};
    model.output.history_steps = 25;
    Simulation simulation(model, flow(2));
    const Frame start = simulation.frame();
    simulation.advance(400);
    const Frame end = simulation.frame();
    const HistoryRow row = simulation.history();
    const double mass = 4000, g = 9.81, dt = 5e-4, n = 400;
    const double fall = start.coordinates[1] - end.coordinates[1];
    CHECK(row.external == doctest::Approx(row.kinetic).epsilon(1e-12));
    CHECK(row.kinetic == doctest::Approx(0.5 * mass * std::pow(g * n * dt, 2)).epsilon(1e-12));
    // x follows the velocity at the end of each step: it falls by g dt^2 n / 2 more than g t^2 / 2.
    CHECK(mass * g * fall ==
          doctest::Approx(row.external + mass * g * g * dt * dt * n / 2).epsilon(1e-9));
    CHECK(std::abs(row.balance) < 1e-12 * row.kinetic);
    CHECK(row.damping == 0.0);
    CHECK(std::abs(row.internal) < 1e-9 * row.kinetic);
  }
}

TEST_CASE("the energy of a vibrating block stays, the better the shorter the step") {
  for (const Scheme scheme : {Scheme::usf, Scheme::usl}) {
    CAPTURE(static_cast<int>(scheme));
    double drift[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
      Model<2> model = vibrating_block();
      model.analysis.scheme = scheme;
      if (k == 1) model.analysis.step.dt /= 4, model.analysis.nsteps *= 4;
      model.output.history_steps = k == 0 ? 4 : 16;
      const Outcome outcome = run(model, flow(2));
      REQUIRE(outcome.error == "");
      const double energy = outcome.rows.front().kinetic + outcome.rows.front().internal;
      double exchanged = 0;
      for (const HistoryRow& row : outcome.rows) {
        drift[k] = std::max(drift[k], std::abs(row.balance) / energy);
        exchanged = std::max(exchanged, row.internal / energy);
        CHECK(row.balance ==
              doctest::Approx(row.kinetic + row.internal + row.damping - row.external -
                              outcome.rows.front().kinetic - outcome.rows.front().internal +
                              outcome.rows.front().balance)
                  .epsilon(1e-9)
                  .scale(energy));
      }
      CHECK(exchanged > 0.5);  // it does vibrate
    }
    CHECK(drift[0] < 0.03);
    CHECK(drift[1] < 0.4 * drift[0]);
  }
}

TEST_CASE("the work of the stresses is the strain energy of what is elastic") {
  Model<2> model = vibrating_block();
  model.analysis.step.dt /= 8;
  const Outcome outcome = run(model, serial());
  const Frame& end = outcome.frames.back();
  const auto &stress = end.find("stress")->values, &strain = end.find("strain")->values;
  const auto& volume = end.find("volume")->values;
  double energy = 0;
  for (std::size_t p = 0; p < volume.size(); ++p)
    for (std::size_t k = 0; k < 6; ++k)
      energy += 0.5 * volume[p] * stress[6 * p + k] * strain[6 * p + k];
  REQUIRE(energy > 0);
  // Strains are small (1e-3): volumes change by as much.
  CHECK(outcome.rows.back().internal == within(0.02, energy));
}

TEST_CASE("damping takes kinetic energy, and history says how much") {
  Model<2> model = vibrating_block();
  model.analysis.damping = 0.05;
  model.analysis.step.dt /= 4;
  model.analysis.nsteps *= 4;
  const Outcome outcome = run(model, flow(2));
  const HistoryRow& end = outcome.rows.back();
  const double start = end.kinetic + end.internal + end.damping - end.external - end.balance;
  CHECK(end.kinetic + end.internal < 0.8 * start);
  CHECK(end.damping > 0.2 * start);
  CHECK(std::abs(end.balance) < 0.02 * start);
}

TEST_CASE("the work of tractions and prescribed velocities is part of the balance") {
  // A block is pulled at its right side by a traction and held at its left by nodes.
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [4, 1]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "left", "dir": "x", "velocity": 0},
               {"nset": "rows", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {"left": {"half_space": {"point": [0, 0], "normal": [1, 0]}},
                       "rows": {"all": true}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [2, 1]}}}}],
    "analysis": {"dt": 1e-4, "nsteps": 600, "patch_particles": 32},
    "post_processing": {"history_steps": 50}})");
  ParticleTraction pull{.particles = {}, .dir = 0, .traction = 100, .function = -1};
  for (Index p = 0; p < model.particles.size(); ++p)
    if (model.particles.x[static_cast<std::size_t>(p)][0] > 1.9) pull.particles.push_back(p);
  REQUIRE(pull.particles.size() == 8);
  model.tractions = {pull};
  const Outcome outcome = run(model, flow(2));
  const HistoryRow& end = outcome.rows.back();
  // The force on a particle is traction times volume over size; all of them pull with 100 N.
  const auto& u = outcome.frames.back().find("displacement")->values;
  double work = 0;
  for (const Index p : pull.particles) work += 100.0 / 8 * u[static_cast<std::size_t>(2 * p)];
  CHECK(work > 0);
  CHECK(end.external == within(2e-3, work));
  CHECK(std::abs(end.balance) < 0.02 * (end.kinetic + end.internal));
}

TEST_CASE("the energy of a neo-Hookean collision is accounted for, whatever fills the last pack") {
  Model<2> model = two_discs();
  for (Material& material : model.materials)
    material.law = NeoHookean{.youngs_modulus = 2000, .poisson_ratio = 0.3};
  model.analysis.nsteps = 35;
  const auto [start, end] = run_through(model);
  CHECK(end.internal > 0.01 * start.kinetic);
  CHECK(std::abs(end.balance) < 0.05 * start.kinetic);
}
