// A thousand million random increments of the laws, without one that fails.
#include <doctest/doctest.h>

#include "tests/physics/materials/random_increments.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// One of 16 increments is looked at for what the law allows, all for failures.
template <class LawType, int Dim>
void check(std::int64_t increments, bool large = false) {
  CAPTURE(LawType::name);
  const RandomIncrements found = RandomPaths<LawType, Dim>(7, 16, false, large).run(increments);
  MESSAGE(LawType::name, ": ", found.done, " increments, ", found.divided, " in parts, worst ",
          found.worst);
  INFO(found.first);
  CHECK(found.failed == 0);
  CHECK(found.not_finite == 0);
  CHECK(found.not_allowed == 0);
  CHECK(found.unhardened == 0);
}

}  // namespace

TEST_CASE("a thousand million random increments of the laws do not fail") {
  check<MohrCoulomb, 3>(200'000'000);
  check<MohrCoulomb, 2>(100'000'000);
  check<DruckerPrager, 3>(100'000'000);
  check<DruckerPrager, 2>(100'000'000);
  check<VonMises, 3>(100'000'000);
  check<Newtonian, 3>(100'000'000);
  check<Bingham, 3>(100'000'000);
  check<LinearElastic, 3>(100'000'000);
  check<NeoHookean, 3>(100'000'000);
  check<ModifiedCamClay, 3>(1'000'000);
  check<NorSand, 3>(250'000);
}

TEST_CASE("random increments of implicit steps do not fail") {
  check<MohrCoulomb, 3>(20'000'000, true);
  check<MohrCoulomb, 2>(20'000'000, true);
  check<ModifiedCamClay, 3>(500'000, true);
  check<NorSand, 3>(100'000, true);
}
