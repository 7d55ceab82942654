// What the transfer of velocities takes from a standing wave: a rate, whatever the time step.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double c = 10, length = 1, pi = std::numbers::pi;

struct Wave {
  int cells = 16;
  std::string functions = "element", scheme = "usl", transfer = "xpic";
  int order = 1;
  double relaxation_time = 0;  // [s]; 0: none
  double step = 0.1;           // [h / c]
};

/// A bar with closed ends in its second mode, of the length of two waves... one wave long, 2 x 2
/// particles per cell.
Model<2> standing_wave(const Wave& wave) {
  const double h = length / wave.cells;
  const std::string settings =
      wave.relaxation_time == 0
          ? R"("velocity_update": "flip")"
          : R"("velocity_update": ")" + wave.transfer +
                R"(", "velocity_update_settings": {"order": )" + std::to_string(wave.order) +
                R"(, "relaxation_time": )" + std::to_string(wave.relaxation_time) + "}";
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": )" + std::to_string(h) + R"(, "extent": [1, )" +
                                    std::to_string(4 * h) + R"(]},
             "boundary_conditions": {"velocity_constraints": [
               {"nset": "all", "dir": "y", "velocity": 0},
               {"nset": "ends", "dir": "x", "velocity": 0}]}},
    "sets": {"nodes": {
      "all": {"box": {"min": [-1, -1], "max": [2, 2]}},
      "ends": {"union": [{"half_space": {"point": [0, 0], "normal": [1, 0]}},
                         {"half_space": {"point": [1, 0], "normal": [-1, 0]}}]}}},
    "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 100,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
                                 "region": {"box": {"min": [0, 0], "max": [1, 1]}}}}],
    "analysis": {"mpm_scheme": ")" + wave.scheme +
                                    R"(", "shape_functions": ")" + wave.functions + R"(",
                 "dt": )" + std::to_string(wave.step * h / c) +
                                    R"(, "end_time": 1, )" + settings + "}}");
  for (const Vec<2>& x : model.particles.x)
    model.particles.velocity.push_back(Vec<2>(1e-3 * std::sin(2 * pi * x[0] / length), 0.0));
  return model;
}

/// Rate at which its energy falls [1/s], over two periods.
double decay(const Wave& wave) {
  Model<2> model = standing_wave(wave);
  const double dt = model.analysis.step.dt, until = 2 * length / c;
  Simulation<2> simulation(std::move(model));
  const HistoryRow start = simulation.history();
  simulation.advance(static_cast<Index>(std::lround(until / dt)));
  const HistoryRow end = simulation.history();
  return -std::log((end.kinetic + end.internal) / start.kinetic) / end.time;
}

}  // namespace

TEST_CASE("probe") {
  for (const std::string functions : {"element", "uniform_gimp", "quadratic_spline"})
    for (const int cells : {16, 32})
      for (const int order : {1, 2, 3}) {
        const double h = length / cells, q = 2 * pi / length;
        const double variance = functions == "quadratic_spline" ? 0.25 : 0.1875;
        const double mu = std::pow(q * q * h * h * variance, order), time = mu / 2;  // [s]
        for (const std::string scheme : {"usf", "usl", "musl"}) {
          printf("%s %d order %d %s time %g:", functions.c_str(), cells, order, scheme.c_str(), time);
          for (const double step : {0.2, 0.1, 0.05}) {
            Wave w{cells, functions, scheme, "xpic", order, time, step};
            const double with = decay(w);
            w.relaxation_time = 0;
            printf("  %.4f (flip %.4f)", with, decay(w));
          }
          printf("\n");
        }
      }
}
