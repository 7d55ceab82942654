// What follows from the porosity of a skeleton whose pores hold a liquid.
#include <doctest/doctest.h>

#include <cmath>

#include "physics/materials/law.h"
#include "tests/within.h"

using namespace lahar;

namespace {

PoreLiquid water_in_sand() {
  return {.density = 1000,
          .bulk_modulus = 2.2e9,
          .grain_density = 2650,
          .porosity = 0.4,
          .resistance = {9.81e6, 9.81e7, 9.81e5}};
}

}  // namespace

TEST_CASE("grains keep their volume: the porosity follows from that of the particle") {
  const Pores pores(water_in_sand());
  const double V = 2e-3, m = 2650 * 0.6 * V;
  CHECK(pores.porosity(Scalar(m), Scalar(V))[0] == doctest::Approx(0.4));
  for (const double J : {0.7, 0.9, 1.3, 2.0}) {
    CAPTURE(J);
    const double n = pores.porosity(Scalar(m), Scalar(J * V))[0];
    CHECK((1 - n) * J == doctest::Approx(0.6));
    CHECK(pores.liquid_mass(Scalar(m), Scalar(J * V))[0] == doctest::Approx(1000 * n * J * V));
  }
  // Beyond the volume of the grains there is no meaning, and no division by zero.
  CHECK(pores.porosity(Scalar(m), Scalar(0.5 * V))[0] == least_porosity);
}

TEST_CASE("as in the reference code a particle keeps the liquid of the beginning") {
  PoreLiquid liquid = water_in_sand();
  liquid.constant_mass = true;
  const double V = 2e-3, m = 2650 * 0.6 * V;
  for (const double J : {0.8, 1.0, 1.2})
    CHECK(Pores(liquid).liquid_mass(Scalar(m), Scalar(J * V))[0] ==
          doctest::Approx(1000 * 0.4 * V));
}

TEST_CASE("permeability goes with the porosity as Kozeny and Carman say") {
  const PoreLiquid liquid = water_in_sand();
  const Pores pores(liquid);
  const double V = 1e-3, m = 2650 * 0.6 * V;
  const auto permeability = [](double n) { return n * n * n / ((1 - n) * (1 - n)); };
  for (const double J : {0.8, 1.0, 1.5}) {
    CAPTURE(J);
    const double n = 1 - 0.6 / J;
    CHECK(pores.drag_volume(Scalar(m), Scalar(J * V))[0] ==
          test::within(1e-5, n * n * J * V * permeability(0.4) / permeability(n)));
  }
}

TEST_CASE("the fastest wave of skeleton and liquid is the largest eigenvalue of their stiffness") {
  for (const double n : {0.05, 0.3, 0.4, 0.8})
    for (const double M : {1e5, 1e8, 5e10}) {
      CAPTURE(n);
      CAPTURE(M);
      PoreLiquid liquid = water_in_sand();
      liquid.porosity = n;
      const double K = liquid.bulk_modulus;
      const double solid = (1 - n) * liquid.grain_density, fluid = n * liquid.density;
      // Stresses by strains of both phases: p = -K / n ((1 - n) e + n e_l).
      const double a = (M + K * (1 - n) * (1 - n) / n) / solid, d = K * n / fluid;
      const double bc = K * (1 - n) / solid * (K * (1 - n) / fluid);
      const double fastest = wave_speed_squared(liquid, M, Scalar(1 / solid))[0];
      CHECK((a - fastest) * (d - fastest) == doctest::Approx(bc));
      CHECK(fastest > 0.5 * (a + d));  // not the other one
      // Drag that ties the phases together only makes it slower.
      const double undrained = (M + K / n) / (solid + fluid);
      CHECK(fastest >= undrained);
    }
}

TEST_CASE("a material with a liquid in its pores has the wave speed of both") {
  Material material;
  material.law = LinearElastic{1e7, 0.2};
  material.density = 0.6 * 2650;
  const double dry = wave_speed(material);
  CHECK(dry == doctest::Approx(std::sqrt(wave_modulus(material.law) / material.density)));
  material.liquid = water_in_sand();
  CHECK(wave_speed(material) > 1482);  // of water alone
}
