// Laws whose increments are done in parts, which is counted, or cannot be done, which ends the run.
#include <doctest/doctest.h>

#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Four particles in the middle cell of nine that move so that the next increment of the cell is
/// `strain`, symmetric, all of it in one step.
Model<2> one_cell(const std::string& material, const Eigen::Matrix2d& strain, double mean_stress) {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 1, "extent": [3, 3]},
             "particles_stresses": {"type": "isotropic", "values": [)" +
                                    std::to_string(mean_stress) + R"(]}},
    "materials": [{"name": "stuff", )" +
                                    material + R"(}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "stuff",
                                 "region": {"box": {"min": [1, 1], "max": [2, 2]}}}}],
    "analysis": {"dt": 1e-4, "nsteps": 1, "time_step": {"accept_unstable": true}},
    "post_processing": {"output_steps": 1, "history_steps": 1}})");
  model.particles.velocity.resize(model.particles.x.size());
  // Nodal velocities of the four have a quarter of their gradient.
  for (std::size_t p = 0; p < model.particles.x.size(); ++p)
    model.particles.velocity[p] =
        4 / model.analysis.step.dt * strain * (model.particles.x[p] - Vec<2>(1.5, 1.5));
  return model;
}

const char* const sand =
    R"("type": "NorSand", "density": 1800, "poisson_ratio": 0.3, "reference_pressure": 1000,
       "friction_cs": 30, "N": 0.3, "lambda": 0.1, "kappa": 0.03, "gamma": 1.3, "chi": 3.5,
       "hardening_modulus": 200, "void_ratio_initial": 0.85, "p_image_initial": 87014.6)";

}  // namespace

TEST_CASE("a law without a stress ends the run and names particle, material and stress") {
  // Symmetric, so that nothing turns, of no volume change at first order, and inside out.
  const Eigen::Matrix2d inside_out = (Eigen::Matrix2d() << 0, 1.5, 1.5, 0).finished();
  const Model<2> model = one_cell(
      R"("type": "NeoHookean", "density": 1000, "youngs_modulus": 1e5, "poisson_ratio": 0.2)",
      inside_out, 0);
  const Outcome reference = run(model, serial());
  CHECK(reference.error ==
        "step 0 (t = 0 s), rank 0, patch 0, stage stress: particle 0 at (1.25, 1.25) m, velocity "
        "(-15000, -15000) m/s (and 3 more here): material 'stuff' found no stress that it allows "
        "after stress (0, 0, 0, 0, 0, 0) Pa (xx yy zz xy yz xz), not even in 1024 parts of the "
        "increment. Check its parameters, or reduce the time step.");
  for (const ExecutionOptions& way : other_ways()) CHECK(run(model, way).error == reference.error);
}

TEST_CASE("in sheets the message says that no stress may act across them") {
  const Eigen::Matrix2d inside_out = (Eigen::Matrix2d() << 0, 1.5, 1.5, 0).finished();
  Model<2> model = one_cell(
      R"("type": "NeoHookean", "density": 1000, "youngs_modulus": 1e5, "poisson_ratio": 0.2)",
      inside_out, 0);
  model.analysis.plane = Plane::stress;
  CHECK(run(model, serial()).error ==
        "step 0 (t = 0 s), rank 0, patch 0, stage stress: particle 0 at (1.25, 1.25) m, velocity "
        "(-15000, -15000) m/s (and 3 more here): material 'stuff' found no stress that it allows, "
        "or none that is zero across the sheet, after stress (0, 0, 0, 0, 0, 0) Pa (xx yy zz xy yz "
        "xz). Check its parameters, reduce the time step, or use \"plane\": \"strain\" in "
        "\"analysis\".");
}

TEST_CASE("increments that are done in parts are counted, in the history and for the report") {
  const Eigen::Matrix2d squeeze = (Eigen::Matrix2d() << -0.02, 0, 0, 0.01).finished();
  const Model<2> model = one_cell(sand, squeeze, -2e5);
  const Outcome reference = run(model, serial());
  REQUIRE(reference.error == "");
  CHECK(reference.rows.back().divided == 4);
  for (const ExecutionOptions& way : other_ways()) {
    Simulation simulation(model, way);
    simulation.run();
    CHECK(simulation.info().divided == 4);
    CHECK(same_bits(run(model, way), reference));
  }
  // Small ones are done as a whole.
  CHECK(run(one_cell(sand, 1e-4 * squeeze, -2e5), serial()).rows.back().divided == 0);
}
