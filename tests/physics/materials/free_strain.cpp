// The strain for which a component of stress is zero.
#include "physics/materials/free_strain.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace lahar;

namespace {

/// The strain that is found for a stress of about 1 Pa, with the modulus 1e3 Pa.
template <class Stress>
double free_strain_of(Stress stress) {
  const auto of = [&](const Scalar& e, unsigned) { return Scalar(stress(e[0])); };
  return strain_without_stress<Scalar>(1u, 1e3, Scalar(1.0), of)[0];
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
