// Packs of doubles compute lane by lane what a double does, and touch no more than they are asked.
#include "physics/base/simd.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "physics/materials/stress_invariants.h"
#include "tests/physics/mesh/mesh_fixtures.h"

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
      CHECK(Pack(x * y)[k] == a[k] * b[k]);
      CHECK((x / y)[k] == a[k] / b[k]);
      CHECK((-x)[k] == -a[k]);
      CHECK(Pack(s * x)[k] == s * a[k]);
      CHECK(sum[k] == a[k] + b[k]);
      CHECK(less[k] == a[k] - b[k]);
      CHECK(times[k] == a[k] * b[k]);
      CHECK(Pack(s)[k] == s);
    }
  }
}

TEST_CASE_TEMPLATE(
    "a sum that takes a product in its expression rounds once, in packs of any width", Real, Scalar,
    PackOf<2>, PackOf<4>, PackOf<8>) {
#if defined(__FMA__)
  const auto once = [](double a, double b, double c) { return std::fma(a, b, c); };
#else
  const auto once = [](double a, double b, double c) { return a * b + c; };
#endif
  std::mt19937 random(11);
  constexpr int width = lanes<Real>;
  for (int trial = 0; trial < 100; ++trial) {
    const auto a = random_values(random, width), b = random_values(random, width),
               c = random_values(random, width), d = random_values(random, width);
    const Real x = load<Real>(a.data()), y = load<Real>(b.data()), z = load<Real>(c.data()),
               w = load<Real>(d.data());
    Real more = z, less = z;
    more += x * y;
    less -= x * y;
    for (int k = 0; k < width; ++k) {
      CHECK((x * y + z)[k] == once(a[k], b[k], c[k]));
      CHECK((z + x * y)[k] == once(a[k], b[k], c[k]));
      CHECK((x * y - z)[k] == once(a[k], b[k], -c[k]));
      CHECK((z - x * y)[k] == once(-a[k], b[k], c[k]));
      CHECK((x * y + z * w)[k] == once(a[k], b[k], c[k] * d[k]));
      CHECK((x * y - z * w)[k] == once(a[k], b[k], -(c[k] * d[k])));
      CHECK((-(x * y) + z)[k] == once(-a[k], b[k], c[k]));
      CHECK(more[k] == once(a[k], b[k], c[k]));
      CHECK(less[k] == once(-a[k], b[k], c[k]));
      CHECK((2.0 * x * y + z)[k] == once(2.0 * a[k], b[k], c[k]));
      CHECK((x * y / z)[k] == a[k] * b[k] / c[k]);
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

TEST_CASE("a lane's bit selects between two packs, fma rounds alike in packs and single lanes") {
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

TEST_CASE_TEMPLATE("packs of any width select and fuse as single lanes do, native or not", Real,
                   PackOf<2>, PackOf<4>, PackOf<8>) {
  constexpr int width = lanes<Real>;
  std::mt19937 random(10);
  for (unsigned bits = 0; bits < 1u << width; ++bits) {
    const auto a = random_values(random, width), b = random_values(random, width);
    const Real x = load<Real>(a.data()), y = load<Real>(b.data());
    const Real chosen = select(bits, x, y), fused = fma(x, y, -x);
    for (int k = 0; k < width; ++k) {
      CHECK(chosen[k] == (bits >> k & 1 ? a[k] : b[k]));
      CHECK(fused[k] == fma(Scalar(a[k]), Scalar(b[k]), -Scalar(a[k]))[0]);
    }
  }
}

namespace {

/// Sums over lanes as reduce_all() adds them: plain sums but for their order, which is a tree.
template <int N, class Real>
void check_reduce_all(std::mt19937& random) {
  constexpr int width = lanes<Real>;
  Real value[N];
  double sums[N], again[N];
  std::vector<std::vector<double>> values;
  for (int k = 0; k < N; ++k) {
    values.push_back(random_values(random, width));
    if (k % 3 == 1) values.back()[0] *= 1e15;  // so that another order gives other bits
    value[k] = load<Real>(values.back().data());
  }
  reduce_all(value, sums);
  reduce_all(value, again);
  for (int k = 0; k < N; ++k) {
    const auto& v = values[static_cast<std::size_t>(k)];
    double plain = 0, size = 0;
    for (const double x : v) plain += x, size += std::abs(x);
    CHECK(std::abs(sums[k] - plain) <= 1e-15 * size * width);
    CHECK(sums[k] == again[k]);
    if (width == 8 && N % 8 == 0)  // the tree that shares its shuffles
      CHECK(sums[k] == ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7])));
    else
      CHECK(sums[k] == reduce(value[k]));
  }
}

}  // namespace

TEST_CASE("the sums over lanes of many packs at once are those of each, in a fixed order") {
  std::mt19937 random(9);
  for (int trial = 0; trial < 50; ++trial) {
    check_reduce_all<8, Pack>(random);
    check_reduce_all<16, Pack>(random);
    check_reduce_all<8, PackOf<8>>(random);
    check_reduce_all<16, PackOf<8>>(random);
    check_reduce_all<3, PackOf<8>>(random);
    check_reduce_all<8, PackOf<4>>(random);
    check_reduce_all<16, PackOf<4>>(random);
    check_reduce_all<8, Scalar>(random);
    check_reduce_all<16, Scalar>(random);
  }
}

namespace {

template <class Real>
void check_lanes(std::mt19937& random) {
  constexpr int width = lanes<Real>;
  const auto values = random_values(random, width);
  const Real value = load<Real>(values.data());
  // One double from memory in every lane.
  for (int k = 0; k < width; ++k) {
    const Real all = broadcast<Real>(&values[static_cast<std::size_t>(k)]);
    for (int lane = 0; lane < width; ++lane)
      CHECK(all[lane] == values[static_cast<std::size_t>(k)]);
  }
  // The first lanes, zero in the others, whatever was there.
  for (int n = 0; n <= width + 2; ++n) {
    auto spoilt = values;
    for (int k = n; k < width; ++k) spoilt[static_cast<std::size_t>(k)] = not_a_number;
    const Real first = first_lanes(load<Real>(spoilt.data()), n);
    for (int k = 0; k < width; ++k)
      CHECK(first[k] == (k < n ? values[static_cast<std::size_t>(k)] : 0.0));
  }
  // Roots as those of doubles, to the last bit.
  const Real root = lahar::sqrt(value * value + 0.5);
  for (int k = 0; k < width; ++k) {
    const double v = values[static_cast<std::size_t>(k)];
    CHECK(root[k] == std::sqrt((value * value + 0.5)[k]));
    CHECK(root[k] == doctest::Approx(std::sqrt(v * v + 0.5)).epsilon(1e-15));
  }
  CHECK(std::isnan(lahar::sqrt(Real(-1.0))[0]));
  CHECK(lahar::sqrt(Real(0.0))[width - 1] == 0.0);
  // The larger one.
  const auto others = random_values(random, width);
  const Real larger = lahar::max(value, load<Real>(others.data()));
  for (int k = 0; k < width; ++k)
    CHECK(larger[k] ==
          std::max(values[static_cast<std::size_t>(k)], others[static_cast<std::size_t>(k)]));
}

template <class Real>
void check_flushed() {
  constexpr int width = lanes<Real>;
  constexpr double limit = 1e-15, infinite = std::numeric_limits<double>::infinity();
  for (const double x : {0.0, 1e-300, 0.999e-15, limit, 1.001e-15, 1.0, 1e300, infinite})
    for (const double sign : {-1.0, 1.0})
      for (int k = 0; k < width; ++k) {
        std::vector<double> values(static_cast<std::size_t>(width), 7.0);
        values[static_cast<std::size_t>(k)] = sign * x;
        const Real kept = flushed(load<Real>(values.data()), limit);
        for (int lane = 0; lane < width; ++lane)
          CHECK(kept[lane] == (lane != k ? 7.0 : x < limit ? 0.0 : sign * x));
      }
  CHECK(std::isnan(flushed(Real(not_a_number), limit)[width - 1]));
}

}  // namespace

TEST_CASE("broadcasts, first lanes, roots and maxima do lane by lane what doubles do") {
  std::mt19937 random(10);
  for (int trial = 0; trial < 20; ++trial) {
    check_lanes<Pack>(random);
    check_lanes<Scalar>(random);
    check_lanes<PackOf<4>>(random);
    check_lanes<PackOf<8>>(random);
  }
}

TEST_CASE("flushing zeroes what is below the limit, and never what is no number") {
  check_flushed<Pack>();
  check_flushed<Scalar>();
  check_flushed<PackOf<4>>();
}

TEST_CASE("a transposed block has the lanes of the values as rows") {
  double values[4][8];
  PackOf<8> value[4];
  PackOf<4> rows[8];
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i < 8; ++i) values[k][i] = 10 * k + i;
    value[k] = load<PackOf<8>>(values[k]);
  }
  transpose(value, rows);
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 4; ++k) CHECK(rows[i][k] == values[k][i]);
}

TEST_CASE_TEMPLATE("reciprocals and inverse square roots are right to two units in the last place",
                   Real, Scalar, Pack) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> exponent(-250, 250), mantissa(1, 10);
  constexpr double bound = 2 * std::numeric_limits<double>::epsilon();
  for (int i = 0; i < 20000; ++i) {
    const double x = mantissa(random) * std::pow(10.0, exponent(random));
    CHECK(std::abs(reciprocal(Real(x))[0] * x - 1) <= bound);
    CHECK(std::abs(inverse_sqrt(Real(x))[0] * std::sqrt(x) - 1) <= bound);
    CHECK(reciprocal(Real(-x))[0] == -reciprocal(Real(x))[0]);
  }
}

TEST_CASE_TEMPLATE("a third of an angle has the cosine and sine of the angle", Real, Scalar, Pack) {
  for (int i = 0; i <= 10000; ++i) {
    const double theta = i * 1e-4 * std::numbers::pi / 3;
    Real cos, sin;
    third_of_angle(Real(std::cos(3 * theta)), Real(std::sin(3 * theta)), cos, sin);
    // Where 3 theta is nearly a multiple of pi its cosine says little; the sine has it.
    CHECK(std::abs(cos[0] - std::cos(theta)) <= 1e-15);
    CHECK(std::abs(sin[0] - std::sin(theta)) <= 1e-15);
  }
}
