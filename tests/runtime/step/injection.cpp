// Particles that come into the model during the run: when, where, how many, with which ids.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "physics/base/error.h"
#include "runtime/step/injection_log.h"
#include "tests/io/base/team_folder.h"
#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double h = 0.1, dt = 0.01, speed = 1, density = 1000;
constexpr int inlet_cells = 4;
/// The rear Gauss points of a cell have (1 + 1 / sqrt(3)) / 2 of its length before them: at this
/// speed they leave it in the eighth step, and the ninth begins with an empty cell.
constexpr Index steps_to_empty = 8;
/// What has flowed in until then, as a share of the cell.
const double share = 0.5 * (1 + 1 / std::sqrt(3.0));

/// A solid that is pushed out of the left end of a channel at constant speed, without any force:
/// all particles move alike, so nothing strains, and every number is known.
Model<2> free_jet(const std::string& generators, Index nsteps, const std::string& more = "") {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [3, 0.4]}},
    "sets": {"cells": {"inlet": {"box": {"min": [0, 0], "max": [0.1, 0.4]}},
                       "corner": {"box": {"min": [0, 0], "max": [0.1, 0.1]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                   "poisson_ratio": 0.3}],
    "particles": [)" + generators +
                          R"(],
    "analysis": {"dt": 0.01, "nsteps": )" +
                          std::to_string(nsteps) + R"(, "patch_particles": 16)" + more + R"(},
    "post_processing": {"output_steps": 10, "history_steps": 7}})");
}

const std::string inlet =
    R"({"generator": {"type": "inject", "cset": "inlet", "nparticles_per_dir": 2,
                      "velocity": [1, 0], "material": 0}})";

/// The same jet in squares that are cut into two triangles, by one diagonal or the other. It has
/// not left the mesh by 1 s.
Model<2> jet_in_triangles(bool rising, int per_dir) {
  constexpr int nx = 12, ny = 4;
  std::string mesh = fmt::format("{} {}\n", (nx + 1) * (ny + 1), 2 * nx * ny);
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) mesh += fmt::format("{:.17g} {:.17g}\n", i * h, j * h);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const int a = (nx + 1) * j + i, b = a + 1, c = b + nx + 1, d = c - 1;
      mesh += rising ? fmt::format("{} {} {}\n{} {} {}\n", a, b, c, a, c, d)
                     : fmt::format("{} {} {}\n{} {} {}\n", a, b, d, b, c, d);
    }
  const Folder folder;
  folder.write("mesh.txt", mesh);
  const std::string text = fmt::format(R"({{
    "mesh": {{"mesh": "mesh.txt", "cell_type": "ED2T3"}},
    "sets": {{"cells": {{"inlet": {{"box": {{"min": [0, 0], "max": [0.1, 0.4]}}}}}}}},
    "materials": [{{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                   "poisson_ratio": 0.3}}],
    "particles": [{{"generator": {{"type": "inject", "cset": "inlet", "nparticles_per_dir": {},
                                 "velocity": [1, 0], "material": 0}}}}],
    "analysis": {{"dt": 2e-3, "nsteps": 500}}}})",
                                       per_dir);
  return std::get<Model<2>>(read_scenario_text(text, folder.path, plain_defaults(text)).model);
}

/// Gauss point k of a cell whose lower left corner is (0, y0).
Vec<2> gauss_point(double y0, Index k) {
  const double low = 0.5 * h * (1 - 1 / std::sqrt(3.0)), high = h - low;
  return {k == 1 || k == 2 ? high : low, y0 + (k >= 2 ? high : low)};
}

void check_jet(const Frame& frame, Index first_id) {
  const Index per_event = 4 * inlet_cells;
  const Index events = (frame.step + steps_to_empty - 1) / steps_to_empty;
  REQUIRE(frame.size() == first_id + events * per_event);
  for (Index i = 0; i < frame.size(); ++i) {
    CHECK(frame.id[static_cast<std::size_t>(i)] == i);  // frames are in ascending order
    if (i < first_id) continue;
    const Index event = (i - first_id) / per_event, cell = (i - first_id) % per_event / 4;
    const Vec<2> start = gauss_point(h * static_cast<double>(cell), (i - first_id) % 4);
    const double moved = speed * dt * static_cast<double>(frame.step - event * steps_to_empty);
    const auto at = static_cast<std::size_t>(i);
    CHECK(frame.coordinates[2 * at] == doctest::Approx(start[0] + moved).epsilon(1e-12));
    CHECK(frame.coordinates[2 * at + 1] == doctest::Approx(start[1]).epsilon(1e-12));
    CHECK(frame.find("velocity")->values[2 * at] == doctest::Approx(speed).epsilon(1e-12));
    CHECK(frame.find("displacement")->values[2 * at] == doctest::Approx(moved).epsilon(1e-12));
    CHECK(frame.find("mass")->values[at] ==
          doctest::Approx(share * density * h * h / 4).epsilon(1e-14));
    CHECK(std::abs(frame.find("stress")->values[6 * at]) < 1e-7);  // of 1e4 Pa
  }
}

}  // namespace

TEST_CASE("a cell is filled again as soon as it is empty: mass, places and ids follow") {
  for (const char* scheme : {"usf", "usl", "musl"}) {
    CAPTURE(scheme);
    const auto model = free_jet(inlet, 60, std::string(", \"mpm_scheme\": \"") + scheme + "\"");
    const Outcome outcome = run(model, serial());
    CHECK(outcome.error == "");
    REQUIRE(outcome.frames.size() == 7);
    for (const Frame& frame : outcome.frames) check_jet(frame, 0);
    for (const HistoryRow& row : outcome.rows) {
      const auto events = static_cast<double>((row.step + steps_to_empty - 1) / steps_to_empty);
      const double mass = events * inlet_cells * share * density * h * h;
      CHECK(row.mass == doctest::Approx(mass).epsilon(1e-13));
      CHECK(row.momentum[0] == doctest::Approx(mass * speed).epsilon(1e-12));
      CHECK(row.external == doctest::Approx(mass * speed * speed / 2).epsilon(1e-12));
      CHECK(std::abs(row.balance) < 1e-10 * row.kinetic);
    }
  }
}

TEST_CASE("what came in is told beside what velocity, area and time say") {
  const auto injected = [](double gravity) {
    constexpr Index steps = 25;
    Model<2> model = free_jet(inlet, steps);
    model.gravity = Vec<2>(gravity, 0);
    Simulation simulation(model, serial());
    simulation.run();
    const auto all = simulation.info().injected;
    REQUIRE(all.size() == 1);
    CHECK(all[0].expected == doctest::Approx(density * speed * inlet_cells * h * steps * dt));
    CHECK(all[0].once == doctest::Approx(share * density * inlet_cells * h * h));
    CHECK(all[0].mass == doctest::Approx(simulation.history().mass));
    return all[0];
  };
  const InjectedMass straight = injected(0), pulled = injected(20);
  CHECK(std::abs(straight.mass - straight.expected) <= straight.once);
  CHECK(pulled.mass > 1.1 * pulled.expected + pulled.once);
}

TEST_CASE("a jet in triangles brings what velocity, area and time say") {
  for (const bool rising : {false, true})
    for (const int per_dir : {1, 2}) {
      CAPTURE(rising);
      CAPTURE(per_dir);
      Simulation simulation(jet_in_triangles(rising, per_dir), serial());
      simulation.run();
      const auto all = simulation.info().injected;
      REQUIRE(all.size() == 1);
      CHECK(all[0].expected == doctest::Approx(density * speed * inlet_cells * h));
      CHECK(all[0].mass == doctest::Approx(simulation.history().mass));
      CHECK(std::abs(all[0].mass - all[0].expected) < 0.05 * all[0].expected);
      // Every 17 steps one particle has left its triangle, or every 34 the last of three.
      CHECK(simulation.frame().size() == inlet_cells * (per_dir == 1 ? 30 : 3 * 15));
    }
}

TEST_CASE("ids of injected particles count on from those at the start") {
  const std::string block = R"({"generator": {"type": "region", "per_cell": 2, "material": 0,
      "velocity": [1, 0], "region": {"box": {"min": [1, 0], "max": [1.2, 0.4]}}}})";
  // The order of generators in the file does not matter for that.
  for (const std::string& generators : {block + ", " + inlet, inlet + ", " + block}) {
    const auto model = free_jet(generators, 40);
    for (const Frame& frame : run(model, flow(2)).frames) check_jet(frame, 32);
  }
}

TEST_CASE("ids follow the order of the cells in their set") {
  Model<2> model = free_jet(inlet, 20);
  Injection<2>& source = model.injections[0];
  std::reverse(source.cells.begin(), source.cells.end());
  std::vector<Vec<2>> x;
  for (const Index cell : source.cells)
    for (Index k = 0; k < 4; ++k) x.push_back(gauss_point(h * static_cast<double>(cell / 30), k));
  source.x = x;
  const Frame frame = run(model, flow(3)).frames.back();
  REQUIRE(frame.size() == 48);
  for (std::size_t i = 0; i < 48; ++i) {
    const auto row = static_cast<Index>(3 - i % 16 / 4);
    CHECK(std::floor(frame.coordinates[2 * i + 1] / h) == static_cast<double>(row));
  }
}

TEST_CASE("particles come in steps that begin in the interval from start to before end alone") {
  const auto timed = [](const std::string& duration) {
    return free_jet(R"({"generator": {"type": "inject", "cset": "corner", "nparticles_per_dir": 1,
        "velocity": [0, 0], "material": 0, "duration": )" +
                        duration + "}}",
                    12);
  };
  const auto particles_after = [](const Model<2>& model, Index steps) {
    Simulation simulation(model, serial());
    simulation.advance(steps);
    return simulation.frame().size();
  };
  CHECK(particles_after(timed("[0.02, 0.05]"), 2) == 0);
  CHECK(particles_after(timed("[0.02, 0.05]"), 3) == 1);  // the third begins at 0.02 s
  CHECK(particles_after(timed("[0.0, 0.01]"), 12) == 1);
  CHECK(particles_after(timed("[0.001, 0.009]"), 12) == 0);  // between two steps
}

TEST_CASE("no further particles after the end, and none into occupied cells") {
  const auto moving = [](const std::string& duration) {
    return free_jet(R"({"generator": {"type": "inject", "cset": "corner", "nparticles_per_dir": 2,
        "velocity": [1, 0], "material": 0, "duration": )" +
                        duration + "}}",
                    20);
  };
  CHECK(run(moving("[0, 0.08]"), serial()).frames.back().size() == 4);   // steps 0 to 7
  CHECK(run(moving("[0, 0.081]"), serial()).frames.back().size() == 8);  // step 8, too
  // Where two generators share a cell the first one fills it.
  const std::string both = inlet + R"(, {"generator": {"type": "inject", "cset": "corner",
      "nparticles_per_dir": 1, "velocity": [1, 0], "material": 0}})";
  CHECK(run(free_jet(both, 5), serial()).frames.back().size() == 16);
  const std::string other = R"({"generator": {"type": "inject", "cset": "corner",
      "nparticles_per_dir": 1, "velocity": [1, 0], "material": 0}}, )" +
                            inlet;
  CHECK(run(free_jet(other, 5), serial()).frames.back().size() == 1 + 12);
}

TEST_CASE("injected at time 0 and there from the start is the same") {
  const std::string cells =
      R"("cset": "inlet", "nparticles_per_dir": 2, "velocity": [1, 0.05], "material": 0)";
  for (const char* scheme : {"usf", "usl", "musl"}) {
    const std::string more = std::string(", \"mpm_scheme\": \"") + scheme + "\"";
    const Outcome there =
        run(free_jet(R"({"generator": {"type": "gauss", )" + cells + "}}", 30, more), serial());
    const Outcome comes =
        run(free_jet(R"({"generator": {"type": "inject", "duration": [0, 0.001], )" + cells + "}}",
                     30, more),
            serial());
    REQUIRE(there.frames.size() == comes.frames.size());
    for (std::size_t k = 0; k < there.frames.size(); ++k)
      CHECK(same_bits(there.frames[k], comes.frames[k]));
  }
}

TEST_CASE("a jet has the same bits however its tasks are executed") {
  for (const auto& model :
       {jet("usf", false), jet("usl", false), jet("musl", true), jet("usl", true)}) {
    const Outcome reference = run(model, serial());
    CHECK(reference.error == "");
    CHECK(reference.removed > 0);
    const Frame& end = reference.frames.back();
    CHECK(end.id.back() + 1 == end.size() + reference.removed);
    for (const auto& way : other_ways()) {
      CAPTURE(describe(way));
      CHECK(same_bits(run(model, way), reference));
    }
  }
}

TEST_CASE("what is said of injected particles does not depend on when they get the ids of frames") {
  // Blown out of the mesh on the left, until what is on the right is too fast for the step.
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "counts": [12, 6]}},
    "sets": {"cells": {"left": {"box": {"min": [0, 0.1], "max": [0.3, 0.4]}},
                       "right": {"box": {"min": [0.8, 0.2], "max": [0.9, 0.3]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                   "poisson_ratio": 0}],
    "particles": [
      {"generator": {"type": "inject", "cset": "left", "nparticles_per_dir": 2,
                     "velocity": [-4, 0], "material": 0, "duration": [0, 0.1]}},
      {"generator": {"type": "inject", "cset": "right", "nparticles_per_dir": 1,
                     "velocity": [0, 0], "material": 0}}],
    "math_functions": [{"type": "Linear", "xvalues": [0.12, 0.13], "fxvalues": [0, 1]}],
    "external_loading_conditions": {"particle_surface_traction": [
      {"pset_id": -1, "dir": 0, "traction": 1e6, "math_function_id": 0}]},
    "analysis": {"dt": 2e-3, "nsteps": 200, "locate_particles": false}})");
  const auto said = [&](const ExecutionOptions& way, Index steps_at_once) {
    Outcome outcome;
    Observer observer;
    observer.removed = [&](std::span<const RemovedParticle> particles) {
      for (const RemovedParticle& one : particles) {
        CHECK(one.id < 1000);
        outcome.removed_rows += removed_line(one);
      }
    };
    Simulation simulation(model, way, observer);
    try {
      while (!simulation.finished()) simulation.advance(steps_at_once);
    } catch (const SimulationError& error) {
      outcome.error = error.what();
    }
    return outcome;
  };
  const Outcome reference = said(serial(), 1000);
  CHECK(reference.error.find("an injected particle") != std::string::npos);
  CHECK(std::count(reference.removed_rows.begin(), reference.removed_rows.end(), '\n') > 20);
  for (const Index steps_at_once : {1, 7, 1000})
    for (const auto& way : {serial(), flow(2), random_order(1)}) {
      CAPTURE(describe(way));
      CAPTURE(steps_at_once);
      CHECK(same_bits(said(way, steps_at_once), reference));
    }
}

TEST_CASE(
    "particles that leave are told of again and again, though nothing else makes the graph drain") {
  const Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "counts": [6, 6]}},
    "sets": {"cells": {"inlet": {"box": {"min": [0, 0.1], "max": [0.2, 0.5]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "inject", "cset": "inlet", "nparticles_per_dir": 4,
                                 "velocity": [-10, 0], "material": 0}}],
    "analysis": {"dt": 1e-3, "nsteps": 4000, "patch_particles": 2000, "split_steps": 0,
                 "locate_particles": false}})");
  const auto told = [&](const ExecutionOptions& way, Index steps_at_once) {
    std::pair<std::string, std::size_t> rows_and_most;
    Observer observer;
    observer.removed = [&](std::span<const RemovedParticle> particles) {
      rows_and_most.second = std::max(rows_and_most.second, particles.size());
      for (const RemovedParticle& one : particles) rows_and_most.first += removed_line(one);
    };
    Simulation simulation(model, way, observer);
    while (!simulation.finished()) simulation.advance(steps_at_once);
    return rows_and_most;
  };
  const auto reference = told(serial(), 10);
  CHECK(std::count(reference.first.begin(), reference.first.end(), '\n') > 10'000);
  for (const auto& way : {serial(), flow(2), random_order(1)}) {
    CAPTURE(describe(way));
    const auto [rows, most] = told(way, 4000);
    CHECK(rows == reference.first);
    CHECK(most < 3000);
  }
}

TEST_CASE("loads and constraints of all particles act on injected ones") {
  Model<2> model = free_jet(inlet, 5);
  model.particle_velocities.push_back({{}, 1, 0.25, true});
  const Frame frame = run(model, serial()).frames.back();
  REQUIRE(frame.size() == 16);
  for (std::size_t i = 0; i < 16; ++i) CHECK(frame.find("velocity")->values[2 * i + 1] == 0.25);
  model.particle_velocities[0].all = false;
  const Frame free = run(model, serial()).frames.back();
  for (const double v : free.find("velocity")->values) CHECK(v != 0.25);
}

TEST_CASE("an adaptive step knows of particles before they come") {
  const std::string adaptive = R"(, "time_step": {"adaptive": true, "safety": 0.5})";
  Model<2> model = free_jet(inlet, 40, adaptive);
  model.analysis.step.dt = std::numeric_limits<double>::infinity();
  const double c = std::sqrt(1e4 * 0.7 / (1.3 * 0.4) / density);
  std::vector<HistoryRow> rows;
  Observer observer;
  observer.history = [&](const HistoryRow& row) { rows.push_back(row); };
  model.output.history_steps = 1;
  Simulation simulation(model, serial(), observer);
  simulation.run();
  REQUIRE(rows.size() == 40);
  for (const HistoryRow& row : rows) CHECK(row.dt == within(1e-6, 0.5 * h / (c + speed)));
  // A fixed step is refused, though there is no particle yet.
  model.analysis.step = {.adaptive = false, .dt = 0.03};
  CHECK_THROWS_WITH_AS(Simulation(model, serial()),
                       doctest::Contains("of particles that are injected"), InputError);
}

TEST_CASE("dense ids follow from events alone") {
  std::vector<Injection<2>> sources(2);
  sources[0].cells.resize(70);
  sources[0].per_cell = 4;
  sources[1].cells.resize(3);
  sources[1].per_cell = 9;
  const InjectionCounts counts = count_injections(sources);
  InjectionLog log(sources, 100);
  CHECK(log.n_elements() == 2);
  const std::vector<Index> later{71, 64}, first{0};
  log.take(0, log.elements(first));
  log.take(5, log.elements(later));
  CHECK(log.dense(7) == 7);
  CHECK(log.dense(counts.id(0, 0, 3)) == 103);
  CHECK(log.dense(counts.id(5, 64, 0)) == 104);
  CHECK(log.dense(counts.id(5, 71, 8)) == 116);
  CHECK(log.next_id() == 117);
}
