#include "physics/geometry/solid_samples.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lahar {

namespace {

/// Call visit(x, h) for the points of a grid over the box around a solid: `cuts` steps h along its
/// longest edge, the first axis fastest. The points are the middles of its boxes, or their corners.
template <int Dim, class Visit>
void for_grid(const Solid<Dim>& solid, int cuts, bool middles, Visit visit) {
  const auto [low, high] = solid.bounds();
  const double h = (high - low).maxCoeff() / cuts;
  std::array<int, 3> n{1, 1, 1};
  for (int d = 0; d < Dim; ++d) {
    const int boxes = static_cast<int>(std::ceil((high - low)[d] / h));
    n[static_cast<std::size_t>(d)] = middles ? std::max(1, boxes) : boxes + 1;
  }
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::array<int, 3> at{i, j, k};
        Vec<Dim> x;
        for (int d = 0; d < Dim; ++d)
          x[d] = low[d] + (at[static_cast<std::size_t>(d)] + (middles ? 0.5 : 0.0)) * h;
        visit(x, h);
      }
}

}  // namespace

template <int Dim>
SolidMoments<Dim> moments_of(const Solid<Dim>& solid, int cuts) {
  SolidMoments<Dim> m;
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for_grid(solid, cuts, true, [&](const Vec<Dim>& x, double h) {
    const auto near = solid.nearest(x);
    // A plane through the nearest point cuts the box, whose width is that along the normal.
    const double width = near.normal.cwiseAbs().sum() * h;
    const double part = std::clamp(0.5 - near.distance / width, 0.0, 1.0);
    const double volume = part * std::pow(h, Dim);
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
  for_grid(solid, cuts, false, [&](const Vec<Dim>& x, double h) {
    const auto near = solid.nearest(x);
    if (std::abs(near.distance) <= 0.5 * h) points.push_back(x - near.distance * near.normal);
  });
  return points;
}

#define LAHAR_INSTANTIATE(Dim)                                        \
  template SolidMoments<Dim> moments_of<Dim>(const Solid<Dim>&, int); \
  template std::vector<Vec<Dim>> surface_points<Dim>(const Solid<Dim>&, int);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
