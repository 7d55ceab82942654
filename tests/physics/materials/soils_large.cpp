// Critical state soils in the increments of implicit steps, however large.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "physics/materials/law.h"
#include "physics/materials/soil_stress.h"
#include "physics/materials/tangent.h"
#include "tests/physics/materials/largest_jump.h"
#include "tests/physics/materials/material_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

std::vector<Law> soils() {
  auto clay = sample_of<ModifiedCamClay>();
  clay.e_ref = 1.12;
  clay.pc0 = 2e5;
  clay.ocr = 1.2;
  ModifiedCamClay rounded = clay;
  rounded.three_invariants = true;
  auto sand = sample_of<NorSand>();
  sand.p_image_initial = 87014.6;
  return {clay, rounded, sand};
}

struct Soil {
  std::array<double, 4> stress{};
  std::array<double, most_state> q{};
};
using Gradient = std::array<double, 4>;

Soil after(const Law& law, const Soil& begin, const Gradient& H, bool far = true) {
  const double rows[2][2] = {{H[0], H[1]}, {H[2], H[3]}};
  StressChange<2> to{};
  const Failures failures = stress_change<2>(law, rows, 0.5, {.linear_strain = !far},
                                             begin.stress.data(), begin.q.data(), to);
  CHECK(failures.failed == 0);
  const auto variables = state_variables(law);
  Soil end = begin;
  std::copy_n(to.stress.begin(), 4, end.stress.begin());
  for (std::size_t k = 0; k < variables.size(); ++k)
    if (!variables[k].of_stress) end.q[k] = to.state[k];
  return end;
}

Soil at_pressure(const Law& law, double p) {
  Soil soil{.stress = {-p, -p, -p, 0}};
  const Voigt six{-p, -p, -p, 0, 0, 0};
  initial_state(law, six, soil.q.data());
  return soil;
}

Gradient random_gradient(std::mt19937& random, double size) {
  std::normal_distribution<double> number;
  Gradient H;
  for (double& h : H) h = size * number(random);
  return H;
}

}  // namespace

// An increment that is divided when an estimate of its error passes a bound ends elsewhere than one
// that is not: Newton's method then goes to and fro between the two.
TEST_CASE("critical state soils in large increments: the stress is a continuous function of them") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> number;
  constexpr double p = 1e5;
  for (const Law& law : soils()) {
    // Beyond 6e-3 NorSand's inner cap, on or not in one of the parts, makes jumps of 1e-3 of p.
    const double decades = std::holds_alternative<NorSand>(law) ? 1.6 : 2.0;
    for (int line = 0; line < 30; ++line) {
      const Soil begin = after(law, at_pressure(law, p), random_gradient(random, 2e-3));
      const double size = std::pow(10.0, -4 + decades * number(random));
      const Gradient from = random_gradient(random, size), along = random_gradient(random, size);
      const auto at = [&](double t) {
        Gradient H;
        for (std::size_t k = 0; k < 4; ++k) H[k] = from[k] + t * along[k];
        return after(law, begin, H);
      };
      const auto [low, high] = test::where_it_changes_most(at, 16, 6);
      // A line of 1e-7 of its length.
      CHECK(test::stress_difference(at(low), at(high)) < 1e3 * p * size * (high - low) + 1e-9 * p);
    }
  }
}

TEST_CASE("critical state soils: a large increment ends within 1 % of a thousand small ones") {
  std::mt19937 random(12);
  constexpr double p = 1e5;
  for (const Law& law : soils())
    for (const double size : {1e-4, 1e-3, 5e-3}) {
      CAPTURE(size);
      for (int path = 0; path < 5; ++path) {
        const Soil begin = at_pressure(law, p);
        Gradient H = random_gradient(random, size);
        H[2] = H[1];  // no rotation, which would turn stresses by some per cent of the increment
        const Soil once = after(law, begin, H);
        Gradient part = H;
        for (double& h : part) h /= 1000;
        Soil often = begin;
        for (int i = 0; i < 1000; ++i) often = after(law, often, part, false);
        double largest = 0;
        for (const double s : often.stress) largest = std::max(largest, std::abs(s));
        CHECK(test::stress_difference(once, often) < 0.01 * largest);
      }
    }
}

// What an iteration of Newton's method tears apart must not take a million of them.
TEST_CASE("critical state soils: an increment that no number of steps follows takes some hundred") {
  long steps = 0;
  const auto take = [&](const auto&, auto& stress, auto*) {
    stress[0] += static_cast<double>(++steps);
    return true;
  };
  const Voigt before{-1e5, -1e5, -1e5, 0, 0, 0};
  Voigt stress = before;
  double state[1] = {1};
  CHECK_FALSE(smooth_steps<1>(take, Voigt{1, 0, 0, 0, 0, 0}, 1e-3, stress, state));
  CHECK(steps <= 2 * most_smooth_steps);
  CHECK(stress == before);
  CHECK(state[0] == 1);
}
