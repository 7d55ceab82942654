// Solids made of others.
#include <algorithm>
#include <limits>

#include "physics/geometry/solid.h"

namespace lahar {

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

template <int Dim>
using Near = typename Solid<Dim>::Nearest;
template <int Dim>
using Bounds = std::pair<Vec<Dim>, Vec<Dim>>;

template <int Dim>
class Outside final : public Solid<Dim> {
 public:
  explicit Outside(SolidPtr<Dim> solid) : solid_(std::move(solid)) {}
  Near<Dim> nearest(const Vec<Dim>& x) const override {
    const Near<Dim> at = solid_->nearest(x);
    return {-at.distance, -at.normal};
  }
  Bounds<Dim> bounds() const override {
    return {Vec<Dim>::Constant(-inf), Vec<Dim>::Constant(inf)};
  }

 private:
  SolidPtr<Dim> solid_;
};

/// The nearest surface of the union, or the furthest of the intersection.
template <int Dim, bool Union>
class Combined final : public Solid<Dim> {
 public:
  explicit Combined(std::vector<SolidPtr<Dim>> parts) : parts_(std::move(parts)) {}
  Near<Dim> nearest(const Vec<Dim>& x) const override {
    Near<Dim> found = parts_[0]->nearest(x);
    for (std::size_t i = 1; i < parts_.size(); ++i) {
      const Near<Dim> other = parts_[i]->nearest(x);
      if (Union ? other.distance < found.distance : other.distance > found.distance) found = other;
    }
    return found;
  }
  Bounds<Dim> bounds() const override {
    Bounds<Dim> box = parts_[0]->bounds();
    for (std::size_t i = 1; i < parts_.size(); ++i) {
      const Bounds<Dim> other = parts_[i]->bounds();
      if (Union)
        box = {box.first.cwiseMin(other.first), box.second.cwiseMax(other.second)};
      else
        box = {box.first.cwiseMax(other.first), box.second.cwiseMin(other.second)};
    }
    return box;
  }

 private:
  std::vector<SolidPtr<Dim>> parts_;
};

/// The area of outlines.
class Area final : public Solid<2> {
 public:
  explicit Area(std::shared_ptr<const Outlines> outlines) : outlines_(std::move(outlines)) {}
  Near<2> nearest(const Vec<2>& x) const override {
    const Vec<2> from = outlines_->from_edge(x);
    const double distance = from.norm();
    if (distance == 0) return {0, Vec<2>::UnitX()};
    const double side = outlines_->contains(x, 0) ? -1 : 1;
    return {side * distance, side / distance * from};
  }
  Bounds<2> bounds() const override { return outlines_->bounds(); }

 private:
  std::shared_ptr<const Outlines> outlines_;
};

/// A solid in the plane, extruded along an axis without end.
class Extruded final : public Solid<3> {
 public:
  Extruded(SolidPtr<2> section, int axis) : section_(std::move(section)), axis_(axis) {}
  Near<3> nearest(const Vec<3>& x) const override {
    const int a = (axis_ + 1) % 3, b = (axis_ + 2) % 3;
    const Near<2> at = section_->nearest({x[a], x[b]});
    Vec<3> normal = Vec<3>::Zero();
    normal[a] = at.normal.x();
    normal[b] = at.normal.y();
    return {at.distance, normal};
  }
  Bounds<3> bounds() const override {
    const int a = (axis_ + 1) % 3, b = (axis_ + 2) % 3;
    const Bounds<2> plane = section_->bounds();
    Bounds<3> box{Vec<3>::Constant(-inf), Vec<3>::Constant(inf)};
    box.first[a] = plane.first.x(), box.first[b] = plane.first.y();
    box.second[a] = plane.second.x(), box.second[b] = plane.second.y();
    return box;
  }

 private:
  SolidPtr<2> section_;
  int axis_;
};

}  // namespace

template <int Dim>
SolidPtr<Dim> united(std::vector<SolidPtr<Dim>> parts) {
  if (parts.size() == 1) return parts[0];
  return std::make_shared<Combined<Dim, true>>(std::move(parts));
}

template <int Dim>
SolidPtr<Dim> common(std::vector<SolidPtr<Dim>> parts) {
  if (parts.size() == 1) return parts[0];
  return std::make_shared<Combined<Dim, false>>(std::move(parts));
}

template <int Dim>
SolidPtr<Dim> outside(SolidPtr<Dim> solid) {
  return std::make_shared<Outside<Dim>>(std::move(solid));
}

template <int Dim>
SolidPtr<Dim> difference(std::vector<SolidPtr<Dim>> parts) {
  for (std::size_t i = 1; i < parts.size(); ++i) parts[i] = outside(std::move(parts[i]));
  return common(std::move(parts));
}

SolidPtr<3> prism(std::vector<Vec<2>> corners, int axis, double low, double high) {
  std::vector<SolidPtr<3>> parts{std::make_shared<Extruded>(polygon(std::move(corners)), axis)};
  const Vec<3> along = Vec<3>::Unit(axis);
  if (low > -inf) parts.push_back(half_space<3>(low * along, -along));
  if (high < inf) parts.push_back(half_space<3>(high * along, along));
  return common(std::move(parts));
}

SolidPtr<3> under(std::shared_ptr<const Outlines> outlines) {
  return std::make_shared<Extruded>(std::make_shared<Area>(std::move(outlines)), 2);
}

#define LAHAR_INSTANTIATE(Dim)                                    \
  template SolidPtr<Dim> outside<Dim>(SolidPtr<Dim>);             \
  template SolidPtr<Dim> united<Dim>(std::vector<SolidPtr<Dim>>); \
  template SolidPtr<Dim> common<Dim>(std::vector<SolidPtr<Dim>>); \
  template SolidPtr<Dim> difference<Dim>(std::vector<SolidPtr<Dim>>);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
