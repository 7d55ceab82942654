// Cells of second order with functions that are nowhere negative (bernstein.h).
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

/// A block of 0.4 m, free in space, with this many particles per cell and direction.
template <int Dim>
Model<Dim> block(const char* element, int per_cell, double end_time, double safety) {
  const bool solid = Dim == 3;
  Model<Dim> model = model_of_text<Dim>(fmt::format(
      R"({{
    "mesh": {{"structured": {{"cell_size": {5}, "counts": [{6}]}}, "cell_type": "{0}"}},
    "particles": [{{"generator": {{"type": "region", "per_cell": {1}, "material": 0,
                    "region": {{"box": {{"min": [0.2, 0.2{2}], "max": [0.6, 0.6{3}]}}}}}}}}],
    "materials": [{{"type": "LinearElastic", "density": 1500, "youngs_modulus": 5e5,
                    "poisson_ratio": 0.2}}],
    "analysis": {{"mpm_scheme": "musl", "end_time": {4}, "nsteps": 100000,
                  "time_step": {{"adaptive": true, "safety": {7}}}}}}})",
      element, per_cell, solid ? ", 0.2" : "", solid ? ", 0.6" : "", end_time, solid ? 0.2 : 0.1,
      solid ? "12, 4, 4" : "26, 10", safety));
  return model;
}

/// Kinetic and internal energy at the end over the kinetic energy at the start.
template <int Dim>
std::pair<double, double> energies_at_end(Model<Dim> model) {
  Simulation simulation(std::move(model));
  const double start = simulation.history().kinetic;
  simulation.run();
  const HistoryRow end = simulation.history();
  return {end.kinetic / start, end.internal / start};
}

template <int Dim>
void check_translation(const char* element, int per_cell, double safety) {
  Model<Dim> model = block<Dim>(element, per_cell, Dim == 3 ? 0.1 : 0.3, safety);
  model.particles.velocity.assign(model.particles.x.size(), 4.0 * Vec<Dim>::Unit(0));
  const auto [kinetic, internal] = energies_at_end(std::move(model));
  CAPTURE(element);
  CAPTURE(per_cell);
  CAPTURE(safety);
  CHECK(std::abs(kinetic - 1) < 1e-9);
  CHECK(std::abs(internal) < 1e-9);
}

}  // namespace

TEST_CASE("a block of cells of second order moves through its mesh without making energy") {
  for (const double safety : {0.3, 0.15})
    for (const int per_cell : {2, 3, 4}) {
      check_translation<2>("ED2Q9", per_cell, safety);
      check_translation<2>("ED2T6", per_cell, safety);
    }
  for (const int per_cell : {2, 3, 4}) check_translation<3>("ED3H27", per_cell, 0.3);
}

TEST_CASE(
    "a block that turns in cells of second order gains 0.3 % at most, and half at half the step") {
  for (const char* element : {"ED2Q9", "ED2T6"})
    for (const int per_cell : {2, 3, 4}) {
      double before = 0;
      for (const double safety : {0.3, 0.15}) {
        Model<2> model = block<2>(element, per_cell, 0.5, safety);
        for (const Vec<2>& x : model.particles.x)
          model.particles.velocity.push_back(Vec<2>(2.0 - 3.0 * (x[1] - 0.4), 3.0 * (x[0] - 0.4)));
        const auto [kinetic, internal] = energies_at_end(std::move(model));
        CAPTURE(element);
        CAPTURE(per_cell);
        CAPTURE(safety);
        const double gain = kinetic + internal - 1;  // 1.5 rad at 3 rad/s; explicit steps stretch
        CHECK(std::abs(gain) < 4e-3);
        if (safety < 0.3) CHECK(std::abs(gain) < 0.6 * before);
        before = std::abs(gain);
      }
    }
}
