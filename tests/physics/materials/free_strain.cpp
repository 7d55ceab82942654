// The strain for which a component of stress is zero.
#include "physics/materials/free_strain.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "physics/materials/tangent_across.h"
#include "tests/physics/materials/material_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// The strain that is found for a stress of about 1 Pa, with a modulus [Pa].
template <class Stress>
double free_strain_of(Stress stress, double modulus = 1e3) {
  const auto of = [&](const Scalar& e, unsigned) { return Scalar(stress(e[0])); };
  return strain_without_stress<Scalar>(1u, Scalar(modulus), Scalar(1.0), of)[0];
}

}  // namespace

TEST_CASE("a strain without stress: elastic, after a kink, and on a limit") {
  CHECK(std::abs(free_strain_of([](double e) { return 1e3 * e - 1; }) - 1e-3) < 1e-13);
  const auto kinked = [](double e) { return e < 1e-3 ? 1e3 * e - 1.1 : 1e2 * (e - 2e-3); };
  CHECK(std::abs(free_strain_of(kinked) - 2e-3) < 1e-12);
  const auto limited = [](double e) { return std::min(1e3 * e - 1, 0.0); };
  CHECK(limited(free_strain_of(limited)) == 0);
}

TEST_CASE("a stress that keeps its sign does not extend the strain without bound") {
  // Nearest to zero at a strain of 0.0005; then it falls for ever.
  const auto falls = [](double e) { return -0.5 - std::abs(e - 5e-4) * (e < 5e-4 ? 1e3 : 10); };
  const double e = free_strain_of(falls);
  CHECK(std::abs(e) <= 2);
  CHECK(falls(e) > -0.6);
  // Not a number where the strain is large.
  const auto breaks = [](double strain) { return strain < 3 ? -0.5 : std::nan(""); };
  CHECK(std::abs(free_strain_of(breaks)) <= 2);
}

TEST_CASE("a stress that jumps over zero ends on the side that is nearer to it") {
  const auto jumps = [](double e) { return e < 1.2e-3 ? -0.5 : 0.1; };
  CHECK(jumps(free_strain_of(jumps)) == 0.1);
  const auto back = [](double e) { return e < 1.2e-3 ? -0.1 : 0.5; };
  CHECK(back(free_strain_of(back)) == -0.1);
}

TEST_CASE("a law that is softer now than it can be finds its strain by the present modulus") {
  const auto soft = [](double e) { return 0.1 * e - 1; };
  CHECK(std::abs(free_strain_of(soft, 0.1) - 10) < 1e-9);
  CHECK(std::abs(soft(free_strain_of(soft))) > 0.5);  // beyond what is stiff could need
}

TEST_CASE("a stress that is left across a sheet counts, unless it is small") {
  const auto counts = [](double stress, double scale) {
    return stress_is_left(Scalar(stress), Scalar(scale), 1e6) != 0;
  };
  for (const double sign : {-1.0, 1.0}) {
    CHECK(counts(sign * 2.0, 1e3));        // more than a thousandth of the stresses
    CHECK_FALSE(counts(sign * 0.5, 1e3));  // less
    CHECK(counts(sign * 0.2, 1e-3));       // more than an elastic strain of 1e-7
    CHECK_FALSE(counts(sign * 0.05, 1e-3));
  }
  CHECK_FALSE(counts(std::nan(""), 1e3));  // of which others tell
}

TEST_CASE("sheets of soils under little stress have none across them") {
  for (const Law& law : {Law(sample_of<ModifiedCamClay>()), Law(sample_of<NorSand>())}) {
    CAPTURE(name_of(law));
    const double stress[4] = {-100, -80, 0, 5};  // Pa, where pressures of about 1e4 are yielded at
    std::vector<double> state(most_state);
    initial_state(law, {stress[0], stress[1], stress[2], stress[3], 0, 0}, state.data());
    const Voigt before{stress[0], stress[1], stress[2], stress[3], 0, 0};
    CHECK(wave_moduli(law, before, state.data()).compression < 0.1 * wave_modulus(law));
    double H[3][3] = {{-1e-4, 2e-5, 0}, {0, 3e-5, 0}, {}};
    StressChange<3> to;
    const Failures failures =
        stress_change_across(law, true, H, 1e-3, {}, stress, state.data(), to);
    CHECK(failures.failed == 0);
    CHECK(H[2][2] != 0);
    CHECK(std::abs(to.stress[2]) < 1e-9 * 100);
  }
}
