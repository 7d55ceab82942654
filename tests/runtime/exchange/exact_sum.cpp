#include "runtime/exchange/exact_sum.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <vector>

using namespace lahar;

namespace {

/// Any double that is finite, subnormal ones included.
double any_double(std::mt19937_64& random) {
  const auto value = std::bit_cast<double>(random());
  return std::isfinite(value) ? value : 1.0;
}

double exact(const std::vector<double>& terms) {
  ExactSum sum;
  for (const double term : terms) sum += term;
  return sum.value();
}

}  // namespace

TEST_CASE("the exact sum of two doubles is rounded as the machine rounds their sum") {
  std::mt19937_64 random(1);
  for (int k = 0; k < 100'000; ++k) {
    double a = any_double(random), b = any_double(random);
    if (k % 2 == 0) {  // of similar size, so that digits are lost
      a = std::ldexp(a / std::exp2(std::ilogb(a)), static_cast<int>(random() % 100) - 50);
      b = std::ldexp(b / std::exp2(std::ilogb(b)), static_cast<int>(random() % 100) - 50);
    }
    if (!std::isfinite(a) || !std::isfinite(b) || !std::isfinite(a + b)) continue;
    REQUIRE(exact({a, b}) == a + b);
  }
}

TEST_CASE("exact sums do not depend on the order, and what cancels is gone") {
  std::mt19937_64 random(2);
  std::vector<double> terms;
  for (int k = 0; k < 1000; ++k)
    terms.push_back(
        std::ldexp(static_cast<double>(random()) - 9e18, static_cast<int>(random() % 400) - 200));
  const double sum = exact(terms);
  std::shuffle(terms.begin(), terms.end(), random);
  CHECK(exact(terms) == sum);
  std::vector<double> both = terms;
  for (const double term : terms) both.push_back(-term);
  std::shuffle(both.begin(), both.end(), random);
  CHECK(exact(both) == 0.0);
  both.push_back(1e-300);
  CHECK(exact(both) == 1e-300);
}

TEST_CASE("elements of exact sums are added like the sums") {
  const std::vector<double> a{1e300, -3.5, 1e-320}, b{-1e300, 2.25, 7e10};
  ExactSum first, second;
  for (const double term : a) first += term;
  for (const double term : b) second += term;
  std::array<Index, ExactSum::size> elements;
  std::transform(first.elements().begin(), first.elements().end(), second.elements().begin(),
                 elements.begin(), std::plus<>());
  CHECK(ExactSum(elements).value() == 7e10 - 1.25);
}

TEST_CASE("a term that is not finite shows in the exact sum") {
  CHECK(std::isnan(exact({1.0, std::numeric_limits<double>::infinity()})));
  CHECK(std::isnan(exact({std::numeric_limits<double>::quiet_NaN()})));
  CHECK(exact({}) == 0.0);
}
