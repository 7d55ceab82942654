// Runs that go on from a particle file of CB-Geo MPM.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "io/frames/cbgeo_table.h"
#include "io/results/cbgeo_export.h"
#include "physics/base/error.h"
#include "tests/runtime/step/models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

namespace fs = std::filesystem;

/// Water in a basin and a soft block beside it, on which a traction acts; particles of a source
/// come in during the run.
std::string water_and_block(const std::string& scheme, const std::string& resume) {
  return R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 1.2]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "floor", "dir": "y", "velocity": 0},
               {"nset": "walls", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {
      "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
      "walls": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                          {"box": {"min": [0.6, 0], "max": [0.6, 1.2]}},
                          {"half_space": {"point": [2, 0], "normal": [-1, 0]}}]}},
      "particles": {"top": {"box": {"min": [1.2, 0.35], "max": [1.8, 0.4]}}},
      "cells": {"source": {"box": {"min": [0.2, 1], "max": [0.4, 1.1]}}}},
    "materials": [{"id": 3, "type": "Newtonian", "density": 1000, "bulk_modulus": 4e4,
                   "dynamic_viscosity": 0.5},
                  {"id": 1, "type": "LinearElastic", "density": 1500, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.25}],
    "particles": [
      {"generator": {"type": "region", "per_cell": 2, "material_id": 3,
                     "region": {"box": {"min": [0, 0], "max": [0.6, 0.8]}}}},
      {"generator": {"type": "region", "per_cell": 2, "material_id": 1,
                     "region": {"box": {"min": [1.2, 0], "max": [1.8, 0.4]}}}},
      {"generator": {"type": "inject", "cset": "source", "nparticles_per_dir": 2,
                     "velocity": [0, -1], "material_id": 3, "duration": [0.05, 0.4]}}],
    "math_functions": [{"id": 0, "type": "Linear", "xvalues": [0, 0.5], "fxvalues": [0, 1]}],
    "external_loading_conditions": {"gravity": [0, -9.81], "particle_surface_traction": [
      {"pset": "top", "dir": 0, "traction": 500, "math_function_id": 0}]},
    "analysis": {"dt": 4e-3, "nsteps": 100, "patch_particles": 40, "velocity_update": "pic", "mpm_scheme": ")" +
         scheme + "\"" + resume + R"(},
    "post_processing": {"output_steps": 50}})";
}

/// Largest difference of a column as a share of its largest value.
double difference(const std::vector<double>& a, const std::vector<double>& b) {
  REQUIRE(a.size() == b.size());
  double most = 0, largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i] - b[i]));
    largest = std::max(largest, std::abs(b[i]));
  }
  return largest > 0 ? most / largest : most;
}

Frame frame_of(const Model<2>& model, const ExecutionOptions& options, Index steps) {
  Simulation simulation(model, options);
  simulation.advance(steps);
  return simulation.frame();
}

const CbgeoRun run_info{.nsteps = 100, .states = {{3, {"pressure"}}}};

Model<2> resumed(const std::string& scheme, const fs::path& folder, const std::string& keys) {
  const std::string text =
      water_and_block(scheme, R"(, "resume": {"resume": true, "uuid": "before", )" + keys + "}");
  Scenario scenario = read_scenario_text(text, folder, test::plain_defaults(text));
  return std::get<Model<2>>(std::move(scenario.model));
}

/// Particles keep everything but their order within a cell, and the size on which tractions act,
/// which CB-Geo MPM takes from the present volume: sums round otherwise, and the traction differs
/// by half the volumetric strain.
constexpr double order_of_sums = 1e-9, size_of_traction = 5e-4;

}  // namespace

TEST_CASE("a run that is exported and resumed agrees with one that was not interrupted") {
  for (const char* scheme : {"usf", "usl", "musl"}) {
    CAPTURE(scheme);
    for (const bool traction : {false, true}) {
      CAPTURE(traction);
      Model<2> whole = model_of_text<2>(water_and_block(scheme, ""));
      if (!traction) whole.tractions.clear();
      const TemporaryFolder folder;
      fs::create_directories(folder.path / "results/before");
      const Frame middle = frame_of(whole, serial(), 40);
      write_cbgeo(middle, run_info, folder.path / "results/before" / cbgeo_file_name(39, 100));
      Model<2> model = resumed(scheme, folder.path, R"("step": 39)");
      if (!traction) model.tractions.clear();
      CHECK(model.particles.size() == middle.size());
      const Frame begin = frame_of(model, serial(), 0);
      CHECK(begin.step == 40);
      CHECK(begin.time == middle.time);
      const auto& gaps = middle.find("opening")->values;
      CHECK(*std::max_element(gaps.begin(), gaps.end()) > 0);
      CHECK(begin.id == middle.id);
      for (const char* column :
           {"velocity", "displacement", "stress", "volume", "mass", "strain", "opening"})
        CHECK(same_bits(begin.find(column)->values, middle.find(column)->values));

      const Frame expected = frame_of(whole, serial(), 100);
      const Frame end = frame_of(model, flow(2), 60);
      CHECK(end.step == 100);
      CHECK(end.time == expected.time);
      CHECK(end.id == expected.id);
      CHECK(end.id.size() > middle.id.size());  // more came in
      const double bound = traction ? size_of_traction : order_of_sums;
      CHECK(difference(end.coordinates, expected.coordinates) < bound);
      for (const FrameColumn& column : expected.columns) {
        CAPTURE(column.name);
        CHECK(difference(end.find(column.name)->values, column.values) < bound);
      }
    }
  }
}

TEST_CASE("resuming from the files of all ranks of a parallel run, in any order") {
  const Model<2> whole = model_of_text<2>(water_and_block("usl", ""));
  const TemporaryFolder folder;
  fs::create_directories(folder.path / "results/before");
  Frame middle = frame_of(whole, serial(), 40);
  write_cbgeo(middle, run_info, folder.path / "results/before/particles039.h5");
  const Frame expected = frame_of(resumed("usl", folder.path, R"("step": 39)"), serial(), 5);
  std::vector<CbgeoParticle> rows =
      read_cbgeo_rows(folder.path / "results/before/particles039.h5", 0, middle.size());
  fs::remove(folder.path / "results/before/particles039.h5");
  std::reverse(rows.begin(), rows.end());
  for (const Index part : {0, 1})
    write_cbgeo_table(
        folder.path / "results/before" / ("particles-" + std::to_string(part) + "_2-039.h5"),
        part == 0 ? 20 : middle.size() - 20, [&](Index first, Index n) {
          const auto from = rows.begin() + first + (part == 0 ? 0 : 20);
          return std::vector<CbgeoParticle>(from, from + n);
        });
  CHECK(same_bits(frame_of(resumed("usl", folder.path, R"("step": 39)"), serial(), 5), expected));
}

TEST_CASE("with adaptive steps a resumed run begins at 0 with the state of the file") {
  const TemporaryFolder folder;
  fs::create_directories(folder.path / "results/before");
  const Frame middle = frame_of(model_of_text<2>(water_and_block("usf", "")), serial(), 40);
  write_cbgeo(middle, run_info, folder.path / "results/before/particles039.h5");
  const Model<2> model = resumed(
      "usf", folder.path,
      R"("step": 39}, "end_time": 0.02, "time_step": {"adaptive": true, "accept_unstable": false)");
  Simulation simulation(model, serial());
  CHECK(simulation.time() == 0.0);
  CHECK(simulation.history().particles == middle.size());
  simulation.run();
  CHECK(simulation.time() == doctest::Approx(0.02));
}

TEST_CASE("a resumed run does not give velocities of nodes once more in its first step") {
  const TemporaryFolder folder;
  fs::create_directories(folder.path / "results/before");
  const Frame middle = frame_of(model_of_text<2>(water_and_block("usf", "")), serial(), 40);
  write_cbgeo(middle, run_info, folder.path / "results/before/particles039.h5");
  const auto gives = [&](const std::string& resume) {
    const Scenario scenario = read_scenario_text(water_and_block("usf", resume), folder.path);
    return std::get<Model<2>>(scenario.model).analysis.sudden_velocities;
  };
  CHECK(gives(""));
  CHECK(!gives(R"(, "resume": {"resume": true, "uuid": "before", "step": 39})"));
}

TEST_CASE("a resumed run whose transfer has an affine field is told that it begins without one") {
  const TemporaryFolder folder;
  fs::create_directories(folder.path / "results/before");
  const Frame middle = frame_of(model_of_text<2>(water_and_block("usl", "")), serial(), 40);
  write_cbgeo(middle, run_info, folder.path / "results/before/particles039.h5");
  std::string text = water_and_block(
      "usl",
      R"(, "shape_functions": "gimp", "resume": {"resume": true, "uuid": "before", "step": 39})");
  const auto about_affine = [&] {
    Index n = 0;
    for (const Problem& warning :
         read_scenario_text(text, folder.path, test::plain_defaults(text)).warnings)
      n += warning.message ==
           "the particle file has no affine velocities: \"apic\", \"tpic\" and \"asflip\" begin "
           "without them";
    return n;
  };
  CHECK(about_affine() == 0);
  for (const char* update : {"apic", "tpic", "asflip"}) {
    const std::string before = "\"velocity_update\": \"";
    const std::size_t at = text.find(before) + before.size();
    text.replace(at, text.find('"', at) - at, update);
    CHECK(about_affine() == 1);
  }
}

TEST_CASE("a resumed material has the strength of its parameters and its plastic strain") {
  const TemporaryFolder folder;
  fs::create_directories(folder.path / "results/before");
  std::vector<CbgeoParticle> rows(3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    CbgeoParticle& p = rows[i];
    p.id = static_cast<Index>(i);
    p.mass = p.volume = 1;
    p.coord[0] = p.coord[1] = 0.5;
    p.nstate_vars = 7;
    p.svars[0] = 0.7, p.svars[1] = 0.1, p.svars[2] = 5;  // parameters of before
  }
  rows[1].svars[6] = 0.2;  // half way from peak to residual strength
  rows[2].svars[6] = 9;
  write_cbgeo_table(folder.path / "results/before/particles039.h5", 3, [&](Index first, Index n) {
    return std::vector<CbgeoParticle>(rows.begin() + first, rows.begin() + first + n);
  });
  const Scenario scenario = read_scenario_text(R"({
    "mesh": {"structured": {"cell_size": 1, "extent": [2, 2]}},
    "materials": [{"id": 0, "type": "MohrCoulomb", "density": 1, "youngs_modulus": 1e4,
                   "poisson_ratio": 0.3, "friction": 30, "dilation": 10, "cohesion": 2000,
                   "tension_cutoff": 0, "softening": true, "residual_friction": 20,
                   "residual_dilation": 0, "residual_cohesion": 1000, "peak_pdstrain": 0.1,
                   "residual_pdstrain": 0.3}],
    "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
    "analysis": {"dt": 1e-3, "nsteps": 100,
                 "resume": {"resume": true, "uuid": "before", "step": 39}}})",
                                               folder.path);
  const auto& state = std::get<Model<2>>(scenario.model).particles.state;
  REQUIRE(state.size() == 3);
  constexpr double degree = std::numbers::pi / 180;
  const std::array<std::array<double, 3>, 3> expected{
      {{30, 10, 2000}, {25, 5, 1500}, {20, 0, 1000}}};
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(state[i][0] == doctest::Approx(expected[i][0] * degree));
    CHECK(state[i][1] == doctest::Approx(expected[i][1] * degree));
    CHECK(state[i][2] == doctest::Approx(expected[i][2]));
    CHECK(state[i][6] == rows[i].svars[6]);
  }
}

TEST_CASE("particle files that do not belong to the case are refused") {
  const TemporaryFolder folder;
  fs::create_directories(folder.path / "results/before");
  const fs::path file = folder.path / "results/before/particles039.h5";
  CbgeoParticle good;
  good.id = 4;
  good.mass = 1;
  good.volume = 1e-3;
  good.coord[0] = good.coord[1] = 0.5;
  good.material_id = 3;
  good.nstate_vars = 1;
  const auto says = [&](const std::vector<CbgeoParticle>& rows) {
    write_cbgeo_table(file, static_cast<Index>(rows.size()), [&](Index first, Index n) {
      return std::vector<CbgeoParticle>(rows.begin() + first, rows.begin() + first + n);
    });
    try {
      resumed("usf", folder.path, R"("step": 39)");
      return std::string("accepted");
    } catch (const InputError& error) {
      return error.problems().front().message;
    }
  };
  CHECK(says({good}) == "accepted");
  CHECK(says({good, good}) == "there are two particles 4");
  CbgeoParticle bad = good;
  bad.material_id = 7;
  CHECK(says({bad}) == "particle 4 is of material 7, which materials does not have");
  bad = good;
  bad.nstate_vars = 2;
  CHECK(says({bad}) == "particle 4 has 2 state variables, its material 3 has 1");
  bad = good;
  bad.velocity[1] = std::nan("");
  CHECK(says({bad}) == "particle 4 is not finite");
  bad = good;
  bad.mass = 0;
  CHECK(says({bad}) ==
        "the mass and volume of particle 4 must be above 0, found 0 kg and 0.001 m^3");
  bad = good;
  bad.coord[0] = 9;
  CHECK(says({bad}) == "particle 4 lies outside the mesh (and 0 more)");
  bad = good;
  bad.id = -1;
  CHECK(says({bad}) == "-1 is not the id of a particle");
}
