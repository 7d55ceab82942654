// The example of CONTRIBUTING.md is a material: it compiles, and does what it says.
#include "tests/contributing.h"

#include <doctest/doctest.h>

#include <cmath>

#include "physics/materials/materials.h"
#include "tests/physics/materials/contributing_example.h"
#include "tests/within.h"

using namespace lahar;

TEST_CASE("the material of CONTRIBUTING.md is the one that is compiled here") {
  CHECK(test::contributing_has("tests/physics/materials/contributing_example.h"));
}

TEST_CASE("the material of CONTRIBUTING.md is a law, and its shear stress relaxes") {
  static_assert(MaterialLaw<Maxwell>);
  const Maxwell law{.youngs_modulus = 1000, .poisson_ratio = 0.25, .relaxation_time = 2};
  LawInput<3, Scalar> in;
  for (Scalar& rate : in.rate) rate = Scalar(0.0);
  in.rate[3] = Scalar(0.01 / 1e-9);
  in.dt = 1e-9;
  in.volumetric = 0;
  Scalar stress[6], state[1] = {Scalar(0.0)};
  for (Scalar& s : stress) s = Scalar(-5.0);
  stress[3] = Scalar(0.0);
  stress[4] = stress[5] = Scalar(0.0);
  update(law, in, stress, state);
  CHECK(stress[3][0] == doctest::Approx(400 * 0.01));
  in.rate[3] = Scalar(0.0);
  in.dt = 1e-3;
  for (int step = 0; step < 2000; ++step) update(law, in, stress, state);
  CHECK(stress[3][0] == test::within(1e-3, 4 * std::exp(-1)));
  CHECK(stress[0][0] == doctest::Approx(-5));
  // The elastic strain that is gone has become viscous: sqrt(2/3 e:e) of a shear g is g / sqrt(3).
  CHECK(state[0][0] == test::within(1e-3, 0.01 / std::sqrt(3) * (1 - std::exp(-1))));
}
