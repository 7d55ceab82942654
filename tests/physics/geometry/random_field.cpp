#include "physics/geometry/random_field.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/within.h"

using namespace lahar;

namespace {

template <int Dim>
using Correlation = typename RandomField<Dim>::Correlation;

/// Mean over many fields of xi(x) xi(x + t).
template <int Dim>
double correlation_at(const Vec<Dim>& length, Correlation<Dim> kind, const Vec<Dim>& t) {
  constexpr int fields = 400, places = 25;
  double sum = 0;
  for (int seed = 0; seed < fields; ++seed) {
    const RandomField<Dim> xi(static_cast<std::uint64_t>(seed), length, kind);
    for (int k = 0; k < places; ++k) {
      Vec<Dim> x = Vec<Dim>::Zero();
      x[0] = 7.0 * k * length[0];  // independent of each other
      sum += xi(x) * xi(Vec<Dim>(x + t));
    }
  }
  return sum / (fields * places);
}

/// Four standard errors of a mean of 10000 products.
constexpr double tolerance = 0.05;

}  // namespace

TEST_CASE("a random field has mean 0, deviation 1 and the tails of a normal distribution") {
  double mean = 0, square = 0, fourth = 0, beyond = 0;
  constexpr int fields = 300, places = 200;
  for (int seed = 0; seed < fields; ++seed) {
    const RandomField<3> xi(static_cast<std::uint64_t>(seed), Vec<3>(2, 3, 1),
                            RandomField<3>::Correlation::gaussian);
    for (int k = 0; k < places; ++k) {
      const double value = xi(Vec<3>(5.0 * k, -3.0 * k, 11.0 * k));
      mean += value;
      square += value * value;
      fourth += std::pow(value, 4);
      beyond += value > 2 ? 1 : 0;
    }
  }
  constexpr double n = fields * places;
  CHECK(std::abs(mean / n) < 0.02);
  CHECK(square / n == test::within(0.03, 1));
  CHECK(fourth / n == test::within(0.06, 3));
  CHECK(beyond / n == test::within(0.15, 0.02275));
}

TEST_CASE("the correlation of a random field falls with the distance as its kind says") {
  constexpr double pi = std::numbers::pi;
  const Vec<2> length(20, 2);
  for (const double share : {0.0, 0.25, 0.5, 1.0}) {
    CAPTURE(share);
    for (int d = 0; d < 2; ++d) {
      const Vec<2> t = share * length[d] * Vec<2>::Unit(d);
      CHECK(std::abs(correlation_at<2>(length, Correlation<2>::gaussian, t) -
                     std::exp(-pi * share * share)) < tolerance);
      CHECK(std::abs(correlation_at<2>(length, Correlation<2>::exponential, t) -
                     std::exp(-2 * share)) < tolerance);
    }
  }
  const Vec<3> t(0.3, 0.4, 0.2);
  CHECK(std::abs(correlation_at<3>(Vec<3>(1, 2, 0.5), Correlation<3>::gaussian, t) -
                 std::exp(-pi * (0.09 + 0.04 + 0.16))) < tolerance);
}

TEST_CASE("a random field follows from its seed and the place alone") {
  const auto field = [](std::uint64_t seed) {
    return RandomField<2>(seed, Vec<2>(1, 1), RandomField<2>::Correlation::exponential);
  };
  const RandomField<2> one = field(5), same = field(5), other = field(6);
  for (const Vec<2>& x : {Vec<2>(0, 0), Vec<2>(1e4, -3), Vec<2>(0.1, 0.7)}) {
    CHECK(one(x) == same(x));
    CHECK(one(x) != other(x));
  }
}
