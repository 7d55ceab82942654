/// \file A case with every kind of gauge, for tests of bits.
#pragma once

#include <string>
#include <vector>

#include "tests/runtime/step/models.h"

namespace lahar::test {

/// Water and sand that fall over a step in a box, and leave it on one side.
inline Model<3> gauged(const std::string& post = R"("gauge_steps": 7)") {
  return model_of_text<3>(R"({
    "mesh": {"structured": {"cell_size": 0.1, "extent": [1, 0.4, 0.6]},
      "boundary_conditions": {"velocity_constraints": [
        {"nset": "floor", "dir": "z", "velocity": 0},
        {"nset": "left", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {
      "floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}},
      "left": {"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}}}},
    "materials": [
      {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e5,
       "dynamic_viscosity": 1e-3},
      {"name": "block", "type": "LinearElastic", "density": 1500, "youngs_modulus": 1e5,
       "poisson_ratio": 0.2}],
    "particles": [
      {"generator": {"type": "region", "per_cell": 2, "material": "water", "pset": "drops",
        "region": {"box": {"min": [0, 0, 0], "max": [0.3, 0.4, 0.4]}}}},
      {"generator": {"type": "region", "per_cell": 2, "material": "block",
        "region": {"box": {"min": [0.7, 0.1, 0.1], "max": [0.8, 0.3, 0.3]}},
        "velocity": [3, 0, 0]}}],
    "rigid_bodies": [{"name": "post", "friction": 0.3,
      "region": {"box": {"min": [0.32, 0.1, -0.1], "max": [0.45, 0.3, 0.5]}}}],
    "external_loading_conditions": {"gravity": [0, 0, -9.81]},
    "analysis": {"dt": 5e-4, "nsteps": 200, "patch_particles": 64,
                 "locate_particles": false},
    "post_processing": {
      "gauges": [
        {"name": "point", "type": "point", "at": [0.15, 0.2, 0.11], "radius": 0.13,
         "fields": ["velocity", "stress", "pressure", "von_mises_stress"]},
        {"name": "line", "type": "line", "from": [0, 0.2, 0.05], "to": [1, 0.2, 0.05],
         "places": 5, "radius": 0.1, "fields": ["mean_stress"]},
        {"name": "column", "type": "column", "at": [0.25, 0.2], "radius": 0.1},
        {"name": "section", "type": "section", "from": [0, 0.2], "to": [1, 0.2], "places": 4,
         "radius": 0.15, "material": "water"},
        {"name": "front", "type": "front", "direction": [2, 0, 0], "material": "water"},
        {"name": "outlet", "type": "plane", "at": [0.95, 0, 0], "normal": [1, 0, 0]},
        {"name": "water", "type": "particles", "material": "water"},
        {"name": "all", "type": "particles"},
        {"name": "pressed", "type": "force", "nset": "floor"},
        {"name": "pushed", "type": "force", "nset": "left", "at": [0, 0.2, 0]},
        {"name": "kicked", "type": "force", "rigid_body": "post"},
        {"name": "drops", "type": "track", "pset": "drops", "fields": ["velocity", "pressure"]}],
      "maps": {"cell_size": 0.2, "threshold": 0.01}, )" +
                          post + "}}");
}

/// All rows of gauges as text.
inline std::string text_of(const std::vector<GaugeTable>& tables, const GaugeRows& rows) {
  std::string text;
  for (std::size_t k = 0; k < tables.size(); ++k) text += gauge_lines(tables[k], rows, k);
  return text;
}

/// Rows and maps of a run.
struct Gauged {
  std::string rows;
  std::vector<double> maps;
  bool operator==(const Gauged& other) const {
    return rows == other.rows && same_bits(maps, other.maps);
  }
};

template <int Dim>
Gauged run_gauged(const Model<Dim>& model, const ExecutionOptions& way) {
  Gauged found;
  std::vector<GaugeTable> tables;
  Observer observer;
  observer.gauges = [&](const GaugeRows& rows) { found.rows += text_of(tables, rows); };
  Simulation simulation(model, way, observer);
  tables = simulation.gauge_tables();
  found.rows = text_of(tables, simulation.gauges());
  simulation.run();
  found.maps = simulation.maps();
  return found;
}

}  // namespace lahar::test
