/// \file Newton's method for a few equations, with exact derivatives by dual numbers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "physics/materials/dual.h"

namespace lahar {

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

/// The solution x of residual(x, parameters) = 0 as a function of the parameters: `at` with x as
/// unknowns, `along` with the derivatives of parameters, both of them residuals at x.
template <std::size_t N, std::size_t M>
std::array<Dual<M>, N> implicit_solution(const std::array<double, N>& x, Duals<N> at,
                                         const std::array<Dual<M>, N>& along) {
  std::array<Dual<M>, N> solution;
  for (std::size_t i = 0; i < N; ++i) solution[i] = Dual<M>(x[i]);
  for (std::size_t j = 0; j < M; ++j) {
    std::array<double, N> dx{};
    for (std::size_t i = 0; i < N; ++i) at[i].v = along[i].d[j];
    if (!newton_direction<N>(at, dx)) dx.fill(std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < N; ++i) solution[i].d[j] = dx[i];
  }
  return solution;
}

}  // namespace lahar
