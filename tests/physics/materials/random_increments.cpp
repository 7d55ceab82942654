// No increment is too small, too large or too near to an apex for a law.
#include "tests/physics/materials/random_increments.h"

#include <doctest/doctest.h>

#include "physics/materials/law.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <class LawType, int Dim>
void check(std::int64_t increments, bool large = false) {
  CAPTURE(LawType::name);
  const RandomIncrements found = RandomPaths<LawType, Dim>(1, 1, false, large).run(increments);
  INFO(found.first);
  CHECK(found.failed == 0);
  CHECK(found.not_finite == 0);
  CHECK(found.not_allowed == 0);
  CHECK(found.unhardened == 0);
}

template <class LawType, int Dim>
void check_widths(std::int64_t increments) {
  CAPTURE(LawType::name);
  CHECK(RandomPaths<LawType, Dim>(2, 1, true).run(increments).unlike == 0);
}

/// One increment of a particle without stress.
template <class LawType>
Voigt after(const LawType& law, const Voigt& strain, double* state) {
  Voigt stress{};
  const auto prepared = prepare(law);
  CHECK(update_in_parts(prepared, Increment{strain, 1e-4, 0}, stress, state) == 1);
  return stress;
}

}  // namespace

TEST_CASE("every law answers random increments with a finite stress that it allows") {
  check<MohrCoulomb, 2>(1'000'000);
  check<MohrCoulomb, 3>(1'000'000);
  check<DruckerPrager, 2>(1'000'000);
  check<DruckerPrager, 3>(1'000'000);
  check<VonMises, 3>(1'000'000);
  check<Newtonian, 3>(1'000'000);
  check<Bingham, 3>(1'000'000);
  check<LinearElastic, 3>(1'000'000);
  check<NeoHookean, 3>(1'000'000);
  check<ModifiedCamClay, 3>(20'000);
  check<NorSand, 3>(5'000);
}

TEST_CASE("laws whose implicit steps are others answer random increments of these, too") {
  check<MohrCoulomb, 2>(100'000, true);
  check<MohrCoulomb, 3>(100'000, true);
  check<ModifiedCamClay, 3>(5'000, true);
  check<NorSand, 3>(1'000, true);
}

TEST_CASE("a particle gets the same bits from its law in a pack of any width") {
  check_widths<MohrCoulomb, 2>(100'000);
  check_widths<MohrCoulomb, 3>(100'000);
  check_widths<DruckerPrager, 2>(100'000);
  check_widths<DruckerPrager, 3>(100'000);
  check_widths<VonMises, 2>(100'000);
  check_widths<VonMises, 3>(100'000);
  check_widths<Newtonian, 3>(100'000);
  check_widths<Bingham, 3>(100'000);
  check_widths<LinearElastic, 3>(100'000);
  check_widths<NeoHookean, 2>(100'000);
  check_widths<NeoHookean, 3>(100'000);
  check_widths<ModifiedCamClay, 3>(5'000);
  check_widths<NorSand, 3>(1'000);
}

TEST_CASE("without cohesion Mohr-Coulomb is the same for stresses of any size") {
  MohrCoulomb sand{};
  sand.youngs_modulus = 1e7;
  sand.poisson_ratio = 0.3;
  sand.friction = 30;
  sand.dilation = 5;
  const Voigt strain{-3e-4, 1e-4, -2e-4, 2.5e-4, -1e-4, 3e-4};
  double state[7]{};
  sand.initial_state(nullptr, state);
  const Voigt whole = after(sand, strain, state);
  for (const double size : {1e-9, 1e-15, 1e-25, 1e-35}) {
    Voigt small = strain;
    for (double& e : small) e *= size;
    sand.initial_state(nullptr, state);
    state[6] = 0;
    const Voigt stress = after(sand, small, state);
    for (std::size_t k = 0; k < 6; ++k) CHECK(stress[k] == within(1e-9, size * whole[k]));
  }
}

TEST_CASE("the initial stress of a fluid is its pressure, but not as in CB-Geo MPM") {
  const Voigt given{-1200, -1200, -1200, 0, 0, 0};
  Newtonian water{.bulk_modulus = 2e6, .dynamic_viscosity = 1};
  Bingham mud{
      .youngs_modulus = 1e6, .poisson_ratio = 0.3, .tau0 = 10, .mu = 1, .critical_shear_rate = 0.1};
  const auto pressure = [&](const Law& law) {
    double state[most_state];
    initial_state(law, given, state);
    return state[0];
  };
  CHECK(pressure(water) == doctest::Approx(1200));
  CHECK(pressure(mud) == doctest::Approx(1200));
  water.as_cbgeo = mud.as_cbgeo = true;
  CHECK(pressure(water) == 0);
  CHECK(pressure(mud) == 0);
}
