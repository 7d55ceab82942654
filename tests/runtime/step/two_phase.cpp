// A liquid in the pores of a skeleton: drag, momentum, energy, and what comes to rest.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/runtime/step/models.h"
#include "tests/terzaghi.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double skeleton_modulus = 1e7, poisson = 0.2, porosity = 0.4;
constexpr double oedometric =
    skeleton_modulus * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));

/// A column of 1 m that drains at its top, without weight. `more` are members of `analysis`, `mesh`
/// of `mesh`.
std::string column(double conductivity, int cells, const std::string& analysis,
                   const std::string& mesh = "", const std::string& loads = "") {
  const double h = 1.0 / cells;
  return fmt::format(R"({{
    "mesh": {{"structured": {{"cell_size": {0}, "counts": [1, {1}]}}{5},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": -1, "dir": "x", "velocity": 0}},
        {{"nset": "base", "dir": "y", "velocity": 0}}]}}}},
    "sets": {{"nodes": {{"base": {{"half_space": {{"point": [0, 0], "normal": [0, 1]}}}}}},
             "particles": {{"top": {{"box": {{"min": [0, {7}], "max": [{0}, 1]}}}}}}}},
    "materials": [
      {{"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": {8},
       "poisson_ratio": {9}, "porosity": {10}, "k_x": {2}}},
      {{"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2.2e9,
       "dynamic_viscosity": 1e-3}}],
    "particles": [{{"generator": {{"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "region": {{"box": {{"min": [0, 0], "max": [{0}, 1]}}}}}}}}],
    "external_loading_conditions": {{{6}}},
    "analysis": {{{4}, "patch_particles": 16}}, "post_processing": {{"history_steps": 20}}}})",
                     h, cells + 2, conductivity, "", analysis, mesh, loads, 1 - 0.5 * h,
                     skeleton_modulus, poisson, porosity);
}

std::vector<double> heights(const Frame& frame) {
  std::vector<double> y;
  for (std::size_t p = 0; p < frame.id.size(); ++p) y.push_back(frame.coordinates[2 * p + 1]);
  return y;
}

/// Mean of a field over the lowest particles.
double at_base(const Frame& frame, std::string_view field) {
  const auto y = heights(frame);
  const double least = *std::min_element(y.begin(), y.end());
  double sum = 0;
  int n = 0;
  for (std::size_t p = 0; p < frame.id.size(); ++p)
    if (y[p] < least + 1e-3) sum += frame.find(field)->values[p], ++n;
  return sum / n;
}

}  // namespace

TEST_CASE("drag takes the difference of velocities, implicitly, and keeps their momentum") {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [2, 2]}},
    "materials": [
      {"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-3, "k_y": 4e-3},
      {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2.2e9,
       "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "velocity": [1, -2], "region": {"box": {"min": [0.5, 0.5], "max": [1, 1]}}}}],
    "analysis": {"dt": 1e-5, "nsteps": 1}})");
  const double dt = 1e-5, n = 0.4, m = 0.6 * 2650, m_l = 0.4 * 1000;
  model.particles.liquid_velocity.assign(model.particles.x.size(), Vec<2>(0, 0));
  const Frame end = run(model, serial()).frames.back();
  const std::array<double, 2> before{1, -2}, k{1e-3, 4e-3};
  for (std::size_t d = 0; d < 2; ++d) {
    const double Q = n * n * 9810 / k[d];  // by volume
    const double difference = -before[d] / (1 + dt * Q * (1 / m + 1 / m_l));
    const double v = before[d] * m / (m + m_l) - difference * m_l / (m + m_l);
    for (std::size_t p = 0; p < end.id.size(); ++p) {
      CHECK(end.find("velocity")->values[2 * p + d] == doctest::Approx(v).epsilon(1e-9));
      CHECK(end.find("liquid_velocity")->values[2 * p + d] ==
            doctest::Approx(v + difference).epsilon(1e-9));
    }
  }
}

TEST_CASE("Cundall's damping acts on both phases alike") {
  // They fall together: there is no drag. Each component has its force, as_cbgeo the whole one.
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.25, "extent": [2, 2]}},
    "materials": [
      {"name": "soil", "type": "LinearElastic", "density": 2650, "youngs_modulus": 1e7,
       "poisson_ratio": 0.2, "porosity": 0.4, "k_x": 1e-3},
      {"name": "water", "type": "Newtonian", "density": 1000, "bulk_modulus": 2.2e9,
       "dynamic_viscosity": 1e-3}],
    "particles": [{"generator": {"type": "region", "material": ["soil", "water"], "per_cell": 2,
      "velocity": [1, -2], "region": {"box": {"min": [0.5, 0.5], "max": [1, 1]}}}}],
    "external_loading_conditions": {"gravity": [0, -10]},
    "analysis": {"dt": 1e-5, "nsteps": 1,
                 "damping": {"type": "Cundall", "damping_factor": 0.3}}})");
  for (const bool as_cbgeo : {false, true})
    for (const bool explicit_drag : {false, true}) {
      CAPTURE(as_cbgeo);
      CAPTURE(explicit_drag);
      model.analysis.damping_as_cbgeo = as_cbgeo;
      model.analysis.explicit_drag = explicit_drag;
      const Frame end = run(model, serial()).frames.back();
      const std::array<double, 2> before{1, -2}, rate{as_cbgeo ? -3.0 : 0.0, -10 + 3.0};
      for (const char* field : {"velocity", "liquid_velocity"})
        for (std::size_t d = 0; d < 2; ++d)
          for (std::size_t p = 0; p < end.id.size(); ++p)
            CHECK((end.find(field)->values[2 * p + d] - before[d]) / 1e-5 ==
                  doctest::Approx(rate[d]).epsilon(1e-8));
    }
}

TEST_CASE("a column consolidates as Terzaghi says, whatever its conductivity and scheme") {
  // The step is that of the wave. With k = 1e-8 m/s explicit drag would allow 3e-9 s.
  const double load = 1e4;
  const std::string loads = R"("particle_surface_traction": [
    {"pset": "top", "dir": "y", "traction": -1e4}])";
  const std::string pressures =
      R"(, "particles_pore_pressures": {"type": "isotropic", "values": 1e4})";
  for (const std::string scheme : {"usf", "usl", "musl"})
    for (const double k : {1e-3, 4e-4}) {
      CAPTURE(scheme);
      CAPTURE(k);
      const double T = 0.3, c_v = k * oedometric / 9810;
      Model<2> model = model_of_text<2>(column(
          k, 20,
          fmt::format(R"("mpm_scheme": "{}", "end_time": {}, "dt": 1.2e-5)", scheme, T / c_v),
          pressures, loads));
      const Outcome result = run(model, serial());
      const double p = at_base(result.frames.back(), "pore_pressure") / load;
      CHECK(p == within(0.01, terzaghi(T)));
      const HistoryRow& row = result.rows.back();
      CHECK(std::abs(row.balance) < 0.01 * row.external);
    }
}

TEST_CASE("damping leaves the energy of two phases closed") {
  for (const std::string scheme : {"usf", "musl"}) {
    CAPTURE(scheme);
    const Model<2> model =
        model_of_text<2>(column(1e-3, 20,
                                fmt::format(R"("mpm_scheme": "{}", "nsteps": 2000, "dt": 1.2e-5,
                       "damping": {{"type": "Cundall", "damping_factor": 0.3}})",
                                            scheme),
                                "", R"("gravity": [0, -9.81])"));
    const HistoryRow row = run(model, serial()).rows.back();
    CHECK(std::abs(row.balance) < 1e-4 * row.external);
  }
}

TEST_CASE("pores that drain slowly do not limit the step") {
  const std::string pressures =
      R"(, "particles_pore_pressures": {"type": "isotropic", "values": 1e4})";
  const std::string loads = R"("particle_surface_traction": [
    {"pset": "top", "dir": "y", "traction": -1e4}])";
  for (const double k : {1e-6, 1e-8, 1e-10}) {
    CAPTURE(k);
    Model<2> model = model_of_text<2>(
        column(k, 20, R"("mpm_scheme": "musl", "nsteps": 4000, "dt": 1.2e-5)", pressures, loads));
    const Frame end = run(model, serial()).frames.back();
    // The load sets off a small wave, which nothing damps.
    CHECK(at_base(end, "pore_pressure") == within(0.05, 1e4));
  }
}

TEST_CASE("two phases give equal bits in every way of running them") {
  const auto check = [](const auto& model, Index crossing = 20) {
    const Outcome expected = run(model, serial());
    REQUIRE(expected.error == "");
    CHECK(crossings(model, expected.frames.back()) > crossing);
    for (const auto& way : other_ways()) {
      CAPTURE(describe(way));
      CHECK(same_bits(run(model, way), expected));
    }
  };
  for (const std::string scheme : {"usf", "usl", "musl"})
    for (const std::string functions : {"element", "gimp", "quadratic_spline"}) {
      CAPTURE(scheme);
      CAPTURE(functions);
      Model<2> model = saturated_block(scheme, functions);
      if (scheme == "usl") {  // cells collapse where nodes of little mass become too fast
        model.analysis.nsteps = 20;
        model.output.frame_steps = model.output.history_steps = 5;
      }
      check(model, scheme == "usl" ? -1 : 20);
    }
  for (const std::string update : {"flip", "apic"}) {
    CAPTURE(update);
    check(saturated_cube(update));
  }
}

TEST_CASE("energy closes with two phases, whatever the velocity transfer") {
  for (const std::string update : {"flip", "pic", "apic", "tpic"}) {
    CAPTURE(update);
    const Model<3> model = saturated_cube(update);
    const Outcome result = run(model, serial());
    const HistoryRow& row = result.rows.back();
    CHECK(std::abs(row.balance) < 0.02 * result.rows.front().kinetic);
    // Grains and the liquid that their pores hold.
    CHECK(row.mass == within(0.01, result.rows.front().mass));
  }
}
