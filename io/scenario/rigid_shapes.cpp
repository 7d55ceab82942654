#include "io/scenario/rigid_shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/json/values.h"

namespace lahar {

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

/// A prism without ends.
class UnderOutlines final : public Solid<3> {
 public:
  explicit UnderOutlines(std::shared_ptr<const Outlines> outlines)
      : outlines_(std::move(outlines)) {}
  Nearest nearest(const Vec<3>& x) const override {
    const Vec<2> from = outlines_->from_edge(x.head<2>());
    const double distance = from.norm();
    if (distance == 0) return {0, Vec<3>::UnitX()};
    const double side = outlines_->contains(x.head<2>(), 0) ? -1 : 1;
    Vec<3> normal = Vec<3>::Zero();
    normal.head<2>() = side / distance * from;
    return {side * distance, normal};
  }
  std::pair<Vec<3>, Vec<3>> bounds() const override {
    const auto& [low, high] = outlines_->bounds();
    return {{low.x(), low.y(), -inf}, {high.x(), high.y(), inf}};
  }

 private:
  std::shared_ptr<const Outlines> outlines_;
};

template <int Dim>
class SolidReader {
 public:
  explicit SolidReader(const Geometries<Dim>& geometries) : geometries_(geometries) {}

  SolidPtr<Dim> read(const JsonValue& value) {
    if (!value.is<JsonValue::Object>()) return nullptr;
    const auto& members = value.as<JsonValue::Object>();
    if (members.size() != 1) return nullptr;
    const auto& [key, offset, shape] = members.front();
    if (!shape.valid()) return nullptr;
    if (key == "box") return axis_box(shape);
    if (key == "half_space") return plane(shape);
    if (key == "sphere") return sphere(shape);
    if (key == "cylinder") return cylinder(shape);
    if (key == "polygon") return outline(shape);
    if (key == "below" || key == "above") return side(shape, key == "above");
    if (key == "between") return between(shape);
    if (key == "inside") return named_solid(shape);
    if (key == "under") return prism_under(shape);
    if (key == "union" || key == "intersection" || key == "difference")
      return combination(key, shape);
    return nullptr;
  }

 private:
  /// A side without a bound has no surface.
  SolidPtr<Dim> axis_box(const JsonValue& v) {
    const auto low = get_vector<Dim>(v, "min"), high = get_vector<Dim>(v, "max");
    if (low && high) {
      if (((*high - *low).array() > 0).all()) return box<Dim>(*low, *high);
      return nullptr;
    }
    if (!low && !high) return nullptr;
    std::vector<SolidPtr<Dim>> sides;
    for (int d = 0; d < Dim; ++d) {
      const Vec<Dim> normal = (low ? -1.0 : 1.0) * Vec<Dim>::Unit(d);
      sides.push_back(half_space<Dim>(low ? *low : *high, normal));
    }
    return common(std::move(sides));
  }

  SolidPtr<Dim> plane(const JsonValue& v) {
    const auto point = get_vector<Dim>(v, "point"), normal = get_vector<Dim>(v, "normal");
    if (!point || !normal) return nullptr;
    if (normal->norm() == 0) return nullptr;
    return half_space<Dim>(*point, normal->normalized());
  }

  SolidPtr<Dim> sphere(const JsonValue& v) {
    const auto centre = get_vector<Dim>(v, "centre");
    const auto radius = get_number(v, "radius");
    return centre && radius ? ball<Dim>(*centre, *radius) : nullptr;
  }

  SolidPtr<Dim> cylinder(const JsonValue& v) {
    const auto from = get_vector<Dim>(v, "from"), to = get_vector<Dim>(v, "to");
    const auto radius = get_number(v, "radius");
    if (!from || !to || !radius) return nullptr;
    if ((*to - *from).norm() == 0) return nullptr;
    return frustum<Dim>(*from, *to, *radius, get_number(v, "radius_to").value_or(*radius));
  }

  SolidPtr<Dim> outline(const JsonValue& v) {
    const JsonValue* list = v.find("points");
    if (!list) return nullptr;
    std::vector<Vec<2>> corner;
    for (const auto& p : list->as<JsonValue::Array>()) {
      const auto& xy = p.as<JsonValue::Array>();
      corner.emplace_back(xy[0].number(), xy[1].number());
    }
    if (corner.size() < 3) return nullptr;
    if constexpr (Dim == 2) {
      return polygon(std::move(corner));
    } else {
      const auto range = get_numbers(v, "range");
      if (!range.empty() && (range.size() != 2 || !(range[0] < range[1]))) return nullptr;
      const bool bounded = range.size() == 2;
      return prism(std::move(corner), get_direction(v, "axis").value_or(2),
                   bounded ? range[0] : -inf, bounded ? range[1] : inf);
    }
  }

  SolidPtr<Dim> side(const JsonValue& name, bool above) {
    const auto* found = named(name);
    if (!found || !found->surface) return nullptr;
    SolidPtr<Dim> solid = below(found->surface);
    return above ? outside(std::move(solid)) : solid;
  }

  SolidPtr<Dim> between(const JsonValue& names) {
    std::vector<SolidPtr<Dim>> sides;
    for (const JsonValue& name : names.as<JsonValue::Array>())
      if (sides.push_back(side(name, sides.empty())); !sides.back()) return nullptr;
    return common(std::move(sides));
  }

  SolidPtr<Dim> named_solid(const JsonValue& name) {
    const auto* found = named(name);
    return found ? found->solid : nullptr;
  }

  SolidPtr<Dim> prism_under(const JsonValue& name) {
    const auto* found = named(name);
    if constexpr (Dim == 3)
      if (found && found->outlines) return std::make_shared<UnderOutlines>(found->outlines);
    return nullptr;
  }

  const Geometry<Dim>* named(const JsonValue& name) {
    if (!name.is<std::string>()) return nullptr;
    const auto at = geometries_.find(name.as<std::string>());
    return at == geometries_.end() ? nullptr : &at->second;
  }

  SolidPtr<Dim> combination(const std::string& key, const JsonValue& v) {
    std::vector<SolidPtr<Dim>> parts;
    for (const auto& item : v.as<JsonValue::Array>())
      if (parts.push_back(read(item)); !parts.back()) return nullptr;
    if (parts.empty()) return nullptr;
    if (key == "union") return united(std::move(parts));
    return key == "intersection" ? common(std::move(parts)) : difference(std::move(parts));
  }

  const Geometries<Dim>& geometries_;
};

}  // namespace

template <int Dim>
SolidPtr<Dim> solid_of_region(const JsonValue& region, const Geometries<Dim>& geometries) {
  return SolidReader<Dim>(geometries).read(region);
}

template <int Dim>
SolidMoments<Dim> moments_of(const Solid<Dim>& solid, int cuts) {
  const auto [low, high] = solid.bounds();
  const double h = (high - low).maxCoeff() / cuts;
  std::array<int, 3> n{1, 1, 1};
  for (int d = 0; d < Dim; ++d)
    n[static_cast<std::size_t>(d)] = std::max(1, static_cast<int>(std::ceil((high - low)[d] / h)));
  SolidMoments<Dim> m;
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const std::array<int, 3> at{i, j, k};
        Vec<Dim> x;
        for (int d = 0; d < Dim; ++d) x[d] = low[d] + (at[static_cast<std::size_t>(d)] + 0.5) * h;
        const auto near = solid.nearest(x);
        // Of the box, what a plane through the nearest point cuts off, by its width along the
        // normal.
        const double width = near.normal.cwiseAbs().sum() * h;
        const double part = std::clamp(0.5 - near.distance / width, 0.0, 1.0);
        const double volume = part * std::pow(h, Dim);
        m.volume += volume;
        m.centre += volume * x;
        Eigen::Vector3d y = Eigen::Vector3d::Zero();
        y.head<Dim>() = x;
        second += volume * (y * y.transpose());
      }
  if (m.volume == 0) return m;
  m.centre /= m.volume;
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  c.head<Dim>() = m.centre;
  second -= m.volume * c * c.transpose();
  m.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  return m;
}

#define LAHAR_INSTANTIATE(Dim)                                                           \
  template SolidPtr<Dim> solid_of_region<Dim>(const JsonValue&, const Geometries<Dim>&); \
  template SolidMoments<Dim> moments_of<Dim>(const Solid<Dim>&, int);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
