/// \file Numbers that carry their derivatives.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include "physics/base/simd.h"

namespace lahar {

/// A value and its derivatives with respect to N unknowns: arithmetic with the chain rule
/// (forward-mode automatic differentiation, Wengert 1964). Comparisons see the value alone. A
/// constitutive law takes it as a number or as a pack of one lane (physics/base/simd.h).
template <std::size_t N>
struct Dual {
  double v = 0;
  std::array<double, N> d{};

  Dual() = default;
  Dual(double value) : v(value) {}
  /// The i-th unknown.
  static Dual unknown(double value, std::size_t i) {
    Dual x(value);
    x.d[i] = 1;
    return x;
  }
  /// f(x) from the value of f and its derivative there.
  Dual chain(double value, double derivative) const {
    Dual f(value);
    for (std::size_t i = 0; i < N; ++i) f.d[i] = derivative * d[i];
    return f;
  }

  friend Dual operator+(Dual a, const Dual& b) {
    a.v += b.v;
    for (std::size_t i = 0; i < N; ++i) a.d[i] += b.d[i];
    return a;
  }
  friend Dual operator-(const Dual& a) { return a.chain(-a.v, -1); }
  friend Dual operator-(const Dual& a, const Dual& b) { return a + (-b); }
  friend Dual operator*(const Dual& a, const Dual& b) {
    Dual f(a.v * b.v);
    for (std::size_t i = 0; i < N; ++i) f.d[i] = b.v * a.d[i] + a.v * b.d[i];
    return f;
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    return a.chain(a.v / b.v, 1 / b.v) + b.chain(0, -a.v / (b.v * b.v));
  }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend bool operator==(const Dual& a, const Dual& b) { return a.v == b.v; }
  friend bool operator<(const Dual& a, const Dual& b) { return a.v < b.v; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.v > b.v; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.v <= b.v; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.v >= b.v; }
  friend bool isfinite(const Dual& a) { return std::isfinite(a.v); }

  friend Dual exp(const Dual& a) {
    const double e = std::exp(a.v);
    return a.chain(e, e);
  }
  friend Dual log(const Dual& a) { return a.chain(std::log(a.v), 1 / a.v); }
  /// Its derivative at zero is taken to be zero.
  friend Dual sqrt(const Dual& a) {
    const double root = std::sqrt(a.v);
    return a.chain(root, root > 0 ? 0.5 / root : 0);
  }
  friend Dual sin(const Dual& a) { return a.chain(std::sin(a.v), std::cos(a.v)); }
  friend Dual cos(const Dual& a) { return a.chain(std::cos(a.v), -std::sin(a.v)); }
  friend Dual tan(const Dual& a) {
    const double t = std::tan(a.v);
    return a.chain(t, 1 + t * t);
  }
  friend Dual atan2(const Dual& y, const Dual& x) {
    const double square = x.v * x.v + y.v * y.v;
    return y.chain(std::atan2(y.v, x.v), x.v / square) + x.chain(0, -y.v / square);
  }
  friend Dual pow(const Dual& a, double n) {
    const double f = std::pow(a.v, n);
    return a.chain(f, a.v == 0 ? 0 : n * f / a.v);
  }
  friend Dual hypot(const Dual& a, const Dual& b) { return sqrt(a * a + b * b); }
  friend Dual abs(const Dual& a) { return a.chain(std::abs(a.v), a.v < 0 ? -1 : 1); }
  /// The larger one, with its derivatives.
  friend Dual max(const Dual& a, const Dual& b) { return a.v < b.v ? b : a; }
  friend Dual max(const Dual& a, double b) { return max(a, Dual(b)); }
  friend Dual min(const Dual& a, const Dual& b) { return b.v < a.v ? b : a; }
  /// Within -most and most.
  friend Dual bounded(const Dual& a, double most) {
    return std::abs(a.v) <= most ? a : Dual(std::copysign(most, a.v));
  }

  // As a pack of one lane.
  double operator[](int) const { return v; }
  friend Dual fma(const Dual& a, const Dual& b, const Dual& c) { return a * b + c; }
  friend Dual reciprocal(const Dual& a) { return 1.0 / a; }
  friend Dual inverse_sqrt(const Dual& a) {
    const double root = 1 / std::sqrt(a.v);
    return a.chain(root, -0.5 * root / a.v);
  }
  friend Dual clamp(const Dual& a, double limit) { return bounded(a, limit); }
  friend void set_lane(Dual& a, int, const Dual& value) { a = value; }
  friend Dual lane_of(const Dual& a, int) { return a; }
};

template <std::size_t N>
inline constexpr int lanes<Dual<N>> = 1;

/// Whether a number or pack carries derivatives.
template <class T>
inline constexpr bool is_dual = false;
template <std::size_t N>
inline constexpr bool is_dual<Dual<N>> = true;

inline double value_of(double a) {
  return a;
}
template <std::size_t N>
double value_of(const Dual<N>& a) {
  return a.v;
}
template <class T, std::size_t N>
std::array<double, N> values_of(const std::array<T, N>& a) {
  std::array<double, N> values;
  for (std::size_t k = 0; k < N; ++k) values[k] = value_of(a[k]);
  return values;
}

/// One lane of a pack; it may be a Dual.
template <int W>
double lane_of(const PackOf<W>& pack, int lane) {
  return pack[lane];
}
/// What lanes of a pack are: double or Dual.
template <class Real>
using NumberOf = decltype(lane_of(std::declval<Real>(), 0));

/// The pack of one lane that holds a number.
template <class Number>
using PackOfOne = std::conditional_t<is_dual<Number>, Number, Scalar>;

inline double bounded(double a, double most) {
  return std::clamp(a, -most, most);
}

/// The root x of r(x, ...) = 0 as a function of what else r depends on, `residual`: r at the root,
/// taken as a constant; `slope`: dr/dx there (implicit function theorem).
template <std::size_t N>
Dual<N> implicit_root(double root, const Dual<N>& residual, double slope) {
  return residual.chain(root, -1 / slope);
}

}  // namespace lahar
