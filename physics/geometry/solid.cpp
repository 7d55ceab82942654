#include "physics/geometry/solid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace lahar {

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

template <int Dim>
using Near = typename Solid<Dim>::Nearest;
template <int Dim>
using Bounds = std::pair<Vec<Dim>, Vec<Dim>>;

template <int Dim>
class HalfSpace final : public Solid<Dim> {
 public:
  HalfSpace(const Vec<Dim>& point, const Vec<Dim>& normal) : point_(point), normal_(normal) {}
  Near<Dim> nearest(const Vec<Dim>& x) const override {
    return {(x - point_).dot(normal_), normal_};
  }
  Bounds<Dim> bounds() const override {
    Bounds<Dim> box{Vec<Dim>::Constant(-inf), Vec<Dim>::Constant(inf)};
    for (int d = 0; d < Dim; ++d)
      if (std::abs(normal_[d]) == 1.0) (normal_[d] > 0 ? box.second : box.first)[d] = point_[d];
    return box;
  }

 private:
  Vec<Dim> point_, normal_;
};

template <int Dim>
class Ball final : public Solid<Dim> {
 public:
  Ball(const Vec<Dim>& centre, double radius) : centre_(centre), radius_(radius) {}
  Near<Dim> nearest(const Vec<Dim>& x) const override {
    const Vec<Dim> out = x - centre_;
    const double r = out.norm();
    if (r == 0) return {-radius_, Vec<Dim>::Unit(Dim - 1)};
    return {r - radius_, out / r};
  }
  Bounds<Dim> bounds() const override {
    return {centre_.array() - radius_, centre_.array() + radius_};
  }

 private:
  Vec<Dim> centre_;
  double radius_;
};

template <int Dim>
class AxisBox final : public Solid<Dim> {
 public:
  AxisBox(const Vec<Dim>& low, const Vec<Dim>& high)
      : centre_(0.5 * (low + high)), half_(0.5 * (high - low)) {}
  Near<Dim> nearest(const Vec<Dim>& x) const override {
    const Vec<Dim> from = x - centre_;
    const Vec<Dim> beyond = from.cwiseAbs() - half_;
    const auto side = [&](int d) { return from[d] < 0 ? -1.0 : 1.0; };
    int face;
    const double most = beyond.maxCoeff(&face);
    if (most <= 0) return {most, side(face) * Vec<Dim>::Unit(face)};
    Vec<Dim> out = beyond.cwiseMax(0.0);
    const double distance = out.norm();
    for (int d = 0; d < Dim; ++d) out[d] *= side(d);
    return {distance, out / distance};
  }
  Bounds<Dim> bounds() const override { return {centre_ - half_, centre_ + half_}; }

 private:
  Vec<Dim> centre_, half_;
};

/// The outline counter-clockwise.
class Polygon final : public Solid<2> {
 public:
  explicit Polygon(std::vector<Vec<2>> corners) : corner_(std::move(corners)) {
    double area = 0;
    for (std::size_t i = 0, j = corner_.size() - 1; i < corner_.size(); j = i++)
      area += corner_[j].x() * corner_[i].y() - corner_[i].x() * corner_[j].y();
    if (area < 0) std::reverse(corner_.begin(), corner_.end());
  }
  Near<2> nearest(const Vec<2>& x) const override {
    bool inside = false, at_corner = false;
    double least = inf;
    Vec<2> to = Vec<2>::Zero(), out = Vec<2>::UnitY();
    for (std::size_t i = 0, j = corner_.size() - 1; i < corner_.size(); j = i++) {
      const Vec<2>&a = corner_[j], &b = corner_[i];
      const Vec<2> edge = b - a;
      const double t = std::clamp((x - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
      const Vec<2> from = x - a - t * edge;
      if (from.squaredNorm() < least) {
        least = from.squaredNorm();
        to = from;
        out = Vec<2>(edge.y(), -edge.x()).normalized();
        at_corner = t == 0 || t == 1;
      }
      if ((b.y() > x.y()) != (a.y() > x.y()) &&
          x.x() < (a.x() - b.x()) * (x.y() - b.y()) / (a.y() - b.y()) + b.x())
        inside = !inside;
    }
    const double distance = std::sqrt(least);
    if (!at_corner)
      return {to.dot(out), out};  // a direction from the edge would be noise beside it
    if (distance < 1e-9 * corner_scale()) return {inside ? -distance : distance, out};
    return {inside ? -distance : distance, (inside ? -1.0 : 1.0) / distance * to};
  }
  Bounds<2> bounds() const override {
    Bounds<2> box{corner_[0], corner_[0]};
    for (const Vec<2>& x : corner_) box = {box.first.cwiseMin(x), box.second.cwiseMax(x)};
    return box;
  }

 private:
  double corner_scale() const { return (corner_[1] - corner_[0]).norm(); }
  std::vector<Vec<2>> corner_;
};

/// A body of revolution by its section: a polygon over the axis and the radius, and its mirror.
class Frustum final : public Solid<3> {
 public:
  Frustum(const Vec<3>& from, const Vec<3>& to, double radius_from, double radius_to)
      : from_(from),
        axis_((to - from).normalized()),
        length_((to - from).norm()),
        radius_(std::max(radius_from, radius_to)),
        section_(corners(length_, radius_from, radius_to)) {}
  Near<3> nearest(const Vec<3>& x) const override {
    const double along = (x - from_).dot(axis_);
    Vec<3> across = x - from_ - along * axis_;
    const double r = across.norm();
    across = r > 0 ? Vec<3>(across / r) : any_across();
    const Near<2> in_section = section_.nearest({along, r});
    return {in_section.distance, in_section.normal.x() * axis_ + in_section.normal.y() * across};
  }
  Bounds<3> bounds() const override {
    const Vec<3> to = from_ + length_ * axis_;
    return {from_.cwiseMin(to).array() - radius_, from_.cwiseMax(to).array() + radius_};
  }

 private:
  static std::vector<Vec<2>> corners(double length, double r0, double r1) {
    std::vector<Vec<2>> corner;
    if (r0 > 0) corner.emplace_back(0, r0);
    corner.emplace_back(0, -r0);
    corner.emplace_back(length, -r1);
    if (r1 > 0) corner.emplace_back(length, r1);
    return corner;
  }
  Vec<3> any_across() const {
    int least;
    axis_.cwiseAbs().minCoeff(&least);
    const Vec<3> e = Vec<3>::Unit(least);
    return (e - e.dot(axis_) * axis_).normalized();
  }
  Vec<3> from_, axis_;
  double length_, radius_;
  Polygon section_;
};

/// The square of the steepest slope [-] of what is bilinear between points.
double steepest(const std::vector<double>& x, const std::vector<double>& y,
                const std::vector<float>& heights) {
  double most = 0;
  const std::size_t n = x.size(), rows = heights.size() / n;
  // Along each axis the slope is between those of two edges.
  for (std::size_t j = 0; j < rows; ++j)
    for (std::size_t i = 0; i + 1 < n; ++i) {
      const auto along = [&](std::size_t row) {
        const double rise = heights[row * n + i + 1] - heights[row * n + i];
        return std::abs(rise / (x[i + 1] - x[i]));
      };
      if (rows == 1) {
        most = std::max(most, along(0) * along(0));
        continue;
      }
      if (j + 1 == rows) break;
      const auto across = [&](std::size_t column) {
        const double rise = heights[(j + 1) * n + column] - heights[j * n + column];
        return std::abs(rise / (y[j + 1] - y[j]));
      };
      const double a = std::max(along(j), along(j + 1)), b = std::max(across(i), across(i + 1));
      if (const double slope = a * a + b * b; slope > most) most = slope;  // not where unknown
    }
  return most;
}

template <int Dim>
class Below final : public Solid<Dim> {
 public:
  explicit Below(std::shared_ptr<const Surface<Dim>> surface) : surface_(std::move(surface)) {
    const auto& axes = surface_->axes();
    if (!surface_->heights().empty())
      least_cosine_ = 1 / std::sqrt(1 + steepest(axes[0], axes[Dim - 2], surface_->heights()));
  }
  Near<Dim> nearest(const Vec<Dim>& x) const override {
    const auto below = surface_->at(x);
    if (std::isnan(below.height)) return {inf, Vec<Dim>::Unit(Dim - 1)};
    const Near<Dim> first = to_plane(x, x, below);
    // The plane at the foot of the perpendicular is nearer to the nearest point of a curved
    // surface.
    const Vec<Dim> foot = x - first.distance * first.normal;
    const auto there = surface_->at(foot);
    return std::isnan(there.height) ? first : to_plane(x, foot, there);
  }
  bool is_beyond(const Vec<Dim>& x, double distance) const override {
    constexpr double steep = 0.5;
    const double height = surface_->height(x);
    if (std::isnan(height)) return true;
    const double above = x[Dim - 1] - height;
    return above > 0 && (above * least_cosine_ >= distance ||
                         (least_cosine_ < steep && nearest(x).distance >= distance));
  }
  Bounds<Dim> bounds() const override {
    Bounds<Dim> box = surface_->bounds();
    box.first[Dim - 1] = -inf;
    return box;
  }

 private:
  /// From x to the tangent plane of the surface above or below `at`.
  static Near<Dim> to_plane(const Vec<Dim>& x, Vec<Dim> at,
                            const typename Surface<Dim>::Point& point) {
    const double steep = 1 / std::sqrt(1 + point.slope.squaredNorm());
    const Vec<Dim> normal = steep * (Vec<Dim>::Unit(Dim - 1) - point.slope);
    at[Dim - 1] = point.height;
    return {(x - at).dot(normal), normal};
  }

  std::shared_ptr<const Surface<Dim>> surface_;
  /// [-] So many times the height of a point above the surface is the distance at least.
  double least_cosine_ = 1;
};

}  // namespace

template <int Dim>
SolidPtr<Dim> half_space(const Vec<Dim>& point, const Vec<Dim>& normal) {
  return std::make_shared<HalfSpace<Dim>>(point, normal);
}

template <int Dim>
SolidPtr<Dim> ball(const Vec<Dim>& centre, double radius) {
  return std::make_shared<Ball<Dim>>(centre, radius);
}

template <int Dim>
SolidPtr<Dim> box(const Vec<Dim>& low, const Vec<Dim>& high) {
  return std::make_shared<AxisBox<Dim>>(low, high);
}

template <int Dim>
SolidPtr<Dim> frustum(const Vec<Dim>& from, const Vec<Dim>& to, double radius_from,
                      double radius_to) {
  if constexpr (Dim == 3) {
    return std::make_shared<Frustum>(from, to, radius_from, radius_to);
  } else {
    const Vec<2> axis = (to - from).normalized(), across(-axis.y(), axis.x());
    std::vector<Vec<2>> corner;
    if (radius_from > 0) corner.push_back(from + radius_from * across);
    corner.push_back(from - radius_from * across);
    corner.push_back(to - radius_to * across);
    if (radius_to > 0) corner.push_back(to + radius_to * across);
    return polygon(std::move(corner));
  }
}

template <int Dim>
SolidPtr<Dim> below(std::shared_ptr<const Surface<Dim>> surface) {
  return std::make_shared<Below<Dim>>(std::move(surface));
}

SolidPtr<2> polygon(std::vector<Vec<2>> corners) {
  return std::make_shared<Polygon>(std::move(corners));
}

#define LAHAR_INSTANTIATE(Dim)                                                           \
  template SolidPtr<Dim> half_space<Dim>(const Vec<Dim>&, const Vec<Dim>&);              \
  template SolidPtr<Dim> ball<Dim>(const Vec<Dim>&, double);                             \
  template SolidPtr<Dim> box<Dim>(const Vec<Dim>&, const Vec<Dim>&);                     \
  template SolidPtr<Dim> frustum<Dim>(const Vec<Dim>&, const Vec<Dim>&, double, double); \
  template SolidPtr<Dim> below<Dim>(std::shared_ptr<const Surface<Dim>>);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
