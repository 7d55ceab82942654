// Mohr-Coulomb at and around the apex of its cone.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "physics/materials/law.h"

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
