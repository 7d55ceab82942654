/// \file What is measured of flows: how deep they lie, where they end, when they arrive.
///
/// Depths come from mass. The volume of a particle that flies alone means nothing, and one such
/// particle must not decide where a deposit ends.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/verification/case.h"

namespace lahar::verification {

/// A curve by points of ascending x.
struct Curve {
  std::vector<double> x, y;

  void add(double at, double value) {
    x.push_back(at);
    y.push_back(value);
  }
  /// Value at `at`: linear between points; beyond the ends that of the end.
  double at(double at) const {
    if (at <= x.front()) return y.front();
    for (std::size_t i = 1; i < x.size(); ++i)
      if (at <= x[i]) return y[i - 1] + (at - x[i - 1]) / (x[i] - x[i - 1]) * (y[i] - y[i - 1]);
    return y.back();
  }
  /// The first x at which the curve rises to `value`, linear between points; x of the last point if
  /// it never does.
  double first_reach(double value) const {
    if (y.front() >= value) return x.front();
    for (std::size_t i = 1; i < x.size(); ++i)
      if (y[i] >= value) return crossing(i, value);
    return x.back();
  }
  /// The first x at which the curve falls below `value`, linear between points; x of the last point
  /// if it never does.
  double first_below(double value) const {
    if (y.front() < value) return x.front();
    for (std::size_t i = 1; i < x.size(); ++i)
      if (y[i] < value) return crossing(i, value);
    return x.back();
  }
  /// Mean between two x.
  double mean(double from, double to) const {
    constexpr int parts = 200;
    double sum = 0;
    for (int i = 0; i <= parts; ++i)
      sum += (i == 0 || i == parts ? 0.5 : 1.0) * at(from + (to - from) * i / parts);
    return sum / parts;
  }
  /// The last x at which the curve falls below `value`, linear between points; x of the last point
  /// if it ends above.
  double last_above(double value) const {
    for (std::size_t i = x.size() - 1; i > 0; --i)
      if (y[i] < value && y[i - 1] >= value) return crossing(i, value);
    return x.back();
  }

 private:
  /// Where the line from point i - 1 to point i has the value.
  double crossing(std::size_t i, double value) const {
    return x[i - 1] + (value - y[i - 1]) / (y[i] - y[i - 1]) * (x[i] - x[i - 1]);
  }
};

/// Depths of columns beside one another [m].
struct Depths {
  double from = 0, width = 1;  ///< where the first column begins; width of each [m]
  std::vector<double> depth;

  double centre(std::size_t i) const { return from + (static_cast<double>(i) + 0.5) * width; }
  Curve curve() const {
    Curve c;
    for (std::size_t i = 0; i < depth.size(); ++i) c.add(centre(i), depth[i]);
    return c;
  }
  /// Where the deposit ends that is connected with the first column: every column up to there is
  /// deeper than `layer`. Linear between the centres of the last such column and the next, so that
  /// the place does not jump by a column; at a steep face it is up to half a width too far.
  double front(double layer) const {
    std::size_t i = 0;
    while (i < depth.size() && depth[i] > layer) ++i;
    if (i == 0) return from;
    if (i == depth.size()) return from + static_cast<double>(i) * width;
    return centre(i - 1) + (depth[i - 1] - layer) / (depth[i - 1] - depth[i]) * width;
  }
  double highest() const { return *std::max_element(depth.begin(), depth.end()); }
};

/// Depths by mass: `place(p)` says where particle p is along the columns, `selected(p)` whether it
/// counts, `area(i)` the footprint of column i [m^2; in 2D its width].
template <class Place, class Selected, class Area>
Depths depths(const State& state, double density, double from, double width, Place place,
              Selected selected, Area area) {
  Depths found{.from = from, .width = width, .depth = {}};
  for (Index p = 0; p < state.size(); ++p) {
    if (!selected(p)) continue;
    const double column = std::floor((place(p) - from) / width);
    if (column < 0) continue;
    const auto i = static_cast<std::size_t>(column);
    if (i >= found.depth.size()) found.depth.resize(i + 1, 0.0);
    found.depth[i] += state.get("mass", p);
  }
  found.depth.push_back(0.0);  // nothing lies beyond
  for (std::size_t i = 0; i < found.depth.size(); ++i) found.depth[i] /= density * area(i);
  return found;
}

/// Depths of a plane flow along x.
inline Depths depths_along_x(const State& state, double density, double from, double width) {
  return depths(
      state, density, from, width, [&](Index p) { return state.x(p, 0); },
      [](Index) { return true; }, [&](std::size_t) { return width; });
}

/// Depths of an axisymmetric flow along its radius.
inline Depths depths_along_radius(const State& state, double density, double width) {
  return depths(
      state, density, 0.0, width, [&](Index p) { return state.x(p, 0); },
      [](Index) { return true; },
      [&](std::size_t i) {
        return std::numbers::pi * width * width * static_cast<double>(2 * i + 1);
      });
}

/// Depth [m] along a flow that ends at its plane or axis of symmetry, 0: at each place that of
/// columns of `width` in the mean over all places where columns could begin, so that none decides
/// where a thin sheet ends. A grain's share falls linearly from its place to nothing at a width
/// away; what falls on the other side of 0 is that of a grain there. `breadth(x)`: of the flow at
/// x [m; in 2D 1].
template <class Place, class Breadth>
Curve mean_depths(const State& state, double density, double width, Place place, Breadth breadth) {
  constexpr int per_width = 16;
  const double spacing = width / per_width;
  std::vector<double> depth;
  const auto add = [&](double x, double share) {
    const double first = std::max(0.0, std::ceil((x - width) / spacing));
    for (auto i = static_cast<std::size_t>(first); static_cast<double>(i) * spacing < x + width;
         ++i) {
      if (i >= depth.size()) depth.resize(i + 1, 0.0);
      depth[i] += share * (1 - std::abs(static_cast<double>(i) * spacing - x) / width);
    }
  };
  for (Index p = 0; p < state.size(); ++p) {
    const double x = place(p), share = state.get("mass", p) / (density * breadth(x) * width);
    add(x, share);
    if (x < width) add(-x, share);
  }
  Curve curve;
  for (std::size_t i = 0; i < depth.size(); ++i)
    curve.add(static_cast<double>(i) * spacing, depth[i]);
  curve.add(static_cast<double>(depth.size()) * spacing, 0.0);  // nothing lies beyond
  return curve;
}

/// Depths of rings around the z axis, of a body of which a quarter is computed.
inline Depths depths_of_rings(const State& state, double density, double width) {
  return depths(
      state, density, 0.0, width, [&](Index p) { return std::hypot(state.x(p, 0), state.x(p, 1)); },
      [](Index) { return true; },
      [&](std::size_t i) {
        return std::numbers::pi / 4 * width * width * static_cast<double>(2 * i + 1);
      });
}

/// Height of what has not moved by more than `moved` [m], over where it was at the start: the line
/// between it and what slid.
inline Depths depths_at_rest(const State& state, double density, double from, double width,
                             double moved) {
  const auto u = [&](Index p, int d) { return state.get("displacement", p, d); };
  return depths(
      state, density, from, width, [&](Index p) { return state.x(p, 0) - u(p, 0); },
      [&](Index p) { return std::hypot(u(p, 0), u(p, 1)) <= moved; },
      [&](std::size_t) { return width; });
}

/// Depth at a gauge in 3D: a mean of the water around (x, y). Its weight falls to zero at `reach`
/// [m]. (In a square without weights, one row of particles more or less is a fifth.)
inline double depth_at_gauge(const State& state, double density, double x, double y, double reach) {
  double mass = 0;
  for (Index p = 0; p < state.size(); ++p) {
    const double across = 1 - std::abs(state.x(p, 0) - x) / reach;
    const double along = 1 - std::abs(state.x(p, 1) - y) / reach;
    if (across > 0 && along > 0) mass += state.get("mass", p) * across * along;
  }
  return mass / (density * reach * reach);
}

/// Root of the mean square of the difference of two curves, at the points of the first.
inline double distance(const Curve& points, const Curve& curve) {
  double sum = 0;
  for (std::size_t i = 0; i < points.x.size(); ++i) {
    const double d = curve.at(points.x[i]) - points.y[i];
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(points.x.size()));
}

/// Columns `x` and `y` of a table of numbers, from 0; lines that begin with # are comments.
inline Curve read_curve(const std::string& file, int x, int y) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error("cannot read " + file);
  Curve curve;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> row;
    for (double value; words >> value;) row.push_back(value);
    curve.add(row.at(static_cast<std::size_t>(x)), row.at(static_cast<std::size_t>(y)));
  }
  return curve;
}

}  // namespace lahar::verification
