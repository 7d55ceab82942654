// Bingham fluid against the stresses that CB-Geo MPM's own unit tests hold
// (github.com/cb-geo/mpm, tests/materials/bingham_test.cc).
#include "physics/materials/bingham.h"

#include <doctest/doctest.h>

using namespace lahar;

namespace {

struct Flow {
  double stress[4]{}, pressure = 0;
};

// The reference's particle: a square cell of 4 m, of which the corner of least coordinates moves
// with (u, v), at (0.5, 0.5) from its centre, for one second.
Flow flow(const Bingham& law, double u, double v) {
  constexpr double gradient = -0.75 / 8, at_centre = -1.0 / 8;  // of the corner's function [1/m]
  LawInput<2, Scalar> in{};
  const double rates[4] = {gradient * u, gradient * v, 0, gradient * (u + v)};
  for (int k = 0; k < 4; ++k) in.rate[k] = Scalar(rates[k]);
  in.dt = 1;
  in.volumetric = Scalar(at_centre * (u + v));
  Scalar stress[4], pressure(0.0);
  law.update<2, Scalar>(in, stress, &pressure);
  Flow out;
  for (int k = 0; k < 4; ++k) out.stress[k] = stress[k][0];
  out.pressure = pressure[0];
  return out;
}

}  // namespace

TEST_CASE("Bingham as CB-Geo MPM: stresses frozen in its unit tests") {
  using doctest::Approx;
  Bingham law{.youngs_modulus = 1e7,
              .poisson_ratio = 0.3,
              .tau0 = 771.8,
              .mu = 0.0451,
              .critical_shear_rate = 0.2,
              .as_cbgeo = true};
  const Flow still = flow(law, 0.02, 0.03);  // below the critical rate: pressure alone
  CHECK(still.stress[0] == Approx(-52083.3333333333).epsilon(1e-12));
  CHECK(still.stress[1] == Approx(-52083.3333333333).epsilon(1e-12));
  CHECK(still.stress[2] == 0);  // in 2D; pressure without as_cbgeo
  CHECK(still.stress[3] == 0);

  law.tau0 = law.mu = 200;
  const Flow yielded = flow(law, 2, 3);
  CHECK(yielded.stress[0] == Approx(-5208520.35574006).epsilon(1e-12));
  CHECK(yielded.stress[1] == Approx(-5208613.86694342).epsilon(1e-12));
  CHECK(yielded.stress[2] == 0);
  CHECK(yielded.stress[3] == Approx(-233.778008402801).epsilon(1e-12));
  CHECK(yielded.pressure == Approx(0.625 * law.bulk_modulus()).epsilon(1e-12));

  law.incompressible = true;
  const Flow without_pressure = flow(law, 2, 3);
  CHECK(without_pressure.stress[0] == Approx(-187.0224067222).epsilon(1e-11));
  CHECK(without_pressure.stress[1] == Approx(-280.5336100834).epsilon(1e-11));
  CHECK(without_pressure.stress[3] == Approx(-233.778008402801).epsilon(1e-12));
  CHECK(without_pressure.pressure == 0);

  law.incompressible = law.as_cbgeo = false;
  const Flow physical = flow(law, 2, 3);
  CHECK(physical.stress[0] == yielded.stress[0]);
  CHECK(physical.stress[2] == -physical.pressure);
}
