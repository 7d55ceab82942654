// What the keys of a scenario make of the model.
#include "io/scenario/scenario.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "io/scenario/particles_generator.h"
#include "tests/within.h"

using namespace lahar;

namespace {

// A 4 x 2 grid of unit squares with `more` members and replacements of the pieces that tests vary.
struct Pieces {
  std::string mesh = {};
  std::string sets = "{}";
  std::string loads = "{}";
  std::string functions = "[]";
  std::string analysis = "\"dt\": 0.1, \"nsteps\": 10";
  std::string generator = "{\"type\": \"region\", \"per_cell\": 1, \"material\": \"a\"}";
  std::string more = {};
};

std::string scenario(const Pieces& p) {
  return R"({"mesh": {"structured": {"cell_size": 1, "counts": [4, 2]})" + p.mesh +
         R"(}, "sets": )" + p.sets + R"(, "particles": [{"generator": )" + p.generator +
         R"(}], "materials": [
    {"name": "a", "type": "LinearElastic", "density": 10, "youngs_modulus": 100, "poisson_ratio": 0},
    {"id": 7, "name": "b", "type": "Newtonian2D", "density": 20, "bulk_modulus": 5,
     "dynamic_viscosity": 0.5}],
  "external_loading_conditions": )" +
         p.loads + R"(, "math_functions": )" + p.functions + R"(, "analysis": {)" + p.analysis +
         "}" + p.more + "}";
}

Model<2> model(const Pieces& pieces, const ScenarioOptions& options = {}) {
  return std::get<Model<2>>(read_scenario_text(scenario(pieces), "", options).model);
}

std::vector<Index> constrained_nodes(const std::string& region) {
  const auto m = model({.mesh = R"(, "boundary_conditions": {"velocity_constraints": [
                                  {"nset": "s", "dir": "x", "velocity": 0}]})",
                        .sets = R"({"nodes": {"s": )" + region + "}}"});
  std::vector<Index> nodes;
  for (const auto& c : entries_of<NodeVelocity>(m)) nodes.push_back(c.node);
  return nodes;
}

}  // namespace

TEST_CASE("regions contain their boundary and nothing beyond it") {
  using Ids = std::vector<Index>;  // nodes are numbered 5 to a row: 0-4, 5-9, 10-14
  CHECK(constrained_nodes(R"({"box": {"min": [1, 1], "max": [2, 2]}})") == Ids{6, 7, 11, 12});
  CHECK(constrained_nodes(R"({"box": {"max": [0.5, 9]}})") == Ids{0, 5, 10});
  CHECK(constrained_nodes(R"({"half_space": {"point": [3, 0], "normal": [-2, 0]}})") ==
        Ids{3, 4, 8, 9, 13, 14});
  CHECK(constrained_nodes(R"({"sphere": {"centre": [0, 0], "radius": 1}})") == Ids{0, 1, 5});
  CHECK(constrained_nodes(R"({"cylinder": {"from": [1, 1], "to": [3, 1], "radius": 0.1}})") ==
        Ids{6, 7, 8});
  CHECK(constrained_nodes(R"({"polygon": {"points": [[0, 0], [2, 0], [0, 2]]}})") ==
        Ids{0, 1, 2, 5, 6, 10});
  CHECK(constrained_nodes(R"({"difference": [{"all": true}, {"box": {"min": [1, 0]}}]})") ==
        Ids{0, 5, 10});
  CHECK(constrained_nodes(R"({"union": [{"box": {"max": [0, 0]}}, {"box": {"min": [4, 2]}}]})") ==
        Ids{0, 14});
  CHECK(constrained_nodes(R"({"intersection": [{"box": {"max": [1, 9]}},
                                               {"half_space": {"point": [0, 1], "normal": [0, -1]}}]})") ==
        Ids{5, 6, 10, 11});
}

TEST_CASE("nodes that miss a plane by rounding belong to it") {
  // 3 * 0.1 is not 0.3; the cells are 0.1 wide.
  std::string text =
      scenario({.mesh = R"(, "boundary_conditions": {"velocity_constraints": [
                                  {"nset": "s", "dir": 0, "velocity": 0}]})",
                .sets = R"({"nodes": {"s": {"box": {"min": [0.3, 0], "max": [0.3, 1]}}}})"});
  text.replace(text.find("\"cell_size\": 1"), 14, "\"cell_size\": 0.1");
  const auto s = read_scenario_text(text, "");
  CHECK(entries_of<NodeVelocity>(std::get<Model<2>>(s.model)).size() == 3);
}

TEST_CASE(
    "a slope by a polygon has no steps, unless parts with their centre inside are asked for") {
  const auto particles = [](const std::string& keys) {
    const std::string text = R"({"mesh": {"structured": {"cell_size": 1, "counts": [8, 4]}},
        "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "a")" +
                             keys + R"(, "region":
          {"polygon": {"points": [[0, 0], [8, 0], [0, 3]]}}}}],
        "materials": [{"name": "a", "type": "LinearElastic", "density": 1, "youngs_modulus": 1,
                       "poisson_ratio": 0}],
        "analysis": {"nsteps": 1}})";
    return std::get<Model<2>>(read_scenario_text(text, "").model).particles;
  };
  const auto slope = particles("");
  double volume = 0, least = 1;
  for (const double V : slope.volume) volume += V, least = std::min(least, V);
  CHECK(volume == test::within(0.005, 12));
  CHECK(least < 0.2);  // of 0.25
  for (const double V : particles(R"(, "cut_cells": "centres")").volume) CHECK(V == 0.25);
}

TEST_CASE(
    "simple shapes that end inside of cells keep whole parts, and a warning says what it does") {
  std::size_t warnings = 0;
  const auto volume = [&](const std::string& region, const std::string& keys = "") {
    const std::string text = R"({"mesh": {"structured": {"cell_size": 1, "counts": [12, 12]}},
        "particles": [{"generator": {"type": "region", "material": "a")" +
                             keys + R"(, "region": )" + region + R"(}}],
        "materials": [{"name": "a", "type": "LinearElastic", "density": 1, "youngs_modulus": 1,
                       "poisson_ratio": 0}],
        "analysis": {"nsteps": 1}})";
    const Scenario scenario = read_scenario_text(text, "");
    const auto& volumes = std::get<Model<2>>(scenario.model).particles.volume;
    warnings = static_cast<std::size_t>(std::ranges::count_if(scenario.warnings, [](auto& warning) {
      return warning.message ==
                 "the particles have 4.8 % less volume than this region: each part of a cell whose "
                 "centre is inside counts as a whole" ||
             warning.message.find("more volume than this region") != std::string::npos;
    }));
    return std::accumulate(volumes.begin(), volumes.end(), 0.0);
  };
  const std::string box = R"({"box": {"min": [0, 0], "max": [10, 2.1]}})",
                    disc = R"({"sphere": {"centre": [6, 6], "radius": 2}})";
  CHECK(volume(box) == 20);
  CHECK(warnings == 1);
  CHECK(volume(box, R"(, "cut_cells": "exact")") == test::within(0.005, 21));
  CHECK(warnings == 0);
  CHECK(volume(box, R"(, "per_cell": 10)") == test::within(1e-12, 21));
  CHECK(warnings == 0);
  CHECK(volume(disc) > 1.01 * std::numbers::pi * 4);
  CHECK(warnings == 1);
  volume(disc, R"(, "cut_cells": "centres")");  // by the user's wish
  CHECK(warnings == 0);
}

TEST_CASE("a polygon in three dimensions is extruded along its axis") {
  const auto s = read_scenario_text(R"({
    "mesh": {"structured": {"cell_size": 1, "counts": [2, 2, 2]}},
    "particles": [{"generator": {"type": "region", "per_cell": 1, "material": "a", "region":
      {"polygon": {"points": [[0, 0], [2, 0], [2, 1], [0, 1]], "axis": "x", "range": [1, 2]}}}}],
    "materials": [{"name": "a", "type": "LinearElastic3D", "density": 1, "youngs_modulus": 1,
                   "poisson_ratio": 0}],
    "analysis": {"dt": 1, "nsteps": 1}})",
                                    "");
  const auto& p = std::get<Model<3>>(s.model).particles;  // y in 0..2, z in 0..1, x in 1..2
  REQUIRE(p.size() == 2);
  CHECK(p.x[0] == Vec<3>(1.5, 0.5, 0.5));
  CHECK(p.x[1] == Vec<3>(1.5, 1.5, 0.5));
}

TEST_CASE("gravity may grow until its ramping time, in the dialect of the fork") {
  const auto m = model({.loads = R"({"gravity": {"gravity": [1, -10], "ramping_time": 4}})"});
  CHECK(m.gravity == Vec<2>(1, -10));
  REQUIRE(m.gravity_function == 0);
  CHECK(m.functions[0](0) == 0);
  CHECK(m.functions[0](1) == 0.25);
  CHECK(m.functions[0](9) == 1);
  CHECK(model({.loads = R"({"gravity": {"gravity": [1, -10]}})"}).gravity_function == -1);
}

TEST_CASE("initial stresses may be one for all particles, in the dialect of the fork") {
  const auto stress = [](const std::string& values) {
    const auto m = model(
        {.mesh = R"(, "particles_stresses": {"type": "isotropic", "values": )" + values + "}"});
    CHECK(m.particles.stress.size() == 8);
    return m.particles.stress.at(5);
  };
  CHECK(stress("[-7]") == Voigt{-7, -7, -7, 0, 0, 0});
  CHECK(stress("[1, 2, 3, 4, 5, 6]") == Voigt{1, 2, 3, 4, 5, 6});
  CHECK_THROWS_AS(stress("[1, 2]"), InputError);
  CHECK_THROWS_AS(model({.mesh = R"(, "particles_stresses": {"type": "file"})"}), InputError);
}

TEST_CASE("a region is filled with equal parts of cells, the first axis fastest") {
  const auto m = model({.generator = R"({"type": "region", "per_cell": 2, "material": "b",
    "velocity": [1, 2], "region": {"box": {"min": [1, 0], "max": [2, 1]}}})"});
  const auto& p = m.particles;
  REQUIRE(p.size() == 4);
  CHECK(p.x[0] == Vec<2>(1.25, 0.25));
  CHECK(p.x[1] == Vec<2>(1.75, 0.25));
  CHECK(p.x[2] == Vec<2>(1.25, 0.75));
  CHECK(p.cell == std::vector<Index>(4, 1));
  CHECK(p.volume == std::vector<double>(4, 0.25));
  CHECK(p.material == std::vector<std::uint16_t>(4, 1));
  CHECK(p.velocity == std::vector<Vec<2>>(4, Vec<2>(1, 2)));
}

TEST_CASE("the parts of a distorted cell fill it") {
  const auto quad =
      Mesh<2>::from_tables({{0, 0}, {2, 0.3}, {1.5, 1.2}, {-0.2, 1}}, {{0, 1, 2, 3}}, true);
  const auto quad_parts = fill_region<2>(quad, Region<2>(), 3);
  double sum = 0;
  for (double v : quad_parts.volume) sum += v;
  CHECK(quad_parts.x.size() == 9);
  CHECK(sum == doctest::Approx(quad.cell_volume(0)).epsilon(1e-14));
  const auto hex = Mesh<3>::from_tables({{0, 0, 0},
                                         {1.1, 0, 0.1},
                                         {1, 1.2, 0},
                                         {0, 1, -0.1},
                                         {0.1, 0, 1},
                                         {1, 0.1, 1.2},
                                         {1.2, 1, 1},
                                         {0, 1.1, 0.9}},
                                        {{0, 1, 2, 3, 4, 5, 6, 7}}, true);
  const auto hex_parts = fill_region<3>(hex, Region<3>(), 2);
  sum = 0;
  for (double v : hex_parts.volume) sum += v;
  CHECK(sum == doctest::Approx(hex.cell_volume(0)).epsilon(1e-14));
}

TEST_CASE("Gauss points integrate as they should and come in the reference's order") {
  // The points of each rule are symmetric, so that odd moments vanish, and the mean of xi^2 over
  // points is that of the rule.
  for (int n = 1; n <= 4; ++n) {
    const auto points = gauss_points<2>(Element::Q4, n);
    CHECK(points.size() == static_cast<std::size_t>(n * n));
    Vec<2> sum = Vec<2>::Zero();
    for (const auto& xi : points) sum += xi;
    CHECK(sum.norm() < 1e-14);
  }
  const double g = 1 / std::sqrt(3.0), h = std::sqrt(0.6);
  const auto two = gauss_points<3>(Element::H8, 2);
  CHECK((two[2] - Vec<3>(g, g, -g)).norm() < 1e-15);
  CHECK((two[7] - Vec<3>(-g, g, g)).norm() < 1e-15);
  const auto three = gauss_points<2>(Element::Q9, 3);
  CHECK((three[1] - Vec<2>(h, -h)).norm() < 1e-15);
  CHECK((three[4] - Vec<2>(0, -h)).norm() < 1e-15);
  CHECK((three[5] - Vec<2>(h, 0)).norm() < 1e-15);
  CHECK((three[8] - Vec<2>(0, 0)).norm() < 1e-15);
  CHECK((gauss_points<3>(Element::H20, 3)[1] - Vec<3>(-h, -h, 0)).norm() < 1e-15);
  // 64 points: layers along z, in each of them y runs fastest.
  const auto four = gauss_points<3>(Element::H8, 4);
  REQUIRE(four.size() == 64);
  CHECK((four[1] - Vec<3>(four[0][0], four[5][1], four[0][2])).norm() < 1e-15);
  for (std::size_t k = 1; k < 64; ++k) {
    CHECK((k % 16 == 0) == (four[k][2] > four[k - 1][2]));
    CHECK((k % 4 == 0) == (four[k][0] != four[k - 1][0]));
    if (k % 4 != 0) CHECK(four[k][1] > four[k - 1][1]);
  }
}

TEST_CASE("functions of time are linear between their points and constant outside, or a sine") {
  const auto m = model({.functions = R"([
    {"id": 4, "type": "Linear", "xvalues": [0, 1, 3], "fxvalues": [1, 2, 0]},
    {"name": "wave", "type": "Sin", "x0": 0.5, "a": 2},
    {"type": "Sin", "x0": 0, "a": 1, "xrange": [1, 2]}])"});
  const auto& f = m.functions;
  CHECK(f[0](-1) == 1.0);
  CHECK(f[0](0.5) == 1.5);
  CHECK(f[0](2) == 1.0);
  CHECK(f[0](9) == 0.0);
  CHECK(f[1](0) == 0.0);
  CHECK(f[1](2) == doctest::Approx(std::sin(3.0)));
  CHECK(f[2](0.5) == 0.0);
  CHECK(f[2](1.5) == doctest::Approx(std::sin(1.5)));
  CHECK(f[2](2.5) == 0.0);
}

TEST_CASE("of several constraints the first wins, of several forces the last, with its function") {
  const auto m = model({.mesh = R"(, "boundary_conditions": {"velocity_constraints": [
         {"nset": "corner", "dir": 0, "velocity": 1}, {"nset_id": -1, "dir": 0, "velocity": 2}]})",
                        .sets = R"({"nodes": {"corner": {"box": {"max": [0, 0]}}}})",
                        .loads = R"({"concentrated_nodal_forces": [
         {"nset": "corner", "dir": 0, "force": 1}, {"nset": "corner", "dir": 1, "force": 2},
         {"nset": "corner", "dir": 0, "force": 3, "math_function_id": "f"}]})",
                        .functions = R"([{"name": "f", "type": "Sin", "x0": 0, "a": 1}])"});
  REQUIRE(entries_of<NodeVelocity>(m).size() == 15);
  CHECK(entries_of<NodeVelocity>(m)[0].velocity == 1);
  CHECK(entries_of<NodeVelocity>(m)[1].velocity == 2);
  REQUIRE(entries_of<NodeForce>(m).size() == 2);
  CHECK(entries_of<NodeForce>(m)[0].force == 3);
  CHECK(entries_of<NodeForce>(m)[1].force == 2);
  CHECK(entries_of<NodeForce>(m)[1].function == 0);
}

TEST_CASE("sets of particles come from regions and generators, and change materials") {
  const auto m =
      model({.mesh = R"(, "boundary_conditions": {"particles_velocity_constraints": [
         {"pset": "all", "dir": 1, "velocity": 5}]})",
             .sets = R"({"particles": {"right": {"box": {"min": [2, 0]}}},
                   "cells": {"last": {"box": {"min": [3, 1]}}}})",
             .loads = R"({"particle_surface_traction": [{"pset_id": 3, "dir": 0, "traction": 4}]})",
             .generator = R"({"type": "region", "per_cell": 1, "material_id": 0, "pset": "all"}},
         {"generator": {"type": "gauss", "cset_id": "last", "nparticles_per_dir": 1,
                        "material_id": 7, "pset_id": 3})",
             .more = R"(, "material_sets": [{"material": "b", "pset": "right"}])"});
  CHECK(m.particles.size() == 9);
  CHECK(m.particle_velocities[0].particles.size() == 8);
  CHECK(m.tractions[0].particles == std::vector<Index>{8});
  CHECK(m.particles.material == std::vector<std::uint16_t>{0, 0, 1, 1, 0, 0, 1, 1, 1});
}

TEST_CASE("time steps, durations and schemes") {
  const auto a = model({.analysis = R"("dt": 0.1, "end_time": 0.3)"}).analysis;
  CHECK(a.nsteps == 3);
  CHECK(!a.step.adaptive);
  const auto b = model({.analysis = R"("time_step": {"adaptive": true, "safety": 0.4},
    "end_time": 2, "mpm_scheme": "musl", "velocity_update": "flip",
    "velocity_update_settings": {"blending_ratio": 0.95}, "locate_particles": false,
    "preset": "cbgeo")"})
                     .analysis;
  CHECK(b.step.adaptive);
  CHECK(b.step.safety == 0.4);
  CHECK(std::isinf(b.step.dt));
  CHECK(b.end_time == 2);
  CHECK(b.scheme == Scheme::musl);
  CHECK(b.transfer.flip == 0.95);
  CHECK(b.remove_leaving_particles);
  const auto c =
      model({.analysis = R"("dt": 1, "nsteps": 1.0E+5, "velocity_update": true)"}).analysis;
  CHECK(c.nsteps == 100000);
  CHECK(c.transfer.flip == 0.0);
}

TEST_CASE("defaults are those of Lahar, or CB-Geo's where the preset says so") {
  const auto ours = model({.analysis = R"("end_time": 1)"}).analysis;
  CHECK(ours.scheme == Scheme::musl);
  CHECK(ours.step.adaptive);
  CHECK(ours.step.safety == 0.4);
  CHECK(ours.functions == ShapeFunctions::quadratic_spline);
  CHECK(ours.transfer.rates.size() == 1);
  const auto theirs = model({.analysis = R"("preset": "cbgeo", "dt": 1, "nsteps": 1)"}).analysis;
  CHECK(theirs.scheme == Scheme::usf);
  CHECK(!theirs.step.adaptive);
  CHECK(theirs.functions == ShapeFunctions::element);
  CHECK(!theirs.transfer.takes());
  // The mean depth is 2 m. The slower wave takes 2 s through a cell; half of gravity's sqrt(g H^3).
  const auto falling = [](const std::string& analysis, const std::string& more = {}) {
    return model({.loads = R"({"gravity": [0, -8]})", .analysis = analysis, .more = more}).analysis;
  };
  CHECK(falling(R"("end_time": 1)").transfer.viscosity == doctest::Approx(0.0075 * 8));
  CHECK(falling(R"("end_time": 1, "shape_functions": "element")").transfer.viscosity ==
        doctest::Approx(0.015 * 8));
  // A projection has the waves of its surface alone. Without gravity there are none to relax.
  const auto still =
      std::get<Model<2>>(
          read_scenario_text(R"({"mesh": {"structured": {"cell_size": 1, "counts": [4, 4]}},
        "particles": [{"generator": {"type": "region", "per_cell": 2, "material": "w"}}],
        "materials": [{"name": "w", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
                       "dynamic_viscosity": 1}],
        "analysis": {"mpm_scheme": "projection", "dt": 1, "nsteps": 1}})",
                             "", {})
              .model)
          .analysis;
  CHECK(!still.transfer.takes());
  // Who names the transfer gets just that.
  CHECK(!model({.analysis = R"("end_time": 1, "velocity_update": "flip")"})
             .analysis.transfer.takes());
}

TEST_CASE("a cell is filled again with what has flowed into it") {
  const auto volume = [](int n, const std::string& keys) {
    const std::string text =
        R"({"mesh": {"structured": {"cell_size": [0.5, 0.25], "counts": [4, 4]}},
            "sets": {"cells": {"in": {"box": {"min": [0, 0.3], "max": [0.4, 0.4]}}}},
            "particles": [{"generator": {"type": "inject", "cset": "in", "material": "w",
                           "velocity": [2, 0], "nparticles_per_dir": )" +
        std::to_string(n) + R"(}}],
            "materials": [{"name": "w", "type": "Newtonian", "density": 1000, "bulk_modulus": 1e6,
                           "dynamic_viscosity": 1}],
            "analysis": {"nsteps": 1)" +
        keys + "}}";
    const Model<2> model = std::get<Model<2>>(read_scenario_text(text, "", {}).model);
    return model.injections.at(0).volume.at(0) * static_cast<double>(n) * n;
  };
  // Until the rear Gauss point has left it.
  CHECK(volume(1, "") == doctest::Approx(0.125 / 2));
  CHECK(volume(2, "") == doctest::Approx(0.125 * 0.5 * (1 + 1 / std::sqrt(3.0))));
  CHECK(volume(3, "") == doctest::Approx(0.125 * 0.5 * (1 + std::sqrt(0.6))));
  CHECK(volume(2, R"(, "preset": "cbgeo", "dt": 0.01)") == doctest::Approx(0.125));
}

TEST_CASE("steps are half as long where a material is of grains, and a filter of order 3") {
  const auto analysis = [](const std::string& material, const std::string& analysis,
                           const std::string& counts = "[4, 2]") {
    const std::string text = R"({"mesh": {"structured": {"cell_size": 1, "counts": )" + counts +
                             R"(}},
      "particles": [{"generator": {"type": "region", "per_cell": 1, "material": "a"}}],
      "materials": [{"name": "a", "density": 10, )" +
                             material +
                             R"(}], "external_loading_conditions": {"gravity": [0, -8]},
      "analysis": {"end_time": 1)" +
                             analysis + "}}";
    return std::get<Model<2>>(read_scenario_text(text, "", {}).model).analysis;
  };
  const auto safety = [&](const std::string& material, const std::string& keys) {
    return analysis(material, keys).step.safety;
  };
  const std::string sand = R"("type": "MohrCoulomb", "youngs_modulus": 100, "poisson_ratio": 0.2,
    "friction": 30, "dilation": 0, "cohesion": 0, "tension_cutoff": 0, "softening": false)";
  CHECK(safety(sand, "") == 0.2);
  CHECK(safety(sand, R"(, "time_step": {"safety": 0.3})") == 0.3);
  CHECK(safety(sand, R"(, "preset": "cbgeo", "dt": 0.01)") == 0.5);
  const std::string water = R"("type": "Newtonian", "bulk_modulus": 5, "dynamic_viscosity": 0)";
  CHECK(safety(water, "") == 0.4);
  // The mean depth is 2 m: sqrt(g H^3) is 8 m^2/s.
  const VelocityTransfer grains = analysis(sand, "").transfer;
  CHECK(grains.order == 3);
  CHECK(grains.viscosity == test::within(1e-5, 0.001 * 8));
  CHECK(grains.viscous == test::within(1e-5, 4 * grains.viscosity));
  // A column of 4 m by 1 m flows with 2 m.
  CHECK(analysis(sand, "", "[1, 4]").transfer.viscosity == grains.viscosity);
  CHECK(analysis(sand, R"(, "shape_functions": "element")").transfer.order == 1);
  CHECK(analysis(water, "").transfer.order == 1);
}

TEST_CASE("a few of many grains may leave the mesh") {
  const auto analysis = [](bool grains, const std::string& keys,
                           const std::string& counts = "[50, 50]") {
    const std::string law = grains ? R"("MohrCoulomb", "friction": 30, "dilation": 0, "cohesion": 0,
                   "tension_cutoff": 0, "softening": false)"
                                   : R"("LinearElastic")";
    const std::string text = R"({"mesh": {"structured": {"cell_size": 1, "counts": )" + counts +
                             R"(}},
      "particles": [{"generator": {"type": "region", "per_cell": 1, "material": "a"}}],
      "materials": [{"name": "a", "density": 10, "youngs_modulus": 100, "poisson_ratio": 0.2,
                     "type": )" +
                             law + R"(}],
      "analysis": {"end_time": 1)" +
                             keys + "}}";
    return std::get<Model<2>>(read_scenario_text(text, "", {}).model).analysis;
  };
  const Analysis grains = analysis(true, "");
  CHECK(grains.remove_leaving_particles);
  CHECK(grains.most_lost == 12);  // of 2500
  for (const Analysis& strict :
       {analysis(false, ""), analysis(true, "", "[9, 22]"),
        analysis(true, R"(, "locate_particles": true)"), analysis(true, R"(, "lost_share": 0)"),
        analysis(true, R"(, "preset": "cbgeo", "dt": 0.01)")}) {
    CHECK(!strict.remove_leaving_particles);
  }
  const Analysis given = analysis(false, R"(, "locate_particles": true, "lost_share": 0.1)");
  CHECK(given.remove_leaving_particles);
  CHECK(given.most_lost == 250);
  const Analysis open = analysis(true, R"(, "locate_particles": false)");
  CHECK(open.remove_leaving_particles);
  CHECK(open.most_lost == std::numeric_limits<Index>::max());
}

TEST_CASE("velocity transfers act in a time, but for the blending ratio of CB-Geo's input") {
  const auto transfer = [](const std::string& keys) {
    return model({.analysis = R"("dt": 0.1, "nsteps": 1, )" + keys}).analysis.transfer;
  };
  const auto with = [&](const std::string& update, const std::string& settings) {
    return transfer(R"("velocity_update": ")" + update + R"(", "velocity_update_settings": {)" +
                    settings + "}");
  };
  // The slower wave of the two materials takes 2 s through a cell of 1 m.
  const auto relaxed = with("flip", R"("relaxation": 0.3)");
  CHECK(relaxed.rates == std::vector<double>{0.15});
  CHECK(relaxed.order == 1);
  CHECK(relaxed.kept(0, 0.1) == doctest::Approx(0.985));
  CHECK(relaxed.kept(0, 100) == 0);
  CHECK(with("flip", R"("relaxation_time": 4, "order": 3)").rates == std::vector<double>{0.25});
  CHECK(with("flip", R"("relaxation_time": 4, "order": 3)").order == 3);
  // A viscosity is of order 1: the higher of two rates, or beside a filter. One of 0.01 m^2/s takes
  // 0.04 / s with quadratic splines in cells of 1 m.
  const auto viscous = with("flip", R"("relaxation": 0.01, "viscosity": 0.01)");
  CHECK(viscous.rates[0] == test::within(1e-5, 0.04));
  CHECK(viscous.viscous == 0);
  const auto both = with("flip", R"("relaxation": 0.01, "viscosity": 0.01, "order": 3)");
  CHECK(both.rates[0] == test::within(1e-5, 0.005));
  CHECK(both.viscous == test::within(1e-5, 0.04));
  CHECK(both.kept(0, 2) == doctest::Approx(0.91));
  const auto by_pressure =
      with("flip", R"("relaxation": 0.01, "viscosity_length": 0.02, "order": 3)");
  CHECK(by_pressure.viscosity_length == 0.02);
  CHECK(by_pressure.per_viscosity == doctest::Approx(4));
  const auto blended = with("flip", R"("blending_ratio": 0.95)");
  CHECK(blended.rates[0] == test::within(1e-5, -0.5 * std::log(0.95)));
  CHECK(with("flip", R"("blending_ratio": 0)").kept(0, 1e-9) == 0);
  CHECK(!with("flip", R"("relaxation": 0)").takes());
  const auto fmpm = transfer(R"("velocity_update": "fmpm")");
  CHECK(fmpm.kept(0, 0.1) == 0);
  CHECK(fmpm.order == 2);
  CHECK(fmpm.filters_change);
  CHECK(!transfer(R"("velocity_update": "xpic")").filters_change);
}

TEST_CASE("relaxation of what flows does not grow with waves faster than its flow asks for") {
  // Two metres: what falls as deep has 6.3 m/s.
  const auto rate = [](const char* law, const char* gravity = "[0, -9.81]") {
    const Scenario scenario = read_scenario_text(
        fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "counts": [8, 8]}}}},
          "materials": [{{"density": 1000, {}}}],
          "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                          "region": {{"box": {{"min": [0, 0], "max": [4, 2]}}}}}}}}],
          "external_loading_conditions": {{"gravity": {}}},
          "analysis": {{"end_time": 1}}}})",
                    law, gravity),
        "");
    return std::get<Model<2>>(scenario.model).analysis.transfer.rates[0];
  };
  const auto water = [](const char* bulk_modulus) {
    return fmt::format(R"("type": "Newtonian", "dynamic_viscosity": 1e-3, "bulk_modulus": {})",
                       bulk_modulus);
  };
  const double most = 15 * std::sqrt(2 * 9.81 * 2) / 0.5;
  CHECK(rate(water("4e6").c_str()) == doctest::Approx(0.05 * std::sqrt(4e3) / 0.5));
  CHECK(rate(water("2.2e9").c_str()) == doctest::Approx(0.05 * most));
  CHECK(rate(water("2.2e10").c_str()) == doctest::Approx(0.05 * most));
  CHECK(rate(water("2.2e9").c_str(), "[0, 0]") == doctest::Approx(0.05 * std::sqrt(2.2e6) / 0.5));
  const char* const clay = R"("type": "VonMises", "poisson_ratio": 0.3, "yield_stress": 1e4,
                              "youngs_modulus": )";
  CHECK(rate((clay + std::string("1e9")).c_str()) ==
        doctest::Approx(rate((clay + std::string("1e10")).c_str())));
}

TEST_CASE("elastic bodies on equal boxes spin and bend: APIC, which relaxes nothing") {
  const auto analysis = [](const char* law, const char* more = "") {
    const Scenario scenario = read_scenario_text(
        fmt::format(R"({{"mesh": {{"structured": {{"cell_size": 0.5, "counts": [8, 8]}}}},
          "materials": [{{"density": 1000, "poisson_ratio": 0, "youngs_modulus": 1e9, {}}}],
          "particles": [{{"generator": {{"type": "region", "per_cell": 2, "material": 0,
                          "region": {{"box": {{"min": [0, 0], "max": [4, 2]}}}}}}}}],
          "external_loading_conditions": {{"gravity": [0, -9.81]}},
          "analysis": {{"end_time": 1{}}}}})",
                    law, more),
        "");
    return std::get<Model<2>>(scenario.model).analysis;
  };
  for (const char* law : {R"("type": "LinearElastic")", R"("type": "NeoHookean")"}) {
    CHECK(analysis(law).affine == Affine::apic);
    CHECK(analysis(law).transfer.rates.empty());
    CHECK(analysis(law).scheme == Scheme::usl);
    CHECK(analysis(law, R"(, "shape_functions": "gimp")").scheme == Scheme::usl);
    CHECK(analysis(law, R"(, "shape_functions": "gimp")").affine == Affine::none);
    CHECK(analysis(law, R"(, "interface": true)").scheme == Scheme::musl);
    CHECK(analysis(law, R"(, "shape_functions": "element")").scheme == Scheme::musl);
    CHECK(analysis(law, R"(, "mpm_scheme": "musl")").scheme == Scheme::musl);
  }
  const Analysis yields = analysis(R"("type": "VonMises", "yield_stress": 1e8)");
  CHECK(yields.affine == Affine::none);
  CHECK(yields.scheme == Scheme::musl);
  const Analysis elements =
      analysis(R"("type": "LinearElastic")", R"(, "shape_functions": "element")");
  CHECK(elements.affine == Affine::none);
  CHECK(elements.transfer.rates[0] == doctest::Approx(0.05 * 1e3 / 0.5));
}

TEST_CASE("asflip keeps what flip does, by default with relaxation, and separates") {
  const auto analysis = [](const std::string& keys) {
    return model({.analysis = R"("dt": 0.1, "nsteps": 1, )" + keys}).analysis;
  };
  const auto with = [&](const std::string& settings) {
    return analysis(R"("velocity_update": "asflip", "velocity_update_settings": {)" + settings +
                    "}")
        .transfer;
  };
  const auto plain = analysis(R"("velocity_update": "asflip")");
  CHECK(plain.affine == Affine::apic);
  CHECK(plain.transfer.separation == 1.0);
  CHECK(plain.transfer.rates[0] == test::within(1e-5, 0.05 / 2));
  CHECK(with(R"("separation": 0.25)").separation == 0.25);
  CHECK(with(R"("separation": 0)").rates[0] == test::within(1e-5, 0.05 / 2));
  CHECK(with(R"("relaxation_time": 4)").rates == std::vector<double>{0.25});
  CHECK(with(R"("relaxation_time": 4)").separation == 1.0);
  const auto all = with(R"("relaxation": 0)");
  CHECK(!all.takes());
  CHECK(all.separation == 1.0);
  // In CB-Geo's input the blending ratio acts per step.
  const auto theirs = analysis(R"("preset": "cbgeo", "velocity_update": "asflip")").transfer;
  CHECK(theirs.flip == 1.0);
  CHECK(theirs.separation == 1.0);
  CHECK(analysis(R"("preset": "cbgeo", "velocity_update": "asflip",
                    "velocity_update_settings": {"blending_ratio": 0.9})")
            .transfer.flip == 0.9);
  CHECK(analysis(R"("velocity_update": "apic")").transfer.separation == 0.0);
}

TEST_CASE("asflip warns of loose grains") {
  const auto warnings = [](const std::string& update) {
    const Scenario scenario = read_scenario_text(
        R"({"mesh": {"structured": {"cell_size": 1, "extent": [4, 4]}},
      "materials": [{"type": "MohrCoulomb", "density": 1000, "youngs_modulus": 1e7,
                     "poisson_ratio": 0.3, "friction": 30, "dilation": 0, "cohesion": 0,
                     "tension_cutoff": 0}],
      "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                                   "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
      "analysis": {"end_time": 1, "velocity_update": ")" +
            update + R"("}})",
        "");
    return std::count_if(scenario.warnings.begin(), scenario.warnings.end(), [](const auto& w) {
      return w.message.find("loose grains run out too far") != std::string::npos;
    });
  };
  CHECK(warnings("asflip") == 1);
  CHECK(warnings("apic") == 0);
}

TEST_CASE("affine velocities with functions of elements are refused where material comes apart") {
  const auto sand = [](const std::string& more) {
    return R"({"mesh": {"structured": {"cell_size": 1, "extent": [4, 4]}},
      "materials": [{"type": "MohrCoulomb", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0,
                     "friction": 30, "dilation": 0, "cohesion": 0, "tension_cutoff": 0}],
      "particles": [{"generator": {"type": "region", "per_cell": 1, "material": 0,
                                   "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
      "analysis": {"dt": 0.1, "nsteps": 1, "velocity_update": "apic", "shape_functions": ")" +
           more + "}}";
  };
  CHECK_THROWS_WITH_AS(
      read_scenario_text(sand("element\""), ""),
      doctest::Contains("\"apic\" does not go together with the functions of elements where "
                        "material may come apart"),
      InputError);
  CHECK_NOTHROW(read_scenario_text(sand(R"(element", "preset": "cbgeo")"), ""));
  CHECK_NOTHROW(read_scenario_text(sand("gimp\""), ""));
}

TEST_CASE("overrides replace, add and are converted") {
  const ScenarioOptions options{{"analysis.nsteps=20", "/analysis/mpm_scheme=usl",
                                 "/materials/1/density=1.5", "post_processing.output_steps=5"},
                                false};
  const auto m = model({}, options);
  CHECK(m.analysis.nsteps == 20);
  CHECK(m.analysis.scheme == Scheme::usl);
  CHECK(m.materials[1].density == 1.5);
  CHECK(m.output.frame_steps == 5);
}

TEST_CASE("the watchdog ends runs, but only warns where the reference code goes on") {
  using Action = Watchdog::Action;
  CHECK(model({}).watchdog.action == Action::stop);
  CHECK(model({}).watchdog.energy == 1);
  CHECK(model({}, {{"analysis.preset=cbgeo"}, false}).watchdog.action == Action::warn);
  CHECK(model({}, {{}, true}).watchdog.action == Action::warn);
  CHECK(model({}, {{"analysis.watchdog.action=stop"}, true}).watchdog.action == Action::stop);
  const Watchdog given =
      model({}, {{"analysis.watchdog.action=off", "analysis.watchdog.speed=3",
                  "analysis.watchdog.compression=0.2", "analysis.watchdog.expansion=0"},
                 false})
          .watchdog;
  CHECK(given.action == Action::none);
  CHECK(given.speed == 3);
  CHECK(given.compression == 0.2);
  CHECK(given.expansion == 0);
}

TEST_CASE("output may come by time") {
  const OutputPlan plan =
      model({}, {{"post_processing.output_dt=0.1", "post_processing.history_dt=0.02",
                  "post_processing.max_frames=7"},
                 false})
          .output;
  CHECK(plan.frame_dt == 0.1);
  CHECK(plan.history_dt == 0.02);
  CHECK(plan.max_frames == 7);
  CHECK(model({}).output.frame_dt == 0);
  CHECK(model({}).output.max_frames == 10000);
}

TEST_CASE("checkpoints are planned in post_processing, without a plan there are none") {
  const OutputPlan none = model({}).output;
  CHECK(none.checkpoint_steps == 0);
  CHECK(none.checkpoint_minutes == 0);
  CHECK(none.checkpoints_kept == 2);
  const OutputPlan plan =
      model({}, {{"post_processing.checkpoint_steps=50", "post_processing.checkpoint_minutes=1.5",
                  "post_processing.checkpoints_kept=7"},
                 false})
          .output;
  CHECK(plan.checkpoint_steps == 50);
  CHECK(plan.checkpoint_minutes == 1.5);
  CHECK(plan.checkpoints_kept == 7);
}

TEST_CASE("keys that the reference ignores, and keys without effect, are warned about once each") {
  std::string text =
      scenario({.analysis = R"("dt": 1, "nsteps": 1, "nload_balance_steps": 1000)",
                .generator = R"({"type": "region", "material": "a", "velocity": [1, 0]})"});
  text.insert(text.find("\"density\": 10"), "\"porosity\": 0.3, \"tolerance\": 1e-9, ");
  const auto s = read_scenario_text(text, "");
  REQUIRE(s.warnings.size() == 3);
  CHECK(s.warnings[0].message == "'tolerance' is ignored in a material");
  CHECK(s.warnings[1].message == "'porosity' has no effect without a liquid in the pores");
  CHECK(s.warnings[2].message == "'nload_balance_steps' has no effect");
}

TEST_CASE("the text of a problem looks like a compiler's") {
  Problem p;
  p.file = "a.json";
  p.line = 3;
  p.column = 4;
  p.where = "/x";
  p.message = "wrong";
  p.hint = "do it right";
  p.source = "\tab";
  CHECK(format_problems({p}) ==
        "a.json:3:4: error: wrong [/x]\n  \tab\n  \t  ^\n  hint: do it right\n");
  CHECK(format_problems({p}, "warning", true).find("\033[1;35mwarning:\033[0m wrong") !=
        std::string::npos);
}
