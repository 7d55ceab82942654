#include "physics/geometry/solid_samples.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
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

template <int Dim>
struct Plane {
  Vec<Dim> normal;
  double offset;  ///< [m] from the place that is looked at, along the normal
};

/// The way [m] to the nearest place on two planes.
template <int Dim>
Vec<Dim> to_both(const Plane<Dim>& one, const Plane<Dim>& two) {
  const double dot = one.normal.dot(two.normal), square = 1 - dot * dot;
  return (one.offset - dot * two.offset) / square * one.normal +
         (two.offset - dot * one.offset) / square * two.normal;
}

/// Edges and corners of a solid beside its points.
template <int Dim>
class SharpPoints {
 public:
  SharpPoints(const Solid<Dim>& solid, double h) : solid_(solid), h_(h) {}
  const std::vector<SurfacePoint<Dim>>& all() const { return all_; }

  /// Add those where planes meet that are next to x on the surface.
  void look_beside(const Vec<Dim>& x) {
    const std::vector<Plane<Dim>> planes = planes_beside(x);
    for (std::size_t i = 0; i < planes.size(); ++i)
      for (std::size_t j = i + 1; j < planes.size(); ++j) {
        if (!turns(planes[i].normal, planes[j].normal)) continue;
        add(x + to_both(planes[i], planes[j]), {planes[i].normal, planes[j].normal});
        if constexpr (Dim == 3)
          for (std::size_t k = j + 1; k < planes.size(); ++k) {
            Eigen::Matrix3d normals;
            normals << planes[i].normal.transpose(), planes[j].normal.transpose(),
                planes[k].normal.transpose();
            if (std::abs(normals.determinant()) < least_corner) continue;
            const Vec<3> offsets(planes[i].offset, planes[j].offset, planes[k].offset);
            add(x + normals.inverse() * offsets,
                {planes[i].normal, planes[j].normal, planes[k].normal});
          }
      }
  }
  bool is_near(const Vec<Dim>& x, double distance) const {
    return std::any_of(all_.begin(), all_.end(),
                       [&](const auto& known) { return (known.x - x).norm() < distance; });
  }

 private:
  static constexpr double least_corner = 0.05;  // product of three normals
  static constexpr double exact = 1e-6;         // of the distance h of points

  /// Planes that are at least 15 degrees and at most 165 degrees apart make an edge.
  static bool turns(const Vec<Dim>& one, const Vec<Dim>& two) {
    return std::abs(one.dot(two)) < 0.966;
  }
  std::vector<Plane<Dim>> planes_beside(const Vec<Dim>& x) const {
    std::vector<Plane<Dim>> planes{{solid_.nearest(x).normal, 0}};
    const Vec<Dim> normal = planes.front().normal;
    for (const Vec<Dim>& along : directions_across<Dim>(normal))
      for (const double depth : {0.0, 0.25}) {
        const Vec<Dim> way = h_ * (along - depth * normal);
        const auto near = solid_.nearest(x + way);
        if (std::abs(near.distance) > 1.5 * h_) continue;
        const bool is_new = std::all_of(planes.begin(), planes.end(), [&](const auto& known) {
          return known.normal.dot(near.normal) < 0.966;
        });
        if (is_new) planes.push_back({near.normal, way.dot(near.normal) - near.distance});
      }
    return planes;
  }
  void add(const Vec<Dim>& x, std::initializer_list<Vec<Dim>> normals) {
    const bool is_corner = normals.size() == Dim;
    if (std::abs(solid_.nearest(x).distance) > exact * h_) return;
    Vec<Dim> out = Vec<Dim>::Zero();
    for (const Vec<Dim>& normal : normals) {  // inner edges hide what is beside them
      if (solid_.nearest(x + 0.1 * h_ * normal).distance < 0.05 * h_) return;
      out += normal;
    }
    if (!is_near(x, (is_corner ? 0.01 : 0.25) * h_)) all_.push_back({x, out.normalized(), true});
  }

  const Solid<Dim>& solid_;
  double h_;
  std::vector<SurfacePoint<Dim>> all_;
};

}  // namespace

template <int Dim>
std::vector<Vec<Dim>> directions_across(const Vec<Dim>& normal) {
  const Vec<Dim> one = normal.unitOrthogonal();
  if constexpr (Dim == 2) {
    return {one, -one};
  } else {
    std::vector<Vec<3>> all;
    const Vec<3> two = normal.cross(one);
    for (const int k : {-1, 0, 1})
      for (const int j : {-1, 0, 1})
        if (k != 0 || j != 0) all.push_back((k * one + j * two).normalized());
    return all;
  }
}

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
std::vector<SurfacePoint<Dim>> surface_points(const Solid<Dim>& solid, int cuts) {
  std::vector<Vec<Dim>> found;
  const auto [low, high] = solid.bounds();
  const double longest = (high - low).maxCoeff() / cuts;
  std::array<int, 3> n = boxes_of<Dim>(high - low, cuts);
  Vec<Dim> h = high - low;
  for (int d = 0; d < Dim; ++d) h[d] /= n[static_cast<std::size_t>(d)]++;
  for_numbers(n, [&, low = low](const std::array<int, 3>& at) {
    const Vec<Dim> x = place<Dim>(low, h, at, 0);
    if (std::abs(solid.nearest(x).distance) > 0.5 * longest) return;
    if (const auto point = on_surface<Dim>(solid, x, longest)) found.push_back(*point);
  });
  SharpPoints<Dim> sharp(solid, longest);
  for (const Vec<Dim>& x : found) sharp.look_beside(x);
  std::vector<SurfacePoint<Dim>> points = sharp.all();
  for (const Vec<Dim>& x : found)
    if (!sharp.is_near(x, 0.02 * longest)) points.push_back({x, solid.nearest(x).normal, false});
  return points;
}

#define LAHAR_INSTANTIATE(Dim)                                              \
  template SolidMoments<Dim> moments_of<Dim>(const Solid<Dim>&, int, bool); \
  template std::vector<Vec<Dim>> directions_across<Dim>(const Vec<Dim>&);   \
  template std::vector<SurfacePoint<Dim>> surface_points<Dim>(const Solid<Dim>&, int);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
