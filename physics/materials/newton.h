/// \file Newton's method for a few equations, with exact derivatives by dual numbers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace lahar {

/// A value and its derivatives with respect to N unknowns: arithmetic with the chain rule
/// (forward-mode automatic differentiation, Wengert 1964).
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
    return a.chain(a.v * b.v, b.v) + b.chain(0, a.v);
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    return a.chain(a.v / b.v, 1 / b.v) + b.chain(0, -a.v / (b.v * b.v));
  }
  friend Dual exp(const Dual& a) {
    const double e = std::exp(a.v);
    return a.chain(e, e);
  }
  friend Dual log(const Dual& a) { return a.chain(std::log(a.v), 1 / a.v); }
  friend Dual sqrt(const Dual& a) {
    const double root = std::sqrt(a.v);
    return a.chain(root, 0.5 / root);
  }
  friend Dual sin(const Dual& a) { return a.chain(std::sin(a.v), std::cos(a.v)); }
  friend Dual cos(const Dual& a) { return a.chain(std::cos(a.v), -std::sin(a.v)); }
  friend Dual pow(const Dual& a, double n) {
    const double f = std::pow(a.v, n);
    return a.chain(f, a.v == 0 ? 0 : n * f / a.v);
  }
  friend Dual abs(const Dual& a) { return a.chain(std::abs(a.v), a.v < 0 ? -1 : 1); }
  /// The larger one, with its derivatives.
  friend Dual max(const Dual& a, const Dual& b) { return a.v < b.v ? b : a; }
  /// Within -most and most.
  friend Dual bounded(const Dual& a, double most) {
    return std::abs(a.v) <= most ? a : Dual(std::copysign(most, a.v));
  }
};

inline double bounded(double a, double most) {
  return std::clamp(a, -most, most);
}

/// Residuals are dimensionless and of order one at most where the unknowns are wrong; this is a few
/// thousand roundings.
inline constexpr double newton_tolerance = 1e-12;
inline constexpr int newton_iterations = 40;
/// A step is halved at most this often while it does not reduce the residual.
inline constexpr int newton_halvings = 8;

template <std::size_t N>
using Duals = std::array<Dual<N>, N>;

/// Solves J dx = -r by elimination with pivoting; false where J is singular.
template <std::size_t N>
bool newton_direction(Duals<N> r, std::array<double, N>& dx) {
  for (std::size_t c = 0; c < N; ++c) {
    std::size_t pivot = c;
    for (std::size_t i = c + 1; i < N; ++i)
      if (std::abs(r[i].d[c]) > std::abs(r[pivot].d[c])) pivot = i;
    std::swap(r[c], r[pivot]);
    if (!(std::abs(r[c].d[c]) > 0)) return false;
    for (std::size_t i = c + 1; i < N; ++i) {
      const double factor = r[i].d[c] / r[c].d[c];
      r[i].v -= factor * r[c].v;
      for (std::size_t k = c; k < N; ++k) r[i].d[k] -= factor * r[c].d[k];
    }
  }
  for (std::size_t c = N; c-- > 0;) {
    dx[c] = -r[c].v;
    for (std::size_t k = c + 1; k < N; ++k) dx[c] -= r[c].d[k] * dx[k];
    dx[c] /= r[c].d[c];
  }
  return true;
}

/// Solves residual(x) = 0 from the given x by Newton's method with a line search.
/// `residual(Duals<N>) -> Duals<N>`; an unknown changes at most by `most` in an iteration.
/// Returns whether the largest residual became newton_tolerance or less; x is then the solution.
template <std::size_t N, class Residual>
bool newton(const Residual& residual, std::array<double, N>& x, const std::array<double, N>& most) {
  const auto evaluate = [&](const std::array<double, N>& at, Duals<N>& r) {
    Duals<N> unknowns;
    for (std::size_t i = 0; i < N; ++i) unknowns[i] = Dual<N>::unknown(at[i], i);
    r = residual(unknowns);
    double largest = 0;
    for (const Dual<N>& each : r) {
      if (!std::isfinite(each.v)) return HUGE_VAL;
      largest = std::max(largest, std::abs(each.v));
    }
    return largest;
  };
  Duals<N> r;
  double error = evaluate(x, r);
  for (int i = 0; i < newton_iterations && std::isfinite(error); ++i) {
    if (error <= newton_tolerance) return true;
    std::array<double, N> dx, next;
    if (!newton_direction<N>(r, dx)) return false;
    double share = 1;
    for (std::size_t k = 0; k < N; ++k)
      if (std::abs(dx[k]) * share > most[k]) share = most[k] / std::abs(dx[k]);
    double next_error = HUGE_VAL;
    for (int halving = 0; halving <= newton_halvings; ++halving, share *= 0.5) {
      for (std::size_t k = 0; k < N; ++k) next[k] = x[k] + share * dx[k];
      next_error = evaluate(next, r);
      if (next_error < error) break;
    }
    x = next;
    error = next_error;
  }
  return false;
}

}  // namespace lahar
