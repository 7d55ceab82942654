// NorSand in increments that are far too large for one implicit step, and torn apart.
#include <doctest/doctest.h>

#include "physics/materials/norsand.h"
#include "tests/physics/materials/soil_paths.h"
#include "tests/within.h"

using lahar::NorSand;
using lahar::Voigt;
using lahar::test::within;
using Sand = soil::Particle<NorSand>;

namespace {

/// That of the reference's unit tests.
NorSand sand() {
  NorSand m{};
  m.poisson_ratio = 0.3;
  m.reference_pressure = 1000;
  m.friction_cs = 30;
  m.N = 0.3;
  m.lambda = 0.1;
  m.kappa = 0.03;
  m.gamma = 1.3;
  m.chi = 3.5;
  m.hardening_modulus = 200;
  m.void_ratio_initial = 0.85;
  m.p_image_initial = 87014.6;
  return m;
}

}  // namespace

TEST_CASE("NorSand: increments of up to 20 % are divided and end within 2 % of 1,000 steps") {
  const NorSand m = sand();
  for (const double size : {0.01, 0.02, 0.05, 0.1, 0.2}) {
    CAPTURE(size);
    const Voigt shear{-size, size / 2, size / 2, 0, 0, 0}, compression{-size, 0, 0, 0, 0, 0};
    for (const Voigt& strain : {shear, compression}) {
      Sand once(m, soil::isotropic(2e5)), often(m, soil::isotropic(2e5));
      once.strain(strain);
      often.strain(strain, 1000);
      CHECK(once.most_parts > 1);
      CHECK(often.most_parts == 1);
      CHECK(once.p() == within(0.02, often.p()));
      CHECK(std::abs(once.q() - often.q()) < 0.02 * often.p());
    }
  }
}

// What NorSand says of it: K = (1 + e) p / kappa has no memory of how far apart the grains were. A
// limit of the law, of which the guide tells (materials.md).
TEST_CASE("NorSand: torn apart and pressed together by more, sand is weaker than before") {
  const NorSand m = sand();
  for (const int n : {1, 10, 100, 1000}) {
    CAPTURE(n);
    Sand torn(m, soil::isotropic(2e5)), whole(m, soil::isotropic(2e5));
    torn.strain({0.05, 0.05, 0.05, 0, 0, 0}, n);
    torn.strain({-0.06, -0.06, -0.06, 0, 0, 0}, n);
    whole.strain({-0.01, -0.01, -0.01, 0, 0, 0}, n);
    CHECK(torn.p() == within(0.03, 1030));
    CHECK(whole.p() > 2e5);
  }
}

// What follows from the stress is computed after a step; kernels have no value of it before.
TEST_CASE("NorSand: an increment that no step can take does not depend on M_theta of its start") {
  NorSand m = sand();
  m.void_ratio_initial = 1.1;
  m.p_image_initial = 1500;
  const Voigt strain{0.016699202903712185, 0.02858986842944485,   0.001052928376298619,
                     0.002837056858961787, 0.0046862025868061935, 0.011230988652066442};
  const auto after = [&](double M_theta) {
    Voigt sigma = soil::isotropic(2000);
    double state[NorSand::states];
    m.initial_state(sigma.data(), state);
    state[NorSand::M_theta] = M_theta;
    CHECK(lahar::update_in_parts(m, lahar::Increment{strain, 1, 0}, sigma, state) > 1);
    return sigma;
  };
  CHECK(after(std::numeric_limits<double>::infinity()) == after(0));
}
