// Initial stresses of level ground balance its weight at all nodes, wherever it cuts the mesh.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// Ground of one layer or two with K0 stresses. Sides are smooth.
struct Ground {
  double top = 5;
  double layer = 0;  ///< [m] where the lower layer ends; 0: there is one
  std::string functions = "quadratic_spline";
  double surcharge = 0;           ///< [Pa]
  bool block_in_the_air = false;  ///< above it
};

/// Particles of a material, as wide as the mesh.
template <int Dim>
std::string box(double from, double to, const char* material) {
  const std::string across = Dim == 3 ? "0, " : "", far = Dim == 3 ? "1.5, " : "";
  return fmt::format(R"({{"generator": {{"type": "region", "per_cell": 2, "material": "{}",
                          "region": {{"box": {{"min": [0, {}{}], "max": [3, {}{}]}}}}}}}})",
                     material, across, from, far, to);
}

constexpr const char* sides[] = {
    R"("x": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                       {"half_space": {"point": [3, 0], "normal": [-1, 0]}}]},
       "floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}})",
    R"("x": {"union": [{"half_space": {"point": [0, 0, 0], "normal": [1, 0, 0]}},
                       {"half_space": {"point": [3, 0, 0], "normal": [-1, 0, 0]}}]},
       "y": {"union": [{"half_space": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
                       {"half_space": {"point": [0, 1.5, 0], "normal": [0, -1, 0]}}]},
       "floor": {"half_space": {"point": [0, 0, 0], "normal": [0, 0, 1]}})"};

template <int Dim>
Model<Dim> model_of(const Ground& ground) {
  constexpr bool space = Dim == 3;
  const char* const up = space ? "z" : "y";
  std::string parts = ground.layer > 0 ? box<Dim>(0, ground.layer, "clay") + ", " +
                                             box<Dim>(ground.layer, ground.top, "sand")
                                       : box<Dim>(0, ground.top, "clay");
  if (ground.block_in_the_air) parts += ", " + box<Dim>(6, 7, "clay");
  std::string loads;
  if (ground.surcharge > 0)
    loads = fmt::format(
        R"(, "particle_surface_traction": [{{"pset": "top", "dir": "{}", "traction": {}}}])", up,
        -ground.surcharge);
  return model_of_text<Dim>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": 0.5, "extent": [3, {0}8]}},
      "boundary_conditions": {{"velocity_constraints": [
        {{"nset": "floor", "dir": "{1}", "velocity": 0}}, {{"nset": "x", "dir": "x", "velocity": 0}}
        {2}]}},
      "particles_stresses": {{"type": "k0", "k0": 0.5, "surcharge": {3}}}}},
    "sets": {{"nodes": {{{4}}},
      "particles": {{"top": {{"half_space": {{"point": [0, {5}{6}], "normal": [0, {5}-1]}}}}}}}},
    "materials": [
      {{"name": "clay", "type": "LinearElastic", "density": 2000, "youngs_modulus": 1e7,
        "poisson_ratio": 0.3}},
      {{"name": "sand", "type": "LinearElastic", "density": 1500, "youngs_modulus": 1e7,
        "poisson_ratio": 0.3}}],
    "particles": [{7}],
    "external_loading_conditions": {{"gravity": [0, {5}-9.81]{8}}},
    "analysis": {{"shape_functions": "{9}", "dt": 1e-5, "nsteps": 1,
                 "until": {{"imbalance": 1e-12}},
                 "damping": {{"type": "Cundall", "damping_factor": 1e-6}}}}}})",
      space ? "1.5, " : "", up, space ? R"(, {"nset": "y", "dir": "y", "velocity": 0})" : "",
      ground.surcharge, sides[Dim - 2], space ? "0, " : "", ground.top - 0.25, parts, loads,
      ground.functions));
}

/// Unbalanced forces of nodes over loads at the first step. No particle is in tension.
template <int Dim>
double imbalance(const Ground& ground) {
  Model<Dim> model = model_of<Dim>(ground);
  for (const Voigt& stress : model.particles.stress)
    CHECK(stress[static_cast<std::size_t>(Dim - 1)] < 0);
  Simulation simulation(std::move(model), {.threads = 1});
  simulation.run();
  return simulation.info().rest.imbalance;
}

constexpr double wanted = 1e-3;  // [-] of the weight

}  // namespace

TEST_CASE("K0 stresses: level ground is in balance, wherever it and its layers cut cells") {
  double worst = 0;
  for (const char* functions : {"quadratic_spline", "cubic_spline", "gimp", "cpdi", "element"})
    for (const double top : {5.0, 5.05, 5.25, 5.3})
      for (const double layer : {0.0, 3.0, 3.3, 3.4}) {
        CAPTURE(functions);
        CAPTURE(top);
        CAPTURE(layer);
        const double found = imbalance<2>({.top = top, .layer = layer, .functions = functions});
        CHECK(found < wanted);
        worst = std::max(worst, found);
      }
  MESSAGE("unbalanced forces are at most ", worst, " of the weight");
}

TEST_CASE("K0 stresses: so it is in three dimensions") {
  double worst = 0;
  for (const char* functions : {"quadratic_spline", "gimp", "element"})
    for (const auto& [top, layer] : {std::pair(5.0, 0.0), {5.3, 3.3}, {5.05, 3.4}}) {
      CAPTURE(functions);
      CAPTURE(top);
      const double found = imbalance<3>({.top = top, .layer = layer, .functions = functions});
      CHECK(found < wanted);
      worst = std::max(worst, found);
    }
  MESSAGE("unbalanced forces are at most ", worst, " of the weight");
}

TEST_CASE("K0 stresses: so it is below a load that its surface bears") {
  for (const char* functions : {"quadratic_spline", "gimp", "element"}) {
    CAPTURE(functions);
    CHECK(imbalance<2>({.functions = functions, .surcharge = 2e4}) < wanted);
  }
}

TEST_CASE("K0 stresses: so it is below what is in the air, which alone falls") {
  const double block = 1.0 / (1 + 5);  // of all weight
  for (const char* functions : {"quadratic_spline", "gimp", "element"}) {
    CAPTURE(functions);
    const double found = imbalance<2>({.functions = functions, .block_in_the_air = true});
    CHECK(std::abs(found - block) < wanted);
  }
}
