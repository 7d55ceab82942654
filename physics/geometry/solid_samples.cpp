#include "physics/geometry/solid_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace lahar {

namespace {

/// Call visit(i, j, k) for all whole numbers below n, the first fastest.
template <class Visit>
void for_numbers(const std::array<int, 3>& n, Visit visit) {
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) visit(std::array<int, 3>{i, j, k});
}

/// Boxes along each axis, about as wide as they are high: `cuts` along the longest edge.
template <int Dim>
std::array<int, 3> boxes_of(const Vec<Dim>& size, int cuts) {
  const double h = size.maxCoeff() / cuts;
  std::array<int, 3> n{1, 1, 1};
  for (int d = 0; d < Dim; ++d)
    n[static_cast<std::size_t>(d)] = std::max(1, static_cast<int>(std::ceil(size[d] / h)));
  return n;
}

/// Places [m] of a grid with steps of h from `low` on; `shift` is in steps.
template <int Dim>
Vec<Dim> place(const Vec<Dim>& low, const Vec<Dim>& h, const std::array<int, 3>& at, double shift) {
  Vec<Dim> x;
  for (int d = 0; d < Dim; ++d) x[d] = low[d] + (at[static_cast<std::size_t>(d)] + shift) * h[d];
  return x;
}

/// The surface near x. Beside edges of intersections the nearest plane leads off the solid: its
/// point is then outside of another one.
template <int Dim>
std::optional<Vec<Dim>> on_surface(const Solid<Dim>& solid, Vec<Dim> x, double h) {
  constexpr int most_planes = 20;
  constexpr double exact = 1e-6;  // of the distance h of points
  for (int k = 0; k < most_planes; ++k) {
    const auto near = solid.nearest(x);
    if (k > 0 && std::abs(near.distance) <= exact * h) return x;
    x -= near.distance * near.normal;
  }
  return {};
}

}  // namespace

template <int Dim>
SolidMoments<Dim> moments_of(const Solid<Dim>& solid, int cuts, bool around_axis) {
  SolidMoments<Dim> m;
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  const auto [low, high] = solid.bounds();
  if (!((high - low).minCoeff() >= 0 && (high - low).maxCoeff() > 0)) return m;
  // The boxes fill the bounds, so that a solid that is symmetric has its centre in the middle.
  const std::array<int, 3> n = boxes_of<Dim>(high - low, cuts);
  Vec<Dim> h = high - low;
  for (int d = 0; d < Dim; ++d) h[d] /= n[static_cast<std::size_t>(d)];
  for_numbers(n, [&, low = low](const std::array<int, 3>& at) {
    const Vec<Dim> x = place<Dim>(low, h, at, 0.5);
    const auto near = solid.nearest(x);
    // A plane through the nearest point cuts the box, whose width is that along the normal.
    const double width = near.normal.cwiseAbs().dot(h);
    const double part = std::clamp(0.5 - near.distance / width, 0.0, 1.0);
    const double depth = around_axis ? 2 * std::numbers::pi * std::max(0.0, x[0]) : 1.0;
    const double volume = part * h.prod() * depth;
    m.volume += volume;
    m.centre += volume * x;
    Eigen::Vector3d y = Eigen::Vector3d::Zero();
    y.head<Dim>() = x;
    second += volume * (y * y.transpose());
  });
  if (m.volume == 0) return m;
  m.centre /= m.volume;
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  c.head<Dim>() = m.centre;
  second -= m.volume * c * c.transpose();
  m.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  return m;
}

template <int Dim>
std::vector<Vec<Dim>> surface_points(const Solid<Dim>& solid, int cuts) {
  std::vector<Vec<Dim>> points;
  const auto [low, high] = solid.bounds();
  const double h = (high - low).maxCoeff() / cuts;
  std::array<int, 3> n{1, 1, 1};
  for (int d = 0; d < Dim; ++d)
    n[static_cast<std::size_t>(d)] = static_cast<int>(std::ceil((high - low)[d] / h)) + 1;
  for_numbers(n, [&, low = low](const std::array<int, 3>& at) {
    const Vec<Dim> x = place<Dim>(low, Vec<Dim>::Constant(h), at, 0);
    if (std::abs(solid.nearest(x).distance) > 0.5 * h) return;
    if (const auto point = on_surface<Dim>(solid, x, h)) points.push_back(*point);
  });
  return points;
}

#define LAHAR_INSTANTIATE(Dim)                                              \
  template SolidMoments<Dim> moments_of<Dim>(const Solid<Dim>&, int, bool); \
  template std::vector<Vec<Dim>> surface_points<Dim>(const Solid<Dim>&, int);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
