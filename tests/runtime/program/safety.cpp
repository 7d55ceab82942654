// The search for a factor of safety, and the strength that it divides.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "physics/materials/strength.h"
#include "runtime/program/safety_run.h"

using namespace lahar;

TEST_CASE("the factor of safety is bracketed as narrowly as asked for") {
  for (const double limit : {1.05, 1.4, 2.0, 3.3, 13.0}) {
    const SafetyResult result = find_factor({.most = 16, .tolerance = 0.01}, [&](double factor) {
      return SafetyTrial{.factor = factor, .stable = factor <= limit};
    });
    REQUIRE(result.fails);
    CHECK(result.stable <= limit);
    CHECK(*result.fails > limit);
    CHECK(*result.fails - result.stable <= 0.01 * result.stable);
    CHECK(result.trials.size() < 14);
  }
}

TEST_CASE("a body that never fails has a factor above the bound") {
  const SafetyResult result = find_factor({.most = 5, .tolerance = 0.01}, [](double factor) {
    return SafetyTrial{.factor = factor, .stable = true};
  });
  CHECK_FALSE(result.fails);
  CHECK(result.stable == 5);
  CHECK(result.trials.back().factor == 5);
}

TEST_CASE("strength is divided by a factor, tan(phi) and not phi") {
  MohrCoulomb soil{};
  soil.friction = 30;
  soil.dilation = 25;
  soil.cohesion = 1000;
  soil.tension_cutoff = 200;
  soil.residual_friction = 20;
  soil.residual_cohesion = 100;
  Law law = soil;
  REQUIRE(reduce_strength(law, 2.0));
  const auto& reduced = std::get<MohrCoulomb>(law);
  constexpr double radian = std::numbers::pi / 180;
  CHECK(std::tan(reduced.friction * radian) == doctest::Approx(std::tan(30 * radian) / 2));
  CHECK(std::tan(reduced.residual_friction * radian) == doctest::Approx(std::tan(20 * radian) / 2));
  CHECK(reduced.cohesion == 500);
  CHECK(reduced.residual_cohesion == 50);
  CHECK(reduced.tension_cutoff == 100);
  CHECK(reduced.dilation == reduced.friction);
  CHECK(reduced.problem().empty());

  Law metal = VonMises{.youngs_modulus = 1, .poisson_ratio = 0, .yield_stress = 6};
  REQUIRE(reduce_strength(metal, 3.0));
  CHECK(std::get<VonMises>(metal).yield_stress == 2);
  Law elastic = LinearElastic{};
  CHECK_FALSE(reduce_strength(elastic, 2.0));
}
