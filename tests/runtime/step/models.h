/// \file Small models whose particles cross patches, and runs of them that can be compared bit by
/// bit.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "io/run/removed.h"
#include "io/scenario/particles_generator.h"
#include "io/scenario/scenario.h"
#include "physics/mesh/partition.h"
#include "runtime/step/simulation.h"
#include "tests/io/frames/frame_samples.h"
#include "tests/plain_defaults.h"

namespace lahar::test {

template <int Dim>
Model<Dim> model_of_text(const std::string& text) {
  Scenario scenario = read_scenario_text(text, LAHAR_SOURCE_DIR, test::plain_defaults(text));
  return std::get<Model<Dim>>(std::move(scenario.model));
}

/// Two soft discs that fly into each other.
inline Model<2> two_discs() {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.05, "extent": [1, 1]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 2000,
                   "poisson_ratio": 0.3},
                  {"type": "LinearElastic", "density": 800, "youngs_modulus": 1500,
                   "poisson_ratio": 0.2}],
    "particles": [
      {"generator": {"type": "region", "per_cell": 2, "velocity": [1, 0.6], "material": 0,
                     "region": {"sphere": {"centre": [0.3, 0.35], "radius": 0.2}}}},
      {"generator": {"type": "region", "per_cell": 3, "velocity": [-1, -0.7], "material": 1,
                     "region": {"sphere": {"centre": [0.7, 0.65], "radius": 0.2}}}}],
    "analysis": {"dt": 4e-3, "nsteps": 80, "patch_particles": 48},
    "post_processing": {"output_steps": 20, "history_steps": 8}})");
}

/// Water that falls apart in a tank.
inline Model<2> dam_break() {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [3, 1.5]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "floor", "dir": "y", "velocity": 0},
               {"nset": "walls", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {
      "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
      "walls": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                          {"half_space": {"point": [3, 0], "normal": [-1, 0]}}]}}},
    "materials": [{"type": "Newtonian", "density": 1000, "bulk_modulus": 4e4,
                   "dynamic_viscosity": 0.5}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
    "external_loading_conditions": {"gravity": [0, -9.81]},
    "analysis": {"dt": 5e-3, "nsteps": 120, "patch_particles": 32},
    "post_processing": {"output_steps": 40, "history_steps": 10}})");
}

/// The same with hexahedra.
inline Model<3> dam_break_3d() {
  return model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": 0.2, "extent": [2, 0.8, 1]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "floor", "dir": "z", "velocity": 0},
               {"nset": "walls", "dir": "x", "velocity": 0},
               {"nset": "sides", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {
      "floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
      "walls": {"union": [{"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}},
                          {"half_space": {"point": [2, 0, 0], "normal": [-1, 0, 0]}}]},
      "sides": {"union": [{"half_space": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
                          {"half_space": {"point": [0, 0.8, 0], "normal": [0, -1, 0]}}]}}},
    "materials": [{"type": "Newtonian", "density": 1000, "bulk_modulus": 4e4,
                   "dynamic_viscosity": 0.5}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0, 0, 0], "max": [0.8, 0.8, 0.8]}}}}],
    "external_loading_conditions": {"gravity": [0, 0, -9.81]},
    "analysis": {"dt": 8e-3, "nsteps": 60, "patch_particles": 64},
    "post_processing": {"output_steps": 20, "history_steps": 10}})");
}

/// Saturated soil that flies off a drained wall.
inline Model<2> saturated_block(const std::string& scheme, const std::string& functions) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [4, 2]},
      "particles_pore_pressures": {"type": "water_table",
        "water_tables": [{"position": 0, "h0": 1.5}]},
      "boundary_conditions": {
        "velocity_constraints": [
          {"nset": "floor", "dir": "y", "velocity": 0},
          {"nset": "wall", "dir": "x", "phase": "liquid", "velocity": 0}],
        "pressure_constraints": [{"nset": "wall", "pressure": 0}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
                       "wall": {"half_space": {"point": [0, 0], "normal": [1, 0]}}}},
    "materials": [
      {"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e6,
       "poisson_ratio": 0.3, "porosity": 0.4, "k_x": 1e-2},
      {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e7,
       "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "material": ["soil", "water"],
      "per_cell": 2, "velocity": [8, 0],
      "region": {"box": {"min": [0, 0], "max": [1.5, 1.5]}}}}],
    "external_loading_conditions": {"gravity": [0, -9.81]},
    "analysis": {"mpm_scheme": ")" +
                          scheme + R"(", "shape_functions": ")" + functions +
                          R"(", "dt": 4e-4, "nsteps": 150, "patch_particles": 12},
    "post_processing": {"output_steps": 50, "history_steps": 10}})");
}

/// The same beside water whose pressure grows with time; a node of the wall is a well.
inline Model<2> beside_water(Model<2> model) {
  model.functions = {MathFunction{.x = {0, 0.05}, .f = {0.5, 2}}};
  bool well = true;
  for (NodePressure& given : entries_of<NodePressure>(model)) {
    given.pressure = 4e3;
    given.function = 0;
    given.inside = std::exchange(well, false);
  }
  return model;
}

/// The same with hexahedra.
inline Model<3> saturated_cube(const std::string& update) {
  const std::string functions = update == "flip" ? "element" : "quadratic_spline";
  return model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": 0.5, "extent": [4, 1, 2]},
      "boundary_conditions": {"velocity_constraints": [
        {"nset": "floor", "dir": 2, "velocity": 0}, {"nset": "floor", "dir": 5, "velocity": 0}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}}}},
    "materials": [
      {"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e6,
       "poisson_ratio": 0.3, "porosity": 0.4, "k_x": 1e-2, "k_z": 1e-3},
      {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e7,
       "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "material": ["soil", "water"],
      "per_cell": 2, "velocity": [10, 0, 0],
      "region": {"box": {"min": [0, 0, 0], "max": [1.5, 1, 1.5]}}}}],
    "external_loading_conditions": {"gravity": [0, 0, -9.81]},
    "analysis": {"velocity_update": ")" +
                          update + R"(", "shape_functions": ")" + functions +
                          R"(", "dt": 8e-4, "nsteps": 100, "patch_particles": 40},
    "post_processing": {"output_steps": 50, "history_steps": 10}})");
}

/// A soft jet that comes out of a wall, falls, and leaves the mesh, in which there is nothing at
/// first.
inline Model<2> jet(const std::string& scheme, bool adaptive) {
  return model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [2, 1.5]}},
    "sets": {"cells": {"inlet": {"box": {"min": [0, 1], "max": [0.1, 1.4]}},
                       "drip": {"box": {"min": [1.2, 1.2], "max": [1.4, 1.3]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e4,
                   "poisson_ratio": 0.2}],
    "particles": [
      {"generator": {"type": "inject", "cset": "inlet", "nparticles_per_dir": 2,
                     "velocity": [2, 0], "material": 0, "duration": [0.05, 0.6]}},
      {"generator": {"type": "inject", "cset": "drip", "nparticles_per_dir": 3,
                     "velocity": [0, -1], "material": 0}}],
    "external_loading_conditions": {"gravity": [0, -9.81]},
    "analysis": {"dt": 5e-3, "nsteps": 120, "patch_particles": 24, "locate_particles": false,
                 "velocity_update": "pic", "mpm_scheme": ")" +
                          scheme + R"(",
                 "time_step": {"adaptive": )" +
                          (adaptive ? "true" : "false") + R"(}},
    "post_processing": {"output_steps": 10, "history_steps": 10}})");
}

/// Friction at all nodes whose velocity is prescribed along one axis, and, for the bits alone, at
/// every third node, with axes that are turned there.
template <int Dim>
Model<Dim> with_walls(Model<Dim> model) {
  for (const NodeVelocity& fixed : entries_of<NodeVelocity>(model))
    entries_of<NodeFriction>(model).push_back({fixed.node, fixed.dir, -1, 0.3});
  Eigen::Matrix<double, Dim, Dim> turn = Eigen::Matrix<double, Dim, Dim>::Identity();
  turn(0, 0) = turn(1, 1) = std::cos(0.4);
  turn(1, 0) = std::sin(0.4);
  turn(0, 1) = -turn(1, 0);
  for (Index n = 0; n < model.mesh->n_nodes(); n += 3) {
    entries_of<NodeFriction>(model).push_back({n, 1, n % 2 == 0 ? 1 : -1, 0.2});
    const auto fixed =
        std::any_of(entries_of<NodeVelocity>(model).begin(), entries_of<NodeVelocity>(model).end(),
                    [&](const NodeVelocity& v) { return v.node == n; });
    if (!fixed) model.node_frames.push_back({n, turn});
  }
  return model;
}

/// Every third node absorbs waves, a little, in one direction or another; some are on springs.
template <int Dim>
Model<Dim> with_absorbing(Model<Dim> model) {
  const double h = model.mesh->cell_size(0);
  const double area = 1e-4 * (Dim == 2 ? h : h * h);  // nodes of little mass bear no more
  for (Index n = 0; n < model.mesh->n_nodes(); n += 3)
    entries_of<NodeAbsorption>(model).push_back(
        {n, static_cast<int>(n % Dim), area, 20 * h, 1.0, 0.7});
  for (Index n = 0; n < model.mesh->n_nodes(); n += 7)  // beside others
    entries_of<NodeAbsorption>(model).push_back(
        {n, static_cast<int>(n % Dim), 2 * area, 10 * h, 0.9, 1.0});
  for (Index n = 1; n < model.mesh->n_nodes(); n += 6)
    entries_of<NodeSpring>(model).push_back({n, static_cast<int>(n % Dim), 2.0, 0.01});
  model.analysis.takes_means = true;
  return model;
}

/// A viscosity by pressure, beside a filter of the velocity transfer, of some hundredths of what
/// particles have per step.
template <int Dim>
void with_viscosity_of_pressure(Model<Dim>& model) {
  model.analysis.transfer.viscosity_length = 0.02;
  model.analysis.transfer.per_viscosity = 4e3;
}

/// Each material is a body; of one material, every second row of cells along the last axis is
/// another.
template <int Dim>
Model<Dim> in_contact(Model<Dim> model, double friction = 0.3) {
  if (model.materials.size() == 1) {
    model.materials.push_back(model.materials[0]);
    for (std::size_t p = 0; p < model.particles.x.size(); ++p) {
      const Index cell = model.particles.cell[p];
      const Index row = Dim == 2 ? cell / model.mesh->counts()[0]
                                 : cell / (model.mesh->counts()[0] * model.mesh->counts()[1]);
      model.particles.material[p] = row % 2 == 0 ? 0 : 1;
    }
  }
  for (std::size_t m = 0; m < model.materials.size(); ++m)
    model.materials[m].body = static_cast<int>(m);
  model.analysis.contact = {static_cast<int>(model.materials.size()), friction};
  return model;
}

/// With functions that reach beyond a cell, or affine velocities: names as in scenarios. Steps are
/// those of USL where nodes of little mass do not make it unstable.
template <int Dim>
Model<Dim> with_functions(Model<Dim> model, ShapeFunctions functions,
                          Affine affine = Affine::none) {
  model.analysis.functions = functions;
  model.analysis.affine = affine;
  if (affine != Affine::none) model.analysis.transfer.flip = 0.0;
  return model;
}

/// The same with ASFLIP.
template <int Dim>
Model<Dim> separable(Model<Dim> model, ShapeFunctions functions) {
  model = with_functions(std::move(model), functions, Affine::apic);
  model.analysis.transfer.flip = 0.95;
  model.analysis.transfer.separation = 1.0;
  return model;
}

/// The structured mesh as a table of cells that are no boxes: every inner node moves by up to
/// `amount`.
template <int Dim>
Model<Dim> distorted(Model<Dim> model, double amount) {
  const Mesh<Dim>& old = *model.mesh;
  std::mt19937_64 random(11);
  const auto [low, high] = old.bounds();
  std::vector<Vec<Dim>> nodes;
  for (Index n = 0; n < old.n_nodes(); ++n) {
    Vec<Dim> x = old.node(n);
    bool inner = true;
    for (int d = 0; d < Dim; ++d) inner = inner && x[d] > low[d] + 1e-9 && x[d] < high[d] - 1e-9;
    for (int d = 0; d < Dim && inner; ++d)
      x[d] += std::uniform_real_distribution<>(-amount, amount)(random);
    nodes.push_back(x);
  }
  std::vector<typename Mesh<Dim>::Corners> cells;
  for (Index c = 0; c < old.n_cells(); ++c) cells.push_back(old.cell_nodes(c));
  model.mesh = std::make_shared<const Mesh<Dim>>(
      Mesh<Dim>::from_tables(std::move(nodes), std::move(cells), true));
  for (std::size_t p = 0; p < model.particles.x.size(); ++p)
    model.particles.cell[p] = model.mesh->locate(model.particles.x[p]).cell;
  for (Injection<Dim>& injection : model.injections) {
    const auto per_cell = static_cast<double>(injection.per_cell);
    const auto points = static_cast<int>(std::lround(std::pow(per_cell, 1.0 / Dim)));
    injection.x = fill_cells<Dim>(*model.mesh, injection.cells, points).x;
    for (std::size_t i = 0; i < injection.cells.size(); ++i)
      injection.volume[i] = model.mesh->cell_volume(injection.cells[i]) / per_cell;
  }
  return model;
}

/// What a run gives to its user.
struct Outcome {
  std::vector<Frame> frames;  ///< those of the scenario, then the last state
  std::vector<HistoryRow> rows;
  Index removed = 0;
  std::string error;         ///< of a run that failed
  std::string removed_rows;  ///< of removed.csv
};

inline bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0);
}

inline bool same_bits(const HistoryRow& a, const HistoryRow& b) {
  const auto numbers = [](const HistoryRow& r) {
    return std::vector<double>{r.time,        r.dt,      r.mass,      r.momentum[0], r.momentum[1],
                               r.momentum[2], r.kinetic, r.internal,  r.external,    r.damping,
                               r.friction,    r.balance, r.max_speed, r.divided};
  };
  return a.step == b.step && a.particles == b.particles && same_bits(numbers(a), numbers(b));
}

inline bool same_bits(const Outcome& a, const Outcome& b) {
  const auto equal = [](const auto& x, const auto& y) {
    return x.size() == y.size() &&
           std::equal(x.begin(), x.end(), y.begin(),
                      [](const auto& i, const auto& j) { return same_bits(i, j); });
  };
  return equal(a.frames, b.frames) && equal(a.rows, b.rows) && a.removed == b.removed &&
         a.removed_rows == b.removed_rows && a.error == b.error;
}

using Mode = ExecutionOptions::Mode;

inline ExecutionOptions serial() {
  return {.mode = Mode::serial};
}
inline ExecutionOptions random_order(std::uint64_t seed) {
  return {.mode = Mode::random_order, .seed = seed};
}
inline ExecutionOptions flow(int threads) {
  return {.mode = Mode::flow_graph, .threads = threads, .verify = true};
}

/// Every way of executing that must give the bits of the serial loop.
inline std::vector<ExecutionOptions> other_ways() {
  return {flow(1), flow(2), flow(3), flow(8), random_order(1), random_order(2), random_order(3)};
}

inline std::string describe(const ExecutionOptions& way) {
  if (way.mode == Mode::serial) return "serial";
  if (way.mode == Mode::random_order) return "random order " + std::to_string(way.seed);
  return std::to_string(way.threads) + " threads";
}

template <int Dim>
Outcome run(const Model<Dim>& model, const ExecutionOptions& options) {
  Outcome outcome;
  Observer observer;
  observer.frame = [&](FramePieces&& frame) { outcome.frames.push_back(join(frame)); };
  observer.history = [&](const HistoryRow& row) { outcome.rows.push_back(row); };
  observer.removed = [&](std::span<const RemovedParticle> particles) {
    for (const RemovedParticle& particle : particles)
      outcome.removed_rows += removed_line(particle);
  };
  Simulation simulation(model, options, observer);
  try {
    simulation.run();
  } catch (const SimulationError& error) {
    outcome.error = error.what();
  }
  outcome.frames.push_back(simulation.frame());
  outcome.rows.push_back(simulation.history());
  outcome.removed = simulation.info().removed;
  return outcome;
}

/// Particles that end in another patch than the one they began in.
template <int Dim>
Index crossings(const Model<Dim>& model, const Frame& end) {
  Simulation simulation(model, serial());
  const Partition<Dim> partition(*model.mesh, simulation.info().cells_per_patch);
  Index count = 0;
  for (std::size_t k = 0; k < end.id.size(); ++k) {
    Vec<Dim> x;
    for (int d = 0; d < Dim; ++d) x[d] = end.coordinates[k * Dim + static_cast<std::size_t>(d)];
    const Index before = model.particles.cell[static_cast<std::size_t>(end.id[k])];
    count += partition.patch_of(before) != partition.patch_of(model.mesh->locate(x).cell);
  }
  return count;
}

}  // namespace lahar::test
