// Mohr-Coulomb at and around the apex of its cone.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "physics/materials/law.h"
#include "tests/within.h"

using namespace lahar;

TEST_CASE("sand without cohesion bears any increment, also from zero stress, and no tension") {
  MohrCoulomb sand{};
  sand.youngs_modulus = 1e6;
  sand.poisson_ratio = 0.3;
  sand.friction = 31;
  const auto law = prepare(sand);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (int path = 0; path < 400; ++path) {
    const double size = std::pow(10.0, -9 + path % 8);
    const double pressure = path % 3 == 0 ? 0.0 : std::pow(10.0, path % 5);
    Voigt stress{-pressure, -pressure, -pressure, 0, 0, 0};
    double state[7]{};
    sand.initial_state(stress.data(), state);
    for (int step = 0; step < 30; ++step) {
      Increment increment{{}, 1e-4, 0};
      for (std::size_t k = 0; k < 6; ++k) increment.strain[k] = size * normal(random);
      REQUIRE(update_in_parts(law, increment, stress, state) == 1);
      const double mean = (stress[0] + stress[1] + stress[2]) / 3;
      CHECK(mean <= 1e-9 * 1e6 * size);
    }
  }
}

TEST_CASE("sand without dilation that is sheared at the mean stress of its apex ends there") {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  for (const double friction : {2.0, 22.0, 30.0, 45.0, 60.0})
    for (const double cohesion : {0.0, 100.0}) {
      CAPTURE(friction);
      CAPTURE(cohesion);
      MohrCoulomb sand{};
      sand.youngs_modulus = 1e6;
      sand.poisson_ratio = 0.3;
      sand.friction = friction;
      sand.cohesion = cohesion;
      sand.tension_cutoff = cohesion / std::tan(friction * std::numbers::pi / 180);
      const auto law = prepare(sand);
      for (int trial = 0; trial < 100; ++trial) {
        const double apex = sand.tension_cutoff, size = std::pow(10.0, -9 + trial % 7);
        Voigt stress{apex, apex, apex, 0, 0, 0};
        double state[7]{};
        sand.initial_state(stress.data(), state);
        Increment increment{{}, 1e-4, 0};
        Voigt& e = increment.strain;
        for (double& component : e) component = size * normal(random);
        const double mean = (e[0] + e[1] + e[2]) / 3;
        for (std::size_t k = 0; k < 3; ++k) e[k] -= mean;
        REQUIRE(update_in_parts(law, increment, stress, state) == 1);
        const double scale = 1e6 * size + apex;
        for (std::size_t k = 0; k < 6; ++k)
          CHECK(std::abs(stress[k] - (k < 3 ? apex : 0.0)) < 1e-11 * scale);
        // All of the strain is plastic.
        const double square = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] +
                              0.5 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5]);
        CHECK(state[6] == test::within(1e-9, std::sqrt(2.0 / 3 * square)));
      }
    }
}
