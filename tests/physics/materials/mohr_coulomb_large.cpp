// Mohr-Coulomb in increments of many times the yield strain, as implicit steps take them.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "physics/materials/tangent.h"
#include "tests/physics/materials/largest_jump.h"
#include "tests/physics/materials/random_increments.h"

using namespace lahar;

namespace {

/// The largest tension of shear alone, cohesion cot(friction) [Pa].
double apex_of(const MohrCoulomb& law) {
  return law.cohesion / std::tan(law.friction * std::numbers::pi / 180);
}

/// Soils with and without cohesion, dilation and tension, up to that of the apex; clay.
std::vector<MohrCoulomb> soils() {
  const MohrCoulomb soil{.youngs_modulus = 2e7,
                         .poisson_ratio = 0.3,
                         .friction = 20,
                         .dilation = 0,
                         .cohesion = 2e4,
                         .tension_cutoff = 2e3};
  std::vector<MohrCoulomb> all(7, soil);
  all[1].dilation = 20;
  all[2].tension_cutoff = 0;
  all[3].tension_cutoff = apex_of(soil);
  all[4].dilation = 7, all[4].friction = 38, all[4].cohesion = 1;  // nearly sand
  all[4].tension_cutoff = 0;
  all[5].cohesion = all[5].tension_cutoff = 0, all[5].dilation = 5;
  all[6].friction = 0;
  return all;
}

std::string described(const MohrCoulomb& law) {
  return fmt::format("friction {}, dilation {}, cohesion {}, cut-off {}", law.friction,
                     law.dilation, law.cohesion, law.tension_cutoff);
}

struct State {
  std::array<double, 4> stress{};
  std::array<double, most_state> q{};
};

using Gradient = std::array<double, 4>;

Gradient random_gradient(std::mt19937& random, double size) {
  std::normal_distribution<double> number;
  Gradient H;
  for (double& h : H) h = size * number(random);
  return H;
}

/// After an increment, of implicit steps (`far`) or of explicit ones.
State after(const MohrCoulomb& law, const State& begin, const Gradient& H, bool far = true) {
  const double rows[2][2] = {{H[0], H[1]}, {H[2], H[3]}};
  StressChange<2> to{};
  const Failures failures = stress_change<2>(prepare(law), rows, 0.5, {.linear_strain = !far},
                                             begin.stress.data(), begin.q.data(), to);
  CHECK(failures.failed == 0);
  CHECK(failures.divided == 0);
  State end = begin;
  std::copy_n(to.stress.begin(), 4, end.stress.begin());
  std::copy_n(to.state.begin(), MohrCoulomb::state.size(), end.q.begin());
  return end;
}

/// A random stress that the law allows.
State random_state(std::mt19937& random, const MohrCoulomb& law) {
  std::normal_distribution<double> number;
  State any;
  law.initial_state(nullptr, any.q.data());
  const double p = -3e4 * std::abs(number(random));
  for (std::size_t k = 0; k < 4; ++k) any.stress[k] = (k < 3 ? p : 0) + 1e4 * number(random);
  return after(law, any, {});
}

}  // namespace

TEST_CASE(
    "Mohr-Coulomb in large increments: the stress is a continuous function of the increment") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number;
  for (const MohrCoulomb& law : soils()) {
    CAPTURE(described(law));
    for (int line = 0; line < 40; ++line) {
      const State begin = random_state(random, law);
      const double size = std::pow(10.0, -5 + 3 * number(random));
      const Gradient from = random_gradient(random, size), along = random_gradient(random, size);
      const auto at = [&](double t) {
        Gradient H;
        for (std::size_t k = 0; k < 4; ++k) H[k] = from[k] + t * along[k];
        return after(law, begin, H);
      };
      const auto [low, high] = test::where_it_changes_most(at, 24, 8);
      // A line of 1e-11 of its length.
      const double elastic = 10 * law.wave_modulus() * size * (high - low);
      CHECK(test::stress_difference(at(low), at(high)) < 100 * elastic + 1e-6);
    }
  }
}

TEST_CASE("Mohr-Coulomb in small increments: implicit steps end where explicit ones do") {
  std::mt19937 random(4);
  for (const MohrCoulomb& law : soils()) {
    CAPTURE(described(law));
    for (int path = 0; path < 10; ++path) {
      const State begin = random_state(random, law);
      constexpr int steps = 2000;
      const Gradient H = random_gradient(random, 5e-3 / steps);
      State far = begin, near = begin;
      for (int k = 0; k < steps; ++k) {
        far = after(law, far, H);
        near = after(law, near, H, false);
      }
      // Torn sand has no stress but for a part of an increment's.
      const double increment = law.wave_modulus() * 5e-3 / steps;
      double size = 0;
      for (const double s : near.stress) size = std::max(size, std::abs(s));
      CHECK(test::stress_difference(far, near) < 0.01 * size + increment);
      // At the apex explicit steps go from sector to sector, and count strain on each way.
      if (test::mises(near.stress.data()) < 0.01 * size + increment) continue;
      CHECK(std::abs(far.q[6] - near.q[6]) <= 0.01 * near.q[6]);
    }
  }
}
