// A bar that lies across the grid is pulled to three times its length. Of a neo-Hookean material
// without lateral strain (nu = 0) its stress is then
//   sigma = E / 2 (lambda^2 - 1) / lambda along the bar, 4/3 E at lambda = 3,
// and nothing across it. Particles move apart by more than a cell: functions that do not know how
// far a particle reaches, or only along the axes of the grid, let the bar fall apart.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "physics/error.h"
#include "tests/verification/case.h"

using namespace lahar;
using namespace lahar::verification;

namespace {

constexpr double E = 1e5, stretch = 3, duration = 2;
constexpr double length = 0.8;  ///< between the grips [m]

/// The bar at 45 degrees around the middle of the mesh. Grips of 0.1 m at its ends move apart evenly;
/// they are heavy, so that forces do not move their nodes between two steps.
Model<2> bar(const std::string& functions) {
  Model<2> model = model_of_text<2>(R"({
    "mesh": {"structured": {"cell_size": 0.05, "extent": [3, 3]}},
    "materials": [{"type": "NeoHookean", "density": 1000, "youngs_modulus": 1e5,
                   "poisson_ratio": 0},
                  {"type": "NeoHookean", "density": 1e5, "youngs_modulus": 1e5,
                   "poisson_ratio": 0}],
    "particles": [{"generator": {"type": "region", "per_cell": 2, "material": 0,
      "region": {"intersection": [
        {"half_space": {"point": [1.85355, 1.85355], "normal": [1, 1]}},
        {"half_space": {"point": [1.14645, 1.14645], "normal": [-1, -1]}},
        {"half_space": {"point": [1.42929, 1.57071], "normal": [-1, 1]}},
        {"half_space": {"point": [1.57071, 1.42929], "normal": [1, -1]}}]}}}],
    "analysis": {"mpm_scheme": "usl", "dt": 5e-4, "end_time": 2, "shape_functions": ")" +
                                  functions + R"(", "damping": {"type": "Cundall",
                   "damping_factor": 0.02}}})");
  const double speed = (stretch - 1) * length / 2 / duration / std::sqrt(2.0);
  ParticleVelocity grips[2][2];
  for (const int end : {0, 1})
    for (const int d : {0, 1})
      grips[end][d] = {.particles = {}, .dir = d, .velocity = end == 0 ? -speed : speed};
  for (std::size_t p = 0; p < model.particles.x.size(); ++p) {
    const Vec<2> r = model.particles.x[p] - Vec<2>(1.5, 1.5);
    const double share = (r[0] + r[1]) / std::sqrt(2.0) / (length / 2);
    model.particles.velocity.push_back(Vec<2>(1, 1) * speed * std::clamp(share, -1.0, 1.0));
    if (std::abs(share) < 1) continue;
    model.particles.material[p] = 1;
    for (const int d : {0, 1}) grips[share > 0][d].particles.push_back(static_cast<Index>(p));
  }
  for (const auto& end : grips)
    for (const auto& grip : end) model.particle_velocities.push_back(grip);
  return model;
}

/// Stress along the bar and across it in its middle third, over E.
struct Stress {
  double along, across;
};

Stress stress_of(const std::string& functions) try {
  const Model<2> model = bar(functions);
  Simulation<2> simulation(model);
  const State start(simulation.frame());
  simulation.run();
  const State end(simulation.frame());
  const auto middle = [&](Index p) {
    return std::abs(end.x(p, 0) + end.x(p, 1) - 3) / std::sqrt(2.0) < 0.5;
  };
  const auto of = [&](double sign) {
    return mean(end, middle, [&](Index p) {
             return 0.5 * (end.get("stress", p, 0) + end.get("stress", p, 1)) +
                    sign * end.get("stress", p, 3);
           }) / E;
  };
  const Stress stress{of(1), of(-1)};
  MESSAGE(functions << ": " << stress.along << " along, " << stress.across << " across");
  return stress;
} catch (const SimulationError&) {  // cells collapse
  return {0, 0};
}

}  // namespace

TEST_CASE("a bar pulled to three times its length holds with CPDI and CPDI2, and with no other") {
  const double exact = 0.5 * (stretch * stretch - 1) / stretch;
  for (const char* functions : {"cpdi", "cpdi2"}) {
    const Stress stress = stress_of(functions);
    CHECK(stress.along == doctest::Approx(exact).epsilon(0.1));
    CHECK(std::abs(stress.across) < 0.05 * exact);
  }
  for (const char* functions : {"element", "uniform_gimp", "gimp"})
    CHECK(stress_of(functions).along < 0.5 * exact);
}
