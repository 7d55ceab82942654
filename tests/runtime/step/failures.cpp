// Runs that fail say what, where and when, the same however they are executed.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <utility>

#include "physics/base/error.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Particles in the given box of a mesh of 4 x 4 m with 1 m cells, one per cell, moving.
Model<2> moving(const std::string& min, const std::string& max, const std::string& velocity) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 1, "extent": [4, 4]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 100,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                                 "velocity": )" +
                          velocity + R"(,
                                 "region": {"box": {"min": )" +
                          min + R"(, "max": )" + max + R"(}}}}],
    "analysis": {"dt": 0.125, "nsteps": 40, "patch_particles": 1},
    "post_processing": {"output_steps": 1, "history_steps": 1}})");
}

std::vector<ExecutionOptions> every_way() {
  auto ways = other_ways();
  ways.push_back(serial());
  return ways;
}

}  // namespace

TEST_CASE("a particle that leaves the mesh is named with step, time, patch and position") {
  Model<2> model = moving("[2, 1]", "[3, 2]", "[1, 0]");
  model.analysis.patch_particles = 100;
  // x = 2.5 + 0.125 n is beyond 4 after the 13th step, the one after 12 steps.
  CHECK(run(model, serial()).error ==
        "step 12 (t = 1.5 s), rank 0, patch 0, stage locate: particle 0 at (4.125, 1.5) m, "
        "velocity (1, 0) m/s left the mesh. Enlarge the mesh, constrain its boundary nodes, or let "
        "such particles be removed with \"locate_particles\": false in \"analysis\".");
}

TEST_CASE("the message of a failure does not depend on how the run is executed") {
  // Four particles in a row of patches leave together, others of other patches later.
  const Model<2> model = moving("[1, 0]", "[3, 4]", "[1, 0]");
  const Outcome reference = run(model, serial());
  CHECK(reference.error.find("step 12 (t = 1.5 s), rank 0, patch ") == 0);
  CHECK(reference.error.find(" left the mesh.") != std::string::npos);
  CHECK(reference.error.find(" (3 more patches failed in this step)") != std::string::npos);
  for (const ExecutionOptions& way : every_way()) {
    CAPTURE(describe(way));
    CHECK(run(model, way).error == reference.error);
  }
}

TEST_CASE("everything up to the step that failed is reported, however the run is executed") {
  // One particle leaves early, far from the others, whose patches may be steps behind.
  Model<2> model = moving("[0, 0]", "[1, 1]", "[-1, 0]");
  const Vec<2> away(3.5, 3.5);
  for (int k = 0; k < 3; ++k) {
    model.particles.x.push_back(away - Vec<2>(0, k));
    model.particles.cell.push_back(model.mesh->locate(model.particles.x.back()).cell);
    model.particles.volume.push_back(1);
    model.particles.material.push_back(0);
    model.particles.velocity.push_back({0, 0});
  }
  const Outcome reference = run(model, serial());
  REQUIRE(reference.error.find("step 4 (t = 0.5 s)") == 0);
  // Steps 1 to 4 have a frame and a row each; the last of each is the state after the failure.
  REQUIRE(reference.rows.size() == 5);
  REQUIRE(reference.frames.size() == 5);
  for (Step step = 1; step <= 4; ++step) {
    CHECK(reference.rows[static_cast<std::size_t>(step - 1)].step == step);
    CHECK(reference.frames[static_cast<std::size_t>(step - 1)].step == step);
  }
  std::vector<ExecutionOptions> ways = every_way();
  for (std::uint64_t seed = 10; seed < 30; ++seed) ways.push_back(random_order(seed));
  for (const ExecutionOptions& way : ways) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
}

TEST_CASE("no particle is lost from the last state of a run that failed") {
  Model<2> model = two_discs();
  model.analysis.patch_particles = 16;
  for (auto& v : model.particles.velocity) v *= 2;
  model.watchdog.action = Watchdog::Action::none;  // they are squeezed to nothing first
  model.analysis.nsteps = 1000;
  for (const ExecutionOptions& way : every_way()) {
    CAPTURE(describe(way));
    const Outcome outcome = run(model, way);
    CHECK(outcome.error.find("left the mesh") != std::string::npos);
    const Frame& last = outcome.frames.back();
    CHECK(std::set<Index>(last.id.begin(), last.id.end()).size() ==
          static_cast<std::size_t>(model.particles.size()));
    CHECK(last.size() == model.particles.size());
  }
}

TEST_CASE("no particle is lost where a cell collapses while others change their cells") {
  // The stage that fails comes before particles are located, chunk by chunk of a patch.
  for (const Scheme scheme : {Scheme::usf, Scheme::usl, Scheme::musl})
    for (const Index particles : {100, 100000}) {
      CAPTURE(static_cast<int>(scheme));
      CAPTURE(particles);
      Model<2> model = two_discs();
      model.analysis.scheme = scheme;
      model.analysis.patch_particles = particles;
      // Every row of the discs has particles that leave their cells in the first step...
      for (std::size_t p = 0; p < model.particles.x.size(); ++p) {
        Vec<2>& v = model.particles.velocity[p];
        v *= 1.5;
        model.particles.x[p][0] += v[0] > 0 ? 0.0115 : -0.006;
        model.particles.cell[p] = model.mesh->locate(model.particles.x[p]).cell;
      }
      // ...and two that meet are in the last cells: chunks before theirs have been located.
      for (const double side : {-1.0, 1.0}) {
        model.particles.x.push_back({0.95 + 0.025 * side, 0.975});
        model.particles.cell.push_back(model.mesh->locate(model.particles.x.back()).cell);
        model.particles.volume.push_back(1e-4);
        model.particles.material.push_back(0);
        model.particles.velocity.push_back({-20 * side, 0});
      }
      model.analysis.step.accept_unstable = true;
      const Outcome outcome = run(model, serial());
      CHECK(outcome.error.find("its cell collapses") != std::string::npos);
      CHECK(outcome.error.find("stage stress") != std::string::npos);
      const Frame& last = outcome.frames.back();
      CHECK(last.size() == model.particles.size());
      CHECK(std::set<Index>(last.id.begin(), last.id.end()).size() == last.id.size());
      for (const ExecutionOptions& way : {flow(2), random_order(1)})
        CHECK(run(model, way).error == outcome.error);
    }
}

TEST_CASE("particles that may leave the mesh are removed and counted, the others go on") {
  Model<2> model = moving("[1, 0]", "[3, 4]", "[1, 0]");
  model.analysis.remove_leaving_particles = true;
  const Outcome reference = run(model, serial());
  CHECK(reference.error == "");
  CHECK(reference.removed == 8);
  CHECK(reference.frames.back().size() == 0);
  CHECK(reference.rows.back().particles == 0);
  CHECK(reference.rows.back().mass == 0);
  const auto after = [&](Index step) {
    return *std::find_if(reference.rows.begin(), reference.rows.end(),
                         [&](const HistoryRow& row) { return row.step == step; });
  };
  CHECK(after(12).particles == 8);  // x = 2.5 + 1.5 is the edge itself: still inside
  CHECK(after(13).particles == 4);
  CHECK(after(13).mass == 4000);
  CHECK(after(20).particles == 4);
  CHECK(after(21).particles == 0);
  // Ascending by step, then by id, though particles of several patches leave.
  std::istringstream rows(reference.removed_rows);
  std::vector<std::pair<Index, Index>> listed;
  for (std::string row; std::getline(rows, row);) {
    const Index step = std::stoll(row), id = std::stoll(row.substr(row.find(',') + 1));
    listed.emplace_back(step, id);
    CHECK((step == 13 || step == 21));
  }
  CHECK(listed.size() == 8);
  CHECK(std::is_sorted(listed.begin(), listed.end()));
  CHECK(reference.removed_rows.starts_with("13,"));
  for (const ExecutionOptions& way : every_way()) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
}

TEST_CASE("where few particles may leave the mesh, more end the run") {
  // Four leave in step 13, four in step 21.
  Model<2> model = moving("[1, 0]", "[3, 4]", "[1, 0]");
  model.analysis.remove_leaving_particles = true;
  const Outcome all = run(model, serial());
  model.analysis.most_lost = 8;
  CHECK(same_bits(run(model, serial()), all));
  model.analysis.most_lost = 7;
  const Outcome reference = run(model, serial());
  CHECK(reference.removed == 8);
  CHECK(reference.error.find("more particles have left the mesh than may, 8 and not 7 "
                             "(analysis.lost_share); the last one was particle ") !=
        std::string::npos);
  CHECK(reference.error.find("at (4.125, ") != std::string::npos);
  CHECK(reference.error.find("\"locate_particles\": false") != std::string::npos);
  CHECK(reference.removed_rows == all.removed_rows);
  for (const ExecutionOptions& way : every_way()) {
    CAPTURE(describe(way));
    const Outcome outcome = run(model, way);
    CHECK(outcome.error == reference.error);
    CHECK(outcome.removed_rows == reference.removed_rows);
  }
}

TEST_CASE("where too many particles leave, the run ends in the same step, interrupted or not") {
  // The first four are already too many. Others leave until the run ends.
  Model<2> model = moving("[1, 0]", "[3, 4]", "[1, 0]");
  model.analysis.remove_leaving_particles = true;
  model.analysis.most_lost = 3;
  const Outcome reference = run(model, serial());
  CHECK(reference.rows.back().step == 13 + 4);
  CHECK(reference.error.find("step 17 (") == 0);
  std::vector<ExecutionOptions> ways = every_way();
  ways.push_back(serial());
  for (const ExecutionOptions& way : ways) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
    for (const Index pieces : {1, 2, 3, 5}) {
      CAPTURE(pieces);
      Simulation simulation(model, way);
      std::string error;
      try {
        while (!simulation.finished()) simulation.advance(pieces);
      } catch (const SimulationError& thrown) {
        error = thrown.what();
      }
      CHECK(error == reference.error);
      CHECK(simulation.step() == 17);
    }
  }
}

TEST_CASE("the first particle that leaves where few may is told of, the others are counted") {
  Model<2> model = moving("[1, 0]", "[3, 4]", "[1, 0]");
  model.analysis.remove_leaving_particles = true;
  model.analysis.most_lost = 8;
  std::vector<std::string> told;
  Observer observer;
  observer.warning = [&](const std::string& text) { told.push_back(text); };
  Simulation simulation(std::move(model), serial(), Observer(observer));
  simulation.run();
  REQUIRE(told.size() == 1);
  CHECK(told[0].find("left the mesh in step 13 and was removed. The run ends when more than 8 have "
                     "left it (analysis.lost_share).") != std::string::npos);
  CHECK(simulation.info().removed == 8);
}

TEST_CASE("a computation that blows up is reported, not continued") {
  Model<2> model = two_discs();
  model.analysis.step.accept_unstable = true;
  model.materials[0].law = LinearElastic{.youngs_modulus = 1e308, .poisson_ratio = 0.49};
  const Outcome reference = run(model, serial());
  CHECK(reference.error.find(" is not finite: the computation has become unstable. Reduce the time "
                             "step or check material parameters and loads.") != std::string::npos);
  CHECK(reference.error.find("stage locate: particle ") != std::string::npos);
  for (const ExecutionOptions& way : every_way()) CHECK(run(model, way).error == reference.error);
}

TEST_CASE("a cell that would collapse within one step is reported") {
  // Two particles that meet: the strain increment of the cell between them is below -1.
  Model<2> model = moving("[1, 1]", "[3, 2]", "[0, 0]");
  model.particles.velocity = {{6, 0}, {-6, 0}};
  model.analysis.step.accept_unstable = true;
  model.analysis.step.dt = 0.5;
  const std::string error = run(model, serial()).error;
  CHECK(error.find("would get a volume of zero or less within one step: its cell collapses.") !=
        std::string::npos);
  CHECK(error.find("step 0 (t = 0 s), rank 0, patch ") == 0);
  CHECK(error.find("stage stress: particle 0 at (1.5, 1.5) m") != std::string::npos);
  CHECK(error.find("\"mpm_scheme\": \"musl\"") != std::string::npos);
  model.analysis.scheme = Scheme::musl;  // which is not advised then
  const std::string with_musl = run(model, serial()).error;
  CHECK(with_musl.find("its cell collapses. Reduce the time step.") != std::string::npos);
  CHECK(with_musl.find("musl") == std::string::npos);
}

TEST_CASE("a fixed step above the limit is refused with the particle that sets it") {
  Model<2> model = moving("[1, 1]", "[3, 2]", "[3, 4]");
  // c = sqrt(100 / 1000) m/s, |v| = 5 m/s: h / (c + |v|) = 0.188103 s.
  model.analysis.step.dt = 0.25;
  std::string message, hint, where;
  try {
    Simulation simulation(model, serial());
  } catch (const InputError& error) {
    REQUIRE(error.problems().size() == 1);
    message = error.problems()[0].message;
    hint = error.problems()[0].hint;
    where = error.problems()[0].where;
  }
  CHECK(message ==
        "the time step 0.25 s is above the stability limit 0.188103 s of particle 0 at (1.5, 1.5) "
        "m, velocity (3, 4) m/s.");
  CHECK(
      hint ==
      "Use a step below 0.188 s, an adaptive one (\"time_step\": {\"adaptive\": true}), or accept "
      "it with \"time_step\": {\"accept_unstable\": true}.");
  CHECK(where == "/analysis/dt");
  model.analysis.step.accept_unstable = true;
  model.analysis.nsteps = 1;
  CHECK(run(model, serial()).error == "");
}

TEST_CASE("a fixed step that the limit falls below during the run is reported") {
  Model<2> model = moving("[1, 3]", "[3, 4]", "[0, 0]");
  model.gravity = {0, -100};
  model.analysis.patch_particles = 100;
  model.analysis.step.dt = 0.05;
  const Outcome reference = run(model, serial());
  CHECK(reference.error.find("stage output: the time step 0.05 s is above the stability limit ") !=
        std::string::npos);
  // |v| = 5 n exceeds 1 / 0.05 - c = 19.7 m/s in the fourth step, the one after three.
  CHECK(reference.error.find("step 3 (t = 0.15 s)") == 0);
  for (const ExecutionOptions& way : every_way()) CHECK(run(model, way).error == reference.error);
}

TEST_CASE("what the receiver of frames or rows throws comes out of run()") {
  for (const ExecutionOptions& way : every_way()) {
    CAPTURE(describe(way));
    Observer frames;
    frames.frame = [](FramePieces&& frame) {
      if (frame.header.step == 20) throw IoError("no space left");
    };
    Simulation writing(two_discs(), way, frames);
    CHECK_THROWS_WITH_AS(writing.run(), "no space left", IoError);
    Observer rows;
    rows.history = [](const HistoryRow& row) {
      if (row.step == 16) throw IoError("no space left for rows");
    };
    Simulation noting(two_discs(), way, rows);
    CHECK_THROWS_WITH_AS(noting.run(), "no space left for rows", IoError);
  }
}
