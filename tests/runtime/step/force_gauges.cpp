// Forces on what holds nodes, and on rigid bodies.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Replaces MARKS of a scenario.
std::string with(std::string text, std::initializer_list<std::pair<std::string, std::string>> all) {
  for (const auto& [mark, value] : all)
    for (std::size_t at; (at = text.find(mark)) != text.npos;) text.replace(at, mark.size(), value);
  return text;
}

struct Row {
  double time;
  std::vector<double> force;  ///< of the first gauge
  std::array<double, 3> momentum;
};

/// Rows after each `steps`, with the momentum of all particles there.
template <int Dim>
std::vector<Row> rows_of(Model<Dim> model, Index steps) {
  model.output.measured.steps = steps;
  std::vector<Row> rows;
  Observer observer;
  observer.gauges = [&](const GaugeRows& found) {
    rows.push_back({found.time, found.values[0], {}});
  };
  Simulation simulation(model, flow(2), observer);
  const GaugeRows first = simulation.gauges();
  rows.push_back({first.time, first.values[0], simulation.history().momentum});
  while (!simulation.finished()) {
    simulation.advance(steps);
    rows.back().momentum = simulation.history().momentum;
  }
  return rows;
}

/// A run whose last row of the first gauge is in `row`.
struct Measured {
  explicit Measured(const Model<2>& model) : simulation(model, flow(2), observer()) {
    simulation.gauges();
  }
  Observer observer() {
    Observer with;
    with.gauges = [this](const GaugeRows& rows) { row = rows.values[0]; };
    return with;
  }
  std::vector<double> row;
  Simulation simulation;
};

template <int Dim>
double mass_of(const Model<Dim>& model) {
  return Simulation(model, serial()).history().mass;
}

/// A block that flies into the corner of a box, and slides.
constexpr const char* corner = R"({
  "mesh": {"structured": {"cell_size": 0.1, "extent": [1.2, 1]},
    "boundary_conditions": {WALLS}},
  "sets": {"nodes": {
    "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
    "left": {"half_space": {"point": [0, 0], "normal": [1, 0]}},
    "all": {"box": {"min": [-1, -1], "max": [2, 2]}}}},
  "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                 "poisson_ratio": 0.2}],
  "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
    "velocity": [-1, -0.5], "region": {"box": {"min": [0.2, 0.1], "max": [0.6, 0.5]}}}}],
  "external_loading_conditions": {"gravity": [0, -9.81]},
  "analysis": {"dt": 5e-4, "nsteps": 400, "patch_particles": 16, "mpm_scheme": "SCHEME"OPTIONS},
  "post_processing": {"gauges": [{"name": "all", "type": "force", "nset": "all"}]}})";

const std::string held = R"("velocity_constraints": [
  {"nset": "floor", "dir": "y", "velocity": 0}, {"nset": "left", "dir": "x", "velocity": 0}])";
const std::string rubbed = R"("friction_constraints": [
  {"nset": "floor", "dir": "y", "sign_n": -1, "friction": 0.4, "two_sided": true}], "velocity_constraints": [
  {"nset": "floor", "dir": "y", "velocity": 0}, {"nset": "left", "dir": "x", "velocity": 0}])";
const std::string moving = R"("velocity_constraints": [
  {"nset": "floor", "dir": "y", "velocity": 0.1}, {"nset": "left", "dir": "x", "velocity": 0.2}])";
const std::string pushing = R"("walls": [
  {"nset": "floor", "normal": [0, 1], "friction": 0.3}], "velocity_constraints": [
  {"nset": "left", "dir": "x", "velocity": 0}])";
const std::string springs = R"("spring_constraints": [
  {"nset": "floor", "dir": "y", "stiffness": 2e5}], "velocity_constraints": [
  {"nset": "left", "dir": "x", "velocity": 0}])";

}  // namespace

TEST_CASE(
    "forces on all nodes, weight and loads change the momentum of particles, and nothing else") {
  struct Case {
    std::string scheme, walls, options;
  };
  const auto update = [](const std::string& settings) {
    return R"(, "velocity_update": "flip", "velocity_update_settings": {)" + settings + "}";
  };
  const std::string flip = update(R"("blending_ratio": 1)"), pic = R"(, "velocity_update": "pic")",
                    relaxed = update(R"("relaxation": 0.05, "viscosity": 0.01)");
  const std::vector<Case> cases{
      {"musl", held, flip},
      {"usl", held, flip},
      {"usf", held, flip},
      {"musl", held, pic},
      {"usf", rubbed, pic},
      {"musl", rubbed, flip},
      {"musl", rubbed, relaxed},
      {"usl", moving, relaxed},
      {"musl", pushing, relaxed},
      {"usf", pushing, flip},
      {"musl", springs, flip},
      {"musl", held, R"(, "velocity_update": "apic", "shape_functions": "gimp")"},
      {"usl", rubbed, R"(, "velocity_update": "tpic", "shape_functions": "quadratic_spline")"},
      {"musl", held, update(R"("relaxation": 0.03, "order": 3, "viscosity": 0.01)")},
      {"usl", rubbed, update(R"("relaxation": 0.05, "order": 2)")},
      {"musl", pushing, update(R"("relaxation": 0.05, "order": 4)")},
      {"musl", moving, R"(, "velocity_update": "xpic", "velocity_update_settings": {"order": 3})"},
      {"usl", held, R"(, "velocity_update": "fmpm", "velocity_update_settings": {"order": 2})"},
  };
  for (const Case& one : cases) {
    CAPTURE(one.scheme);
    CAPTURE(one.walls);
    CAPTURE(one.options);
    const auto model = model_of_text<2>(
        with(corner, {{"SCHEME", one.scheme}, {"WALLS", one.walls}, {"OPTIONS", one.options}}));
    const double weight = 9.81 * mass_of(model);
    const auto rows = rows_of(model, 40);
    double most = 0;
    for (std::size_t k = 1; k < rows.size(); ++k) {
      const double dt = rows[k].time - rows[k - 1].time;
      for (std::size_t d = 0; d < 2; ++d) {
        const double change = (rows[k].momentum[d] - rows[k - 1].momentum[d]) / dt;
        const double weight_along = d == 1 ? -weight : 0;
        CHECK(std::abs(weight_along - rows[k].force[d] - change) < 1e-11 * weight);
      }
      most = std::max(most, std::abs(rows[k].force[1]));
    }
    CHECK(most > 0.5 * weight);  // it has met the floor
  }
}

TEST_CASE("forces on a set are moments about a point over their arms") {
  // A bar that is held at its left end and pulled to the right by its weight.
  const auto model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 0.4]},
      "boundary_conditions": {"velocity_constraints": [
        {"nset": "left", "dir": "x", "velocity": 0}, {"nset": "sides", "dir": "y", "velocity": 0}]}},
    "sets": {"nodes": {
      "left": {"half_space": {"point": [0, 0], "normal": [1, 0]}},
      "sides": {"box": {"min": [-1, -1], "max": [2, 2]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "region": {"box": {"min": [0, 0], "max": [0.8, 0.2]}}}}],
    "external_loading_conditions": {"gravity": [10, 0]},
    "analysis": {"dt": 1e-3, "nsteps": 3000,
                 "damping": {"type": "Cundall", "damping_factor": 0.3}},
    "post_processing": {"gauges": [
      {"name": "left", "type": "force", "nset": "left", "at": [0, 0.4]}]}})");
  const auto rows = rows_of(model, 1000);
  const double weight = 10 * mass_of(model);
  CHECK(rows.back().force[0] == within(1e-6, weight));
  CHECK(std::abs(rows.back().force[1]) < 1e-6 * weight);
  CHECK(rows.back().force[2] == within(1e-6, 0.3 * weight));  // -y F_x, y = -0.3 m
  CHECK(std::isnan(rows.front().force[0]));                   // nothing was measured yet
}

TEST_CASE("water at rest presses on walls and floor as hydrostatics says") {
  const auto text = [](double cell, double safety) {
    return with(R"({
      "mesh": {"structured": {"cell_size": CELL, "extent": [0.4, 0.3]},
        "boundary_conditions": {"velocity_constraints": [
          {"nset": "floor", "dir": "y", "velocity": 0},
          {"nset": "left", "dir": "x", "velocity": 0},
          {"nset": "right", "dir": "x", "velocity": 0}]}},
      "sets": {"nodes": {
        "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
        "left": {"half_space": {"point": [0, 0], "normal": [1, 0]}},
        "right": {"half_space": {"point": [0.4, 0], "normal": [-1, 0]}}}},
      "materials": [{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2e6,
                     "dynamic_viscosity": 1e-3}],
      "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
        "region": {"box": {"min": [0, 0], "max": [0.4, 0.2]}}}}],
      "external_loading_conditions": {"gravity": [0, -9.81]},
      "analysis": {"end_time": 0.3, "time_step": {"safety": SAFETY},
                   "damping": {"type": "Cundall", "damping_factor": 0.2}},
      "post_processing": {"gauges": [
        {"name": "right", "type": "force", "nset": "right", "at": [0.4, 0]}]}})",
                {{"CELL", std::to_string(cell)}, {"SAFETY", std::to_string(safety)}});
  };
  const double force = 0.5 * 1000 * 9.81 * 0.2 * 0.2;
  for (const auto& [cell, safety] : {std::pair{0.02, 0.5}, {0.02, 0.25}, {0.01, 0.5}}) {
    CAPTURE(cell);
    CAPTURE(safety);
    Model<2> model = model_of_text<2>(text(cell, safety));
    model.output.measured.dt = 0.1;
    Measured run(model);
    run.simulation.run();
    const std::vector<double>& found = run.row;
    CHECK(found[0] == within(0.005, force));
    // The resultant acts at a third of the depth.
    CHECK(-found[2] == within(0.02, force * 0.2 / 3));
  }
}

namespace {

/// Water as wide as it is told in a tank 0.8 m wide, by projection.
Model<2> projected_water(const std::string& width, const std::string& gauge,
                         const std::string& options, const std::string& analysis = "") {
  return model_of_text<2>(
      with(R"({
    "mesh": {"structured": {"cell_size": 0.05, "extent": [0.8, 0.8]},
      "boundary_conditions": {"velocity_constraints": [
        {"nset": "floor", "dir": "y", "velocity": 0},
        {"nset": "left", "dir": "x", "velocity": 0},
        {"nset": "right", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {
      "all": {"box": {"min": [-1, -1], "max": [2, 2]}},
      "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}},
      "left": {"half_space": {"point": [0, 0], "normal": [1, 0]}},
      "right": {"half_space": {"point": [0.8, 0], "normal": [-1, 0]}}}},
    "materials": [{"type": "Newtonian", "density": 1000, "bulk_modulus": 2e9,
                   "dynamic_viscosity": 1}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "region": {"box": {"min": [0, 0], "max": [WIDTH, 0.4]}}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"mpm_scheme": "projection", "dt": 2e-3, "nsteps": 180, "patch_particles": 64,
      "scheme_settings": {OPTIONS}ANALYSIS},
    "post_processing": {"gauges": [{"name": "a", "type": "force", "nset": "GAUGE",
                                    "at": [0.8, 0]}]}})",
           {{"WIDTH", width}, {"GAUGE", gauge}, {"OPTIONS", options}, {"ANALYSIS", analysis}}));
}

}  // namespace

TEST_CASE("projections: water at rest presses on walls and floor as hydrostatics says") {
  const double side = 0.5 * 1000 * 10 * 0.4 * 0.4, weight = 1000 * 10 * 0.8 * 0.4;
  const auto last = [](const std::string& gauge) {
    return rows_of(projected_water("0.8", gauge, ""), 20).back().force;
  };
  CHECK(last("right")[0] == within(1e-6, side));
  CHECK(last("right")[2] == within(0.01, -side * 0.4 / 3));
  CHECK(last("left")[0] == within(1e-6, -side));
  CHECK(last("floor")[1] == within(1e-6, -weight));
  CHECK(last("floor")[2] == within(1e-6, weight * 0.4));
}

TEST_CASE("projections: forces on all nodes and weight change the momentum, and nothing else") {
  const std::string pic = R"(, "velocity_update": "pic")";
  for (const auto& [options, analysis] :
       {std::pair<std::string, std::string>{"", ""}, {R"("beta": 1)", ""}, {"", pic}}) {
    CAPTURE(options);
    CAPTURE(analysis);
    const auto model = projected_water("0.4", "all", options, analysis);
    const double weight = 10 * mass_of(model);
    const auto rows = rows_of(model, 20);
    double most = 0;
    for (std::size_t k = 1; k < rows.size(); ++k) {
      const double dt = rows[k].time - rows[k - 1].time;
      for (std::size_t d = 0; d < 2; ++d) {
        const double change = (rows[k].momentum[d] - rows[k - 1].momentum[d]) / dt;
        CHECK(std::abs((d == 1 ? -weight : 0) - rows[k].force[d] - change) < 1e-9 * weight);
      }
      most = std::max(most, rows[k].force[0]);
    }
    CHECK(most > 0.05 * weight);  // it has met the other wall
  }
}

TEST_CASE("in quasi-static steps a support bears the weight, by itself and with friction") {
  const std::string text = R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 1]},
      "boundary_conditions": {"walls": [{"nset": "floor", "normal": [0, 1], "friction": 0.5}]}},
    "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                   "poisson_ratio": 0.2}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "region": {"box": {"min": [0.2, 0], "max": [0.6, 0.4]}}}}],
    "external_loading_conditions": {"gravity": [2, -10]},
    "analysis": {"mpm_scheme": "newmark", "scheme_settings": {"quasi_static": true}, "dt": 1,
                 "nsteps": 4},
    "post_processing": {"gauges": [{"name": "floor", "type": "force", "nset": "floor"}]}})";
  const auto model = model_of_text<2>(text);
  const double mass = mass_of(model);
  const auto rows = rows_of(model, 4);
  CHECK(rows.back().force[0] == within(1e-6, 2 * mass));
  CHECK(rows.back().force[1] == within(1e-6, -10 * mass));
}

TEST_CASE("the force on a rigid body is the mean of what it is at the ends of steps") {
  const auto model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 1]}},
    "materials": [{"type": "LinearElastic", "density": 1000, "youngs_modulus": 1e5,
                   "poisson_ratio": 0.2}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "velocity": [0.5, -1], "region": {"box": {"min": [0.2, 0.3], "max": [0.6, 0.7]}}}}],
    "rigid_bodies": [{"name": "ground", "friction": 0.3,
      "region": {"half_space": {"point": [0, 0.22], "normal": [0, 1]}}}],
    "external_loading_conditions": {"gravity": [0, -9.81]},
    "analysis": {"dt": 2e-4, "nsteps": 1200, "patch_particles": 16, "mpm_scheme": "musl"},
    "post_processing": {"gauges": [{"name": "a", "type": "force", "rigid_body": "ground"}]}})");
  Model<2> every = model;
  every.output.measured.steps = 1;
  Measured run(every);
  const std::vector<double>& found = run.row;
  const auto rows = rows_of(model, 100);
  double sum = 0;
  for (Index step = 1; step <= model.analysis.nsteps; ++step) {
    run.simulation.advance(1);
    const RigidBodyRow body = run.simulation.history().bodies[0];
    CHECK(found[0] == doctest::Approx(body.force[0]).epsilon(1e-12));
    CHECK(found[1] == doctest::Approx(body.force[1]).epsilon(1e-12));
    CHECK(found[2] == doctest::Approx(body.torque[2]).epsilon(1e-12));
    sum += body.force[1] / 100;
    if (step % 100 != 0) continue;
    CHECK(rows[static_cast<std::size_t>(step) / 100].force[1] ==
          doctest::Approx(sum).epsilon(1e-9));
    sum = 0;
  }
  // It has been thrown back.
  CHECK(rows.back().momentum[1] > 0);
}
