// Patches exist where particles are: they are created ahead of a body and dropped behind it.
#include <doctest/doctest.h>

#include <cmath>
#include <set>

#include "graph/executor.h"
#include "runtime/patches/patch_set.h"
#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A block of 5 x 4 cells with a spin, far from the edges of a mesh of 1 m cells whose first node
/// is at (origin, origin).
Model<2> flying_block(Index counts, double origin, Vec<2> velocity) {
  Model<2> model =
      model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 1, "origin": [)" +
                       std::to_string(origin) + "," + std::to_string(origin) + R"(], "counts": [)" +
                       std::to_string(counts) + "," + std::to_string(counts) + R"(]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.25}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [1000, 1000], "max": [1005, 1004]}}}}],
    "analysis": {"dt": 0.02, "nsteps": 300, "patch_particles": 36},
    "post_processing": {"output_steps": 100, "history_steps": 50}})");
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.push_back(velocity + Vec<2>(1002 - x[1], x[0] - 1002.5) * 0.2);
  return model;
}

double furthest_difference(const Frame& a, const Frame& b) {
  double worst = 0;
  for (std::size_t k = 0; k < a.coordinates.size(); ++k)
    worst = std::max(worst, std::abs(a.coordinates[k] - b.coordinates[k]));
  for (const char* name : {"velocity", "strain"}) {
    const auto &u = a.find(name)->values, &v = b.find(name)->values;
    for (std::size_t k = 0; k < u.size(); ++k) worst = std::max(worst, std::abs(u[k] - v[k]));
  }
  return worst;
}

}  // namespace

TEST_CASE(
    "a block that flies over 16 million cells needs a handful of patches, and its bits do "
    "not depend on who runs them") {
  const Model<2> model = flying_block(4000, 0, {18, 11});
  Simulation simulation(model, serial());
  const std::size_t bytes_at_start = simulation.info().bytes;
  const Partition<2> partition(*model.mesh, simulation.info().cells_per_patch);
  REQUIRE(partition.n_patches() > 100000);
  int most = 0;
  std::size_t most_bytes = 0;
  while (!simulation.finished()) {
    simulation.advance(10);
    most = std::max(most, simulation.info().patches);
    most_bytes = std::max(most_bytes, simulation.info().bytes);
  }
  CHECK(most < 80);
  CHECK(most_bytes < 3 * bytes_at_start);
  CHECK(simulation.info().particles == model.particles.size());
  const Frame end = simulation.frame();
  CHECK(crossings(model, end) == end.size());
  CHECK(end.coordinates[0] > 1100);

  const Outcome reference = run(model, serial());
  CHECK(same_bits(reference.frames.back(), end));
  for (const ExecutionOptions& way :
       {flow(1), flow(2), flow(8), random_order(1), random_order(2)}) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
}

TEST_CASE("a flying block does the same on a small mesh that is one patch") {
  const Outcome many = run(flying_block(4000, 0, {18, 11}), flow(2));
  Model<2> small = flying_block(160, 980, {18, 11});
  small.analysis.patch_particles = 1 << 20;
  CHECK(Simulation(small, serial()).info().patches == 1);
  const Outcome one = run(small, serial());
  REQUIRE(one.error == "");
  REQUIRE(many.frames.size() == one.frames.size());
  for (std::size_t k = 0; k < one.frames.size(); ++k)
    // Positions near 1000 m carry roundings of 1e-13 m per step.
    CHECK(furthest_difference(many.frames[k], one.frames[k]) < 1e-9);
  for (std::size_t k = 0; k < one.rows.size(); ++k) {
    CHECK(many.rows[k].kinetic == doctest::Approx(one.rows[k].kinetic).epsilon(1e-11));
    CHECK(many.rows[k].internal == within(1e-6, one.rows[k].internal));
    CHECK(many.rows[k].mass == one.rows[k].mass);
  }
}

TEST_CASE("particles that cross nearly a cell per step never outrun narrow patches") {
  // One cell per patch: the surroundings have to be there max_lead steps ahead.
  for (const Index particles : {4, 16, 36}) {
    Model<2> model = flying_block(1000, 500, {36, -40});
    model.analysis.step.dt = 0.0175;
    model.materials[0].law = LinearElastic{.youngs_modulus = 100, .poisson_ratio = 0.2};
    model.analysis.patch_particles = particles;
    model.analysis.nsteps = 100;
    CAPTURE(particles);
    const Outcome reference = run(model, serial());
    REQUIRE(reference.error == "");
    CHECK(reference.frames.back().size() == model.particles.size());
    for (const ExecutionOptions& way : {flow(3), random_order(1)}) {
      CAPTURE(describe(way));
      CHECK(same_bits(run(model, way), reference));
    }
  }
}

TEST_CASE("a patch exists if particles may be in it before patches are rebuilt, and else not") {
  for (const Index at : {1000, 1003, 1006, 1011}) {
    CAPTURE(at);
    Model<2> model = flying_block(4000, 1.0 * static_cast<double>(1000 - at), {0, 0});
    model.analysis.patch_particles = 900;
    const ParticleTable<2> particles = model.particles;
    const PatchSet<2> patches(model, 0, {{1, 0, 0}});
    const Partition<2>& partition = patches.partition();
    std::set<Index> existing, near;
    for (int i = 0; i < patches.size(); ++i) existing.insert(patches[i].topology.patch);
    // A particle changes its cell in the step in which that is noticed, and in max_lead more.
    const Index reach = max_lead + 1;
    for (const Index cell : particles.cell)
      for (Index dy = -reach; dy <= reach; ++dy)
        for (Index dx = -reach; dx <= reach; ++dx)
          near.insert(partition.patch_of(cell + dx + 4000 * dy));
    CHECK(existing == near);
    for (int i = 0; i < patches.size(); ++i) {
      const auto& cells = patches[i].topology.cells;
      for (std::size_t c = 0; c < cells.size(); ++c) {
        bool missing = false;
        for (Index dy = -reach; dy <= reach; ++dy)
          for (Index dx = -reach; dx <= reach; ++dx)
            missing = missing || !existing.contains(partition.patch_of(cells[c] + dx + 4000 * dy));
        CHECK(missing == (!patches[i].halo_edge_cells.empty() && patches[i].halo_edge_cells[c]));
      }
    }
  }
}

TEST_CASE("work is not lost when patches are dropped") {
  // The energy balance of a block that has left all of its first patches behind.
  const Model<2> model = flying_block(4000, 0, {18, 11});
  Simulation simulation(model, flow(2));
  simulation.run();
  const HistoryRow row = simulation.history();
  CHECK(row.internal > 0);
  CHECK(std::abs(row.balance) < 1e-3 * (row.kinetic + row.internal));
  CHECK(row.mass == doctest::Approx(20 * 1000).epsilon(1e-14));
}

TEST_CASE("hexahedra fly too, with a wider layer of shared nodes as well") {
  Model<3> model = model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": 0.5, "counts": [120, 120, 124]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                   "poisson_ratio": 0.25}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "velocity": [15, 7, -9],
                                 "region": {"box": {"min": [40, 50, 60], "max": [41.5, 51, 61]}}}}],
    "analysis": {"dt": 0.02, "nsteps": 55, "patch_particles": 64}})");
  const Outcome reference = run(model, serial());
  REQUIRE(reference.error == "");
  CHECK(crossings(model, reference.frames.back()) == model.particles.size());
  for (ExecutionOptions way : {flow(2), random_order(1)})
    for (const int rings : {0, 1}) {
      way.support_rings = rings;
      CAPTURE(describe(way));
      CAPTURE(rings);
      CHECK(same_bits(run(model, way), reference));
    }
}
