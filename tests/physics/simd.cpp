// Packs of doubles compute lane by lane what a double does, and touch no more than they are asked.
#include "physics/simd.h"

#include <doctest/doctest.h>

#include <limits>

#include "tests/physics/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr int W = lanes<Pack>;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

std::vector<double> random_values(std::mt19937& random, int n) {
  std::vector<double> values;
  for (int i = 0; i < n; ++i) values.push_back(uniform(random, -2, 2));
  return values;
}

}  // namespace

TEST_CASE("arithmetic of packs is that of doubles in every lane, to the last bit") {
  std::mt19937 random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const auto a = random_values(random, W), b = random_values(random, W);
    const Pack x = load<Pack>(a.data()), y = load<Pack>(b.data());
    const double s = b[0];
    Pack sum = x, less = x, times = x;
    sum += y;
    less -= y;
    times *= y;
    for (int k = 0; k < W; ++k) {
      CHECK((x + y)[k] == a[k] + b[k]);
      CHECK((x - y)[k] == a[k] - b[k]);
      CHECK((x * y)[k] == a[k] * b[k]);
      CHECK((x / y)[k] == a[k] / b[k]);
      CHECK((-x)[k] == -a[k]);
      CHECK((s * x)[k] == s * a[k]);
      CHECK(sum[k] == a[k] + b[k]);
      CHECK(less[k] == a[k] - b[k]);
      CHECK(times[k] == a[k] * b[k]);
      CHECK(Pack(s)[k] == s);
    }
  }
}

TEST_CASE("loading the first lanes leaves zeros in the others, whatever memory holds there") {
  for (int n = 0; n <= W + 2; ++n) {
    std::vector<double> memory(W + 4, not_a_number);
    for (int k = 0; k < n && k < W; ++k) memory[k] = k + 1;
    const Pack loaded = load_first<Pack>(memory.data(), n);
    for (int k = 0; k < W; ++k) CHECK(loaded[k] == (k < n ? k + 1 : 0));
  }
}

TEST_CASE("storing the first lanes does not touch what comes after them") {
  for (int n = 0; n <= W + 2; ++n) {
    std::vector<double> memory(W + 4, -7);
    std::vector<double> values(W);
    for (int k = 0; k < W; ++k) values[k] = k + 1;
    store_first(load<Pack>(values.data()), memory.data(), n);
    for (int k = 0; k < W + 4; ++k) CHECK(memory[k] == (k < n && k < W ? k + 1 : -7));
  }
}

TEST_CASE("a sum over lanes adds halves pairwise: its order, and so its bits, are fixed") {
  std::mt19937 random(6);
  for (int trial = 0; trial < 50; ++trial) {
    auto values = random_values(random, W);
    const double found = reduce(load<Pack>(values.data()));
    for (int half = W / 2; half > 0; half /= 2)
      for (int k = 0; k < half; ++k) values[k] += values[k + half];
    CHECK(found == values[0]);
  }
  CHECK(reduce(Scalar(3.5)) == 3.5);
}

TEST_CASE("values outside of a limit are found in the first lanes only, and so are NaNs") {
  std::vector<double> values(W, 0.5);
  CHECK(outside(load<Pack>(values.data()), 1.0, W) == 0);
  for (int k = 0; k < W; ++k)
    for (const double bad :
         {1.0 + 1e-15, -1.5, not_a_number, std::numeric_limits<double>::infinity()}) {
      auto some = values;
      some[k] = bad;
      CHECK(outside(load<Pack>(some.data()), 1.0, W) == 1u << k);
      CHECK(outside(load<Pack>(some.data()), 1.0, k) == 0);
      CHECK(outside(load<Pack>(some.data()), 1.0, k + 1) == 1u << k);
    }
  for (const double edge : {1.0, -1.0}) CHECK(outside(Pack(edge), 1.0, W) == 0);
  CHECK(outside(Scalar(not_a_number), 1.0, 1) == 1);
}

TEST_CASE("clamping moves values to the limit and no further") {
  std::mt19937 random(8);
  for (int trial = 0; trial < 50; ++trial) {
    const auto values = random_values(random, W);
    const Pack clamped = clamp(load<Pack>(values.data()), 1.0);
    for (int k = 0; k < W; ++k) {
      CHECK(clamped[k] == std::clamp(values[k], -1.0, 1.0));
      CHECK(clamp(Scalar(values[k]), 1.0)[0] == std::clamp(values[k], -1.0, 1.0));
    }
  }
}

TEST_CASE("a lane's bit selects between two packs; fma rounds alike in packs and single lanes") {
  std::mt19937 random(9);
  for (unsigned bits = 0; bits < 1u << W; bits += 1 + random() % 5) {
    const auto a = random_values(random, W), b = random_values(random, W);
    const Pack x = load<Pack>(a.data()), y = load<Pack>(b.data());
    const Pack chosen = select(bits, x, y), fused = fma(x, y, -(y * y));
    for (int k = 0; k < W; ++k) {
      const Scalar s(a[k]), t(b[k]);
      CHECK(chosen[k] == (bits >> k & 1 ? a[k] : b[k]));
      CHECK(select(bits >> k, s, t)[0] == chosen[k]);
      CHECK(fma(s, t, -(t * t))[0] == fused[k]);
    }
  }
}
