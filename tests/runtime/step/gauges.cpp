// Gauges and maps: equal to what frames have, and the same however a run is executed.
#include "runtime/step/gauges.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "tests/runtime/step/gauge_models.h"
#include "tests/runtime/step/restart_checks.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Rows of gauges beside the frame of the same step.
struct Beside {
  std::map<std::string, std::vector<double>> values;  ///< by gauge, all rows
  std::map<std::string, std::vector<GaugeColumn>> columns;
  Frame frame;
  double mass_removed = 0;  ///< beyond x = 0.95 m

  const double* vector(Index i) const {
    return &frame.coordinates[static_cast<std::size_t>(i * frame.dim)];
  }
  double value(const char* name, Index i, int component = 0) const {
    const FrameColumn& column = *frame.find(name);
    return column.values[static_cast<std::size_t>(i * column.components + component)];
  }
  bool is_water(Index i) const { return frame.material[static_cast<std::size_t>(i)] == 0; }
  double exact(auto&& term) const {
    ExactSum sum;
    for (Index i = 0; i < frame.size(); ++i) sum += term(i);
    return sum.value();
  }
};

Beside at_end(Model<3> model) {
  for (const DerivedField& field : derived_fields)
    if (field.name == "mean_stress" || field.name == "von_mises_stress")
      model.output.derived_fields.push_back(&field);
  Beside found;
  Observer observer;
  observer.gauges = [](const GaugeRows&) {};
  observer.removed = [&](std::span<const RemovedParticle> particles) {
    for (const RemovedParticle& one : particles)
      if (one.position[0] > 0.95) found.mass_removed += one.mass;
  };
  Simulation simulation(model, flow(2), observer);
  simulation.gauges();
  simulation.run();
  const GaugeRows rows = simulation.gauges();
  const auto tables = simulation.gauge_tables();
  for (std::size_t k = 0; k < tables.size(); ++k) {
    found.values[tables[k].name] = rows.values[k];
    found.columns[tables[k].name] = tables[k].columns;
  }
  found.frame = simulation.frame();
  return found;
}

double hat(const double* x, const std::array<double, 3>& place, double radius, int axes) {
  double weight = 1;
  for (int d = 0; d < axes; ++d)
    weight *= std::max(0.0, 1 - std::abs(x[d] - place[static_cast<std::size_t>(d)]) / radius);
  return weight;
}

/// As run_gauged(), of a run that stops after some steps and goes on from its state elsewhere.
template <int Dim>
Gauged run_gauged_in_two(const Model<Dim>& model, Index steps) {
  Gauged found;
  std::vector<GaugeTable> tables;
  Observer observer;
  observer.gauges = [&](const GaugeRows& rows) { found.rows += text_of(tables, rows); };
  Simulation first(model, serial(), observer);
  tables = first.gauge_tables();
  found.rows = text_of(tables, first.gauges());
  first.advance(steps);
  const StoredState middle(first.state());
  // What the header of a checkpoint keeps of it.
  CheckpointHeader header;
  header.run = middle.run;
  SimulationState again = middle.view();
  again.run = read_header(header_text(header)).run;
  Simulation second(model, flow(2), observer, again);
  second.run();
  found.maps = second.maps();
  return found;
}

}  // namespace

TEST_CASE("gauges at places are means of the particles in frames, bit for bit") {
  const Beside run = at_end(gauged());
  const auto share = [&](Index i, const std::array<double, 3>& place, double radius, int axes) {
    return hat(run.vector(i), place, radius, axes) * run.value("volume", i);
  };
  const std::array<double, 3> place{0.15, 0.2, 0.11};
  const double weight = run.exact([&](Index i) { return share(i, place, 0.13, 3); });
  REQUIRE(weight > 0);
  std::vector<double> expected;
  for (const auto& [name, width] :
       {std::pair{"velocity", 3}, {"stress", 6}, {"pressure", 1}, {"von_mises_stress", 1}})
    for (int c = 0; c < width; ++c)
      expected.push_back(run.exact([&](Index i) {
        return share(i, place, 0.13, 3) * run.value(name, i, c);
      }) / weight);
  CHECK(run.values.at("point") == expected);
  CHECK(run.columns.at("point")[2].name == "velocity_z");
  CHECK(run.columns.at("point")[6].name == "stress_xy");

  // Five places on a line; what has no particles around it is not a number.
  const auto& line = run.values.at("line");
  REQUIRE(line.size() == 5 * 5);
  for (std::size_t k = 0; k < 5; ++k) {
    const std::array<double, 3> at{0.25 * static_cast<double>(k), 0.2, 0.05};
    const double sum = run.exact([&](Index i) { return share(i, at, 0.1, 3); });
    CHECK(line[5 * k] == doctest::Approx(at[0]));
    if (sum > 0)
      CHECK(line[5 * k + 4] == run.exact([&](Index i) {
        return share(i, at, 0.1, 3) * run.value("mean_stress", i);
      }) / sum);
    else
      CHECK(std::isnan(line[5 * k + 4]));
  }

  const std::array<double, 3> plan{0.25, 0.2, 0};
  const double above = run.exact([&](Index i) { return share(i, plan, 0.1, 2); });
  const auto& column = run.values.at("column");
  CHECK(column[0] == doctest::Approx(above / std::pow(0.1, 2)).epsilon(1e-15));
  double highest = -1;
  for (Index i = 0; i < run.frame.size(); ++i)
    if (share(i, plan, 0.1, 2) > 0)
      highest =
          std::max(highest, run.vector(i)[2] + 0.5 * std::pow(run.value("volume", i), 1.0 / 3));
  CHECK(column[1] == highest);
  CHECK(column[2] == run.exact([&](Index i) {
    return share(i, plan, 0.1, 2) * run.value("velocity", i, 0);
  }) / above);
}

TEST_CASE("no particle around a place is left out, wherever the place lies in its cell") {
  Model<3> model = gauged();
  auto& gauges = model.output.measured.gauges;
  gauges.clear();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  for (int k = 0; k < 60; ++k) {
    Gauge& gauge = gauges.emplace_back();
    gauge.name = std::to_string(k);
    gauge.places = {{0.4 * share(random), 0.4 * share(random), 0.3 * share(random)}};
    gauge.radius.fill(0.02 + 0.1 * share(random));
    gauge.fields = {"velocity"};
  }
  const Beside run = at_end(model);
  int measured = 0;
  for (const Gauge& gauge : gauges) {
    CAPTURE(gauge.name);
    const auto weight = [&](Index i) {
      return hat(run.vector(i), gauge.places[0], gauge.radius[0], 3) * run.value("volume", i);
    };
    const double sum = run.exact(weight);
    const double velocity = run.values.at(gauge.name)[2];
    if (sum > 0) {
      ++measured;
      CHECK(velocity ==
            run.exact([&](Index i) { return weight(i) * run.value("velocity", i, 2); }) / sum);
    } else {
      CHECK(std::isnan(velocity));
    }
  }
  CHECK(measured > 40);
}

TEST_CASE("the thickness of level ground is its own, wherever the gauge is, also at a wall") {
  Model<3> model = gauged();
  model.particles.velocity.assign(static_cast<std::size_t>(model.particles.size()), Vec<3>::Zero());
  auto& gauges = model.output.measured.gauges;
  gauges.resize(1);
  gauges[0] = {};
  gauges[0].kind = Gauge::Kind::columns;
  gauges[0].radius.fill(0.1);
  for (const double x : {0.0, 0.1, 0.15, 0.2}) gauges[0].places.push_back({x, 0.2, 0});
  Simulation simulation(model, serial());
  const GaugeRows rows = simulation.gauges();
  REQUIRE(rows.values[0].size() == 4 * 8);  // distance, x, y, thickness, height, velocity
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(rows.values[0][8 * k + 3] == doctest::Approx(0.4).epsilon(1e-12));
    CHECK(rows.values[0][8 * k + 4] == doctest::Approx(0.4).epsilon(1e-12));
  }
}

TEST_CASE("with flat cells the thickness does not change as rows of particles pass the gauge") {
  const Model<3> model = model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": [0.1, 0.1, 0.04], "extent": [2, 1, 0.2]}},
    "materials": [{"name": "block", "type": "LinearElastic", "density": 1500,
                   "youngs_modulus": 1e5, "poisson_ratio": 0.2}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "block",
      "region": {"box": {"min": [0, 0, 0], "max": [1.6, 1, 0.16]}}, "velocity": [1, 0, 0]}}],
    "analysis": {"dt": 1e-3, "nsteps": 60},
    "post_processing": {"gauge_steps": 7, "gauges": [
      {"name": "column", "type": "column", "at": [0.8, 0.53]}]}})");
  Simulation simulation(model, serial());
  for (int k = 0; k < 8; ++k) {
    CHECK(simulation.gauges().values[0][0] == doctest::Approx(0.16).epsilon(1e-9));
    simulation.advance(7);
  }
}

TEST_CASE("sums over particles, fronts and tracks are those of frames") {
  const Beside run = at_end(gauged());
  const auto& water = run.values.at("water");
  const auto of_water = [&](auto&& term) {
    return run.exact([&](Index i) { return run.is_water(i) ? term(i) : 0.0; });
  };
  const double mass = of_water([&](Index i) { return run.value("mass", i); });
  CHECK(water[1] == mass);
  CHECK(water[3] ==
        of_water([&](Index i) { return run.value("mass", i) * run.vector(i)[0]; }) / mass);
  CHECK(water[8] == of_water([&](Index i) {
                      return run.value("mass", i) * run.value("velocity", i, 2);
                    }) / mass);
  CHECK(run.columns.at("water")[10].name == "potential");
  CHECK(water[10] ==
        9.81 * of_water([&](Index i) { return run.value("mass", i) * run.vector(i)[2]; }));
  double front = -1, rear = 2;
  for (Index i = 0; i < run.frame.size(); ++i)
    if (run.is_water(i)) {
      front = std::max(front, run.vector(i)[0]);
      rear = std::min(rear, run.vector(i)[0]);
    }
  CHECK(run.values.at("front") == std::vector<double>{front, rear});

  const auto& drops = run.values.at("drops");
  const auto width = run.columns.at("drops").size();
  REQUIRE(width == 8);
  Index of_set = 0;
  for (Index i = 0; i < run.frame.size(); ++i) of_set += run.is_water(i);
  REQUIRE(drops.size() == width * static_cast<std::size_t>(of_set));
  for (Index i = 0; i < of_set; ++i) {
    const double* row = &drops[width * static_cast<std::size_t>(i)];
    CHECK(row[0] == static_cast<double>(run.frame.id[static_cast<std::size_t>(i)]));
    for (int d = 0; d < 3; ++d) {
      CHECK(row[1 + d] == run.vector(i)[d]);
      CHECK(row[4 + d] == run.value("velocity", i, d));
    }
    CHECK(row[7] == run.value("pressure", i));
  }
}

TEST_CASE("what passes a plane is what is beyond it and what has left there") {
  const Beside run = at_end(gauged());
  REQUIRE(run.mass_removed > 0);
  const auto& outlet = run.values.at("outlet");
  CHECK(outlet[0] ==
        run.exact([&](Index i) { return run.vector(i)[0] > 0.95 ? run.value("mass", i) : 0.0; }));
  CHECK(outlet[2] == doctest::Approx(outlet[0] + run.mass_removed).epsilon(1e-14));
}

TEST_CASE("potential energy falls by the work of weight, material by material") {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 1]}},
    "materials": [
      {"name": "light", "type": "LinearElastic", "density": 500, "youngs_modulus": 1e5,
       "poisson_ratio": 0.2},
      {"name": "heavy", "type": "LinearElastic", "density": 2000, "youngs_modulus": 1e5,
       "poisson_ratio": 0.2}],
    "particles": [
      {"generator": {"type": "region", "per_cell": 2, "material": "light",
        "region": {"box": {"min": [0.1, 0.6], "max": [0.3, 0.8]}}}},
      {"generator": {"type": "region", "per_cell": 2, "material": "heavy", "velocity": [0, 0.4],
        "region": {"box": {"min": [0.6, 0.5], "max": [0.8, 0.7]}}}}],
    "external_loading_conditions": {"gravity": [1, -9.81]},
    "analysis": {"dt": 5e-4, "nsteps": 400, "patch_particles": 16},
    "post_processing": {"gauge_steps": 400, "gauges": [
      {"name": "light", "type": "particles", "material": "light"},
      {"name": "heavy", "type": "particles", "material": "heavy"},
      {"name": "all", "type": "particles"}]}})");
  std::vector<std::vector<double>> last;
  Observer observer;
  observer.gauges = [&](const GaugeRows& rows) { last = rows.values; };
  Simulation simulation(model, flow(2), observer);
  const auto first = simulation.gauges().values;
  simulation.run();
  constexpr std::size_t kinetic = 7, potential = 8;
  const double work = simulation.history().external;
  REQUIRE(work > 100);
  CHECK(first[2][potential] - last[2][potential] == within(5e-3, work));
  for (const auto& row : {first, last})
    for (const std::size_t energy : {kinetic, potential})
      CHECK(row[0][energy] + row[1][energy] == doctest::Approx(row[2][energy]).epsilon(1e-13));
  // They fall freely: what potential energy each loses it gains in kinetic energy.
  for (const std::size_t k : {0, 1})
    CHECK(last[k][kinetic] - first[k][kinetic] ==
          within(5e-3, first[k][potential] - last[k][potential]));

  // Gravity that grows: of the time of the row.
  model.functions.push_back({.x = {0, 1}, .f = {0, 1}});
  model.gravity_function = 0;
  Simulation growing(model, serial(), observer);
  CHECK(growing.gauges().values[0][potential] == 0);
  growing.run();
  const auto& row = last[0];  // particles, mass, volume, centre
  CHECK(row[potential] ==
        doctest::Approx(-0.2 * row[1] * (1 * row[3] - 9.81 * row[4])).epsilon(1e-13));
}

namespace {

Gauge of_plane(const std::string& name, double x, double along) {
  Gauge gauge;
  gauge.kind = Gauge::Kind::plane;
  gauge.name = name;
  gauge.origin = {x, 0, 0};
  gauge.direction = {along, 0, 0};
  return gauge;
}

/// Soil and water that fly to the right, some of it out of the mesh.
Model<2> saturated_outlet() {
  Model<2> model = saturated_block("usf", "element");
  model.analysis.remove_leaving_particles = true;
  model.analysis.nsteps = 1000;
  model.watchdog.action = Watchdog::Action::none;
  for (const DerivedField& field : derived_fields)
    if (field.name == "liquid_mass") model.output.derived_fields.push_back(&field);
  Gauge all;
  all.kind = Gauge::Kind::particles;
  all.name = "all";
  model.output.measured.gauges = {all, of_plane("outlet", 2, 1)};
  model.output.measured.steps = 10;
  return model;
}

/// Water is injected on both sides of x = 0.5 m.
Model<2> fed() {
  Model<2> model = jet("usf", false);
  model.output.measured.gauges = {of_plane("out", 0.5, 1), of_plane("back", 0.5, -1)};
  model.output.measured.steps = 5;
  return model;
}

}  // namespace

TEST_CASE("gauges of saturated soil have the sums of grains and water") {
  const Model<2> model = saturated_outlet();
  double removed = 0;
  Observer observer;
  observer.gauges = [](const GaugeRows&) {};
  observer.removed = [&](std::span<const RemovedParticle> particles) {
    for (const RemovedParticle& one : particles) {
      CHECK(one.liquid_mass > 0.1 * one.mass);
      removed += one.mass + one.liquid_mass;
    }
  };
  Simulation simulation(model, flow(2), observer);
  const GaugeRows first = simulation.gauges();
  // 1.5 m x 1.5 m of soil; pores are 0.4 of it. Nothing of it is beyond x = 2 m.
  const double whole = 1.5 * 1.5 * (0.6 * 2650 + 0.4 * 1000);
  // The water is compressed by its pressure: of at most 15 kPa, for a modulus of 10 MPa.
  CHECK(first.values[0][1] > whole);
  CHECK(first.values[0][1] < 1.0002 * whole);
  CHECK(first.values[1][0] == 0);
  simulation.run();
  REQUIRE(removed > 0);
  const GaugeRows last = simulation.gauges();
  const Frame frame = simulation.frame();
  const auto &m = frame.find("mass")->values, &w = frame.find("liquid_mass")->values;
  const auto &v = frame.find("velocity")->values, &u = frame.find("liquid_velocity")->values;
  double mass = 0, momentum = 0, kinetic = 0, beyond = 0;
  for (std::size_t i = 0; i < m.size(); ++i) {
    mass += m[i] + w[i];
    momentum += m[i] * v[2 * i] + w[i] * u[2 * i];
    kinetic += 0.5 * m[i] * (v[2 * i] * v[2 * i] + v[2 * i + 1] * v[2 * i + 1]);
    kinetic += 0.5 * w[i] * (u[2 * i] * u[2 * i] + u[2 * i + 1] * u[2 * i + 1]);
    if (frame.coordinates[2 * i] > 2) beyond += m[i] + w[i];
  }
  const auto& all = last.values[0];  // particles, mass, volume, centre, velocity, kinetic
  const auto equal = [](double a, double b) { return std::abs(a - b) < 1e-12 * std::abs(b); };
  CHECK(equal(all[1], mass));
  CHECK(equal(all[5], momentum / mass));
  CHECK(equal(all[7], kinetic));
  CHECK(equal(last.values[1][0], beyond));
  CHECK(equal(last.values[1][2], beyond + removed));
}

TEST_CASE("particles that are injected beyond a plane have not passed it") {
  Model<2> model = fed();
  model.injections.erase(model.injections.begin());  // what is left falls beyond x = 0.5 m
  double most = 0;
  Observer observer;
  observer.gauges = [&](const GaugeRows& rows) {
    most = std::max(most, rows.values[0][0]);
    for (const auto& plane : rows.values) {
      CHECK(plane[2] == 0);
      CHECK(plane[3] == 0);
    }
  };
  Simulation simulation(model, flow(2), observer);
  simulation.gauges();
  simulation.run();
  CHECK(most > 10);
}

TEST_CASE("rows of planes with injection do not depend on how a run is executed, or on a restart") {
  const Model<2> model = fed();
  const Gauged reference = run_gauged(model, serial());
  CHECK(reference.rows.find("nan") == std::string::npos);
  for (const ExecutionOptions& way : {flow(2), random_order(1)}) {
    CAPTURE(describe(way));
    CHECK(run_gauged(model, way) == reference);
  }
  const Gauged found = run_gauged_in_two(model, 53);  // between two rows
  CHECK(found.rows == reference.rows);
}

namespace {

/// Sums of frames over a raster cell: in whole numbers, as maps have them, and exactly.
struct OverCell {
  Index volume = 0;
  std::array<Index, 3> moved{};
  ExactSum exact_volume;
  std::array<ExactSum, 3> exact_moved;
  double pressure = -std::numeric_limits<double>::infinity();
  double particles = 0;
};

/// Maps as they follow from all frames.
struct MapsOfFrames {
  static constexpr double most_speed = 16384;
  const MapPlan& plan;
  std::vector<double> maps = empty_maps(plan);

  void add(const Frame& frame) {
    std::vector<OverCell> over(static_cast<std::size_t>(plan.cells()));
    const auto &V = frame.find("volume")->values, &v = frame.find("velocity")->values,
               &stress = frame.find("stress")->values;
    for (std::size_t i = 0; i < V.size(); ++i) {
      const double column = std::floor((frame.coordinates[3 * i] - plan.low[0]) / plan.cell);
      const double row = std::floor((frame.coordinates[3 * i + 1] - plan.low[1]) / plan.cell);
      if (column < 0 || column > 4 || row < 0 || row > 1) continue;
      OverCell& cell = over[static_cast<std::size_t>(row * 5 + column)];
      const double share = V[i] / (2 * plan.height * plan.cell * plan.cell);
      cell.volume += std::llround(share * 0x1p60);
      cell.exact_volume += V[i];
      for (std::size_t d = 0; d < 3; ++d) {
        cell.moved[d] += std::llround(share * (v[3 * i + d] / most_speed) * 0x1p60);
        cell.exact_moved[d] += V[i] * v[3 * i + d];
      }
      const double* s = &stress[6 * i];
      cell.pressure = std::max(cell.pressure, -(s[0] + s[1] + s[2]) / 3);
      ++cell.particles;
    }
    for (std::size_t k = 0; k < over.size(); ++k) add(k, over[k], frame.time);
  }
  double& map(MapKind kind, std::size_t k) {
    return maps[static_cast<std::size_t>(kind) * static_cast<std::size_t>(plan.cells()) + k];
  }
  void add(std::size_t k, const OverCell& over, double time) {
    const double unit = 2 * plan.height / 0x1p60;  // [m]
    const double thickness = static_cast<double>(over.volume) * unit;
    // Each particle is rounded to a unit, or to the last digit of its volume.
    const double exact = over.exact_volume.value() / (plan.cell * plan.cell);
    CHECK(std::abs(thickness - exact) <= over.particles * unit + 1e-15 * exact);
    const bool counts = thickness > plan.threshold;
    map(MapKind::thickness, k) = counts ? thickness : 0;
    map(MapKind::speed, k) = map(MapKind::pressure, k) = 0;
    if (!counts) return;
    double square = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      const double v =
          static_cast<double>(over.moved[d]) / static_cast<double>(over.volume) * most_speed;
      const double mean = over.exact_moved[d].value() / over.exact_volume.value();
      CHECK(std::abs(v - mean) <=
            over.particles * unit * most_speed / thickness + 1e-14 * std::abs(mean));
      square += v * v;
    }
    const auto raise = [&](MapKind kind, double value) {
      map(kind, k) = std::max(map(kind, k), value);
    };
    raise(MapKind::max_thickness, thickness);
    map(MapKind::speed, k) = std::sqrt(square);
    map(MapKind::pressure, k) = over.pressure;
    raise(MapKind::max_speed, std::sqrt(square));
    raise(MapKind::max_pressure, over.pressure);
    if (std::isnan(map(MapKind::arrival_time, k))) map(MapKind::arrival_time, k) = time;
  }
};

}  // namespace

TEST_CASE("maps have what frames have over their cells, bit for bit") {
  const Model<3> model = gauged(R"("gauge_steps": 1, "output_steps": 1)");
  const MapPlan& plan = model.output.measured.maps;
  REQUIRE(plan.n == std::array<Index, 2>{5, 2});
  MapsOfFrames expected{plan};
  Observer observer;
  observer.frame = [&](FramePieces&& frame) { expected.add(join(frame)); };
  observer.gauges = [](const GaugeRows&) {};
  Simulation simulation(model, flow(2), observer);
  simulation.gauges();
  expected.add(simulation.frame());
  simulation.run();
  CHECK(same_bits(simulation.maps(), expected.maps));
  // There is something in each of them.
  for (const MapKind kind :
       {MapKind::thickness, MapKind::speed, MapKind::pressure, MapKind::max_thickness,
        MapKind::max_speed, MapKind::max_pressure, MapKind::arrival_time}) {
    std::set<double> values;
    for (std::size_t k = 0; k < static_cast<std::size_t>(plan.cells()); ++k)
      if (const double value = expected.map(kind, k); value > 0) values.insert(value);
    CHECK(!values.empty());
  }
}

TEST_CASE("layers thinner than the threshold are nothing in any map") {
  MapPlan plan = gauged().output.measured.maps;
  plan.threshold = 0.1;
  std::vector<double> maps = empty_maps(plan);
  const auto cells = static_cast<std::size_t>(plan.cells());
  std::vector<Index> added(MapSums::n_added * cells, 0), least(cells, 0);
  const double unit = 2 * plan.height / 0x1p60;  // [m]
  const auto fill = [&](double first, double second) {
    added[0] = static_cast<Index>(first / unit);
    added[MapSums::n_added] = static_cast<Index>(second / unit);
  };
  const auto map = [&](MapKind kind, std::size_t k) {
    return maps[static_cast<std::size_t>(kind) * cells + k];
  };
  fill(0.3, 0.09);
  add_to_maps(maps, plan, 1, added, least);
  CHECK(map(MapKind::thickness, 0) == doctest::Approx(0.3));
  CHECK(map(MapKind::thickness, 1) == 0);
  fill(0.09, 0.09);
  add_to_maps(maps, plan, 2, added, least);
  CHECK(map(MapKind::thickness, 0) == 0);
  CHECK(map(MapKind::max_thickness, 0) == doctest::Approx(0.3));
  CHECK(map(MapKind::max_thickness, 1) == 0);
  CHECK(map(MapKind::thickness, 1) == 0);
}

TEST_CASE("rows of gauges and maps do not depend on how a run is executed") {
  const Model<3> model = gauged();
  const Gauged reference = run_gauged(model, serial());
  CHECK(std::count(reference.rows.begin(), reference.rows.end(), '\n') > 1000);
  for (const ExecutionOptions& way : {flow(1), flow(2), flow(8), random_order(1)}) {
    CAPTURE(describe(way));
    CHECK(run_gauged(model, way) == reference);
  }
}

TEST_CASE("gauges and maps go on from a state as if nothing had come between") {
  const Model<3> model = gauged();
  const Gauged reference = run_gauged(model, serial());
  // Between two rows; some particles have left.
  const Gauged found = run_gauged_in_two(model, 153);
  CHECK(found == reference);
}

TEST_CASE("runs have the same bits whether they are measured or not") {
  Model<3> model = gauged();
  const auto end_of = [](const Model<3>& some, Observer observer) {
    Simulation simulation(some, flow(2), std::move(observer));
    simulation.advance(60);
    return simulation.frame();
  };
  Observer observer;
  observer.gauges = [](const GaugeRows&) {};
  const Frame measured = end_of(model, observer);
  model.output.measured = {};
  CHECK(measured.coordinates == end_of(model, {}).coordinates);
}
