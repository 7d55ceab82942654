#include "physics/geometry/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lahar {

namespace {

/// Where a coordinate lies on an axis: after point `i`, by the share `t` of the way to the next.
struct OnAxis {
  std::size_t i = 0;
  double t = 0, length = 1;
};

/// x lies on the axis, which has `per_length` steps per length in the mean.
[[gnu::always_inline]] inline OnAxis find(const std::vector<double>& points, double per_length,
                                          double x) {
  const double* axis = points.data();
  const std::size_t last = points.size() - 2;
  // Of equal steps, and where only the ends differ, the place is this one or beside it.
  std::size_t i = std::min(static_cast<std::size_t>((x - axis[0]) * per_length), last);
  if (i > 0 && x < axis[i]) --i;
  if (i < last && x >= axis[i + 1]) ++i;
  if (x < axis[i] || (i < last && x >= axis[i + 1])) {
    const auto above = std::upper_bound(points.begin(), points.end(), x) - points.begin();
    i = std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(above - 1, 0)), last);
  }
  const double length = axis[i + 1] - axis[i];
  return {i, (x - axis[i]) / length, length};
}

template <int Dim>
using OnAxes = std::array<OnAxis, static_cast<std::size_t>(Dim - 1)>;

/// Linear, or bilinear, between points of the grid.
template <int Dim>
[[gnu::always_inline]] inline typename Surface<Dim>::Point between(
    const typename Surface<Dim>::Axes& axes, const std::vector<float>& heights,
    const OnAxes<Dim>& on) {
  typename Surface<Dim>::Point point{0, Vec<Dim>::Zero()};
  if constexpr (Dim == 2) {
    const double a = heights[on[0].i], b = heights[on[0].i + 1];
    point.height = a + on[0].t * (b - a);
    point.slope[0] = (b - a) / on[0].length;
  } else {
    const std::size_t row = axes[0].size(), first = on[1].i * row + on[0].i;
    const double a = heights[first], b = heights[first + 1];
    const double c = heights[first + row], d = heights[first + row + 1];
    const double s = on[0].t, t = on[1].t;
    const double front = a + s * (b - a), back = c + s * (d - c);
    point.height = front + t * (back - front);
    point.slope[0] = ((1 - t) * (b - a) + t * (d - c)) / on[0].length;
    point.slope[1] = (back - front) / on[1].length;
  }
  return point;
}

}  // namespace

template <int Dim>
Surface<Dim>::Surface(Axes axes, std::vector<float> heights)
    : axes_(std::move(axes)), heights_(std::move(heights)) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (std::size_t d = 0; d < plan; ++d) {
    if (axes_[d].size() > 1)
      per_length_[d] =
          static_cast<double>(axes_[d].size() - 1) / (axes_[d].back() - axes_[d].front());
    bounds_.first[static_cast<int>(d)] = axes_[d].front();
    bounds_.second[static_cast<int>(d)] = axes_[d].back();
  }
  double low = inf, high = -inf;
  for (const float h : heights_)
    if (!std::isnan(h)) low = std::min<double>(low, h), high = std::max<double>(high, h);
  bounds_.first[plan] = low;
  bounds_.second[plan] = high;
}

template <int Dim>
typename Surface<Dim>::Point Surface<Dim>::at(const Vec<Dim>& x) const {
  Point none{std::numeric_limits<double>::quiet_NaN(), Vec<Dim>::Zero()};
  OnAxes<Dim> on;
  for (std::size_t d = 0; d < plan; ++d) {
    const double at = x[static_cast<int>(d)];
    if (axes_[d].size() < 2 || !(at >= axes_[d].front() && at <= axes_[d].back())) return none;
    on[d] = find(axes_[d], per_length_[d], at);
  }
  Point point = between<Dim>(axes_, heights_, on);
  // A place on a line of the grid is known from either side.
  for (unsigned other = 1; std::isnan(point.height) && other < 1u << plan; ++other) {
    auto beside = on;
    bool has_side = true;
    for (std::size_t d = 0; d < plan; ++d) {
      if (!(other >> d & 1u)) continue;
      has_side = has_side && on[d].t == 0 && on[d].i > 0;
      if (!has_side) break;
      const std::size_t i = on[d].i - 1;
      beside[d] = {i, 1.0, axes_[d][i + 1] - axes_[d][i]};
    }
    if (has_side) point = between<Dim>(axes_, heights_, beside);
  }
  return point;
}

template <int Dim>
typename Surface<Dim>::Range Surface<Dim>::range(const Vec<Dim>& low, const Vec<Dim>& high) const {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Range out{inf, -inf, true};
  std::array<std::size_t, 2> from{}, to{};  // points of the grid around the box
  for (std::size_t d = 0; d < plan; ++d) {
    const auto& axis = axes_[d];
    const double a = low[static_cast<int>(d)], b = high[static_cast<int>(d)];
    if (axis.size() < 2 || !(b >= axis.front() && a <= axis.back())) return {inf, -inf, false};
    out.complete = out.complete && a >= axis.front() && b <= axis.back();
    from[d] = find(axis, per_length_[d], std::max(a, axis.front())).i;
    const OnAxis on = find(axis, per_length_[d], std::min(b, axis.back()));
    to[d] = on.t > 0 || on.i == from[d] ? on.i + 1 : on.i;
  }
  for (std::size_t j = from[1]; j <= to[1]; ++j)
    for (std::size_t i = from[0]; i <= to[0]; ++i) {
      const double h = heights_[j * axes_[0].size() + i];
      if (std::isnan(h)) out.complete = false;
      if (h < out.low) out.low = h;
      if (h > out.high) out.high = h;
    }
  return out;
}

template class Surface<2>;
template class Surface<3>;

}  // namespace lahar
