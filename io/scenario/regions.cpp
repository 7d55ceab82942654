#include "io/scenario/regions.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "io/json/values.h"
#include "io/scenario/region_shape.h"

namespace lahar {

namespace {

template <int Dim>
class RegionReader {
 public:
  RegionReader(double tolerance, const JsonDocument& document, ProblemList& problems,
               const Geometries<Dim>& geometries)
      : eps_(tolerance), document_(document), problems_(problems), geometries_(geometries) {}

  RegionShape<Dim> read(const JsonValue& value) {
    const auto& members = value.as<JsonValue::Object>();
    if (members.size() != 1) {
      error(value, members.empty() ? "a region needs a shape" : "a region has exactly one shape",
            "for example {\"box\": {\"min\": [0, 0], \"max\": [1, 1]}}; combine several with "
            "\"union\", \"intersection\" or \"difference\"");
      return {};
    }
    const auto& [key, offset, shape] = members.front();
    if (!shape.valid()) return {};
    if (key == "box") return box(shape);
    if (key == "half_space") return half_space(shape);
    if (key == "sphere") return sphere(shape);
    if (key == "cylinder") return cylinder(shape);
    if (key == "polygon") return polygon(shape);
    if (key == "all") return all(shape.as<bool>());
    if (key == "between") return between(shape);
    if (key == "below" || key == "above" || key == "inside" || key == "under")
      return named(key, shape);
    return combination(key, shape);
  }

 private:
  void error(const JsonValue& at, std::string message, std::string hint = "") {
    problems_.error(document_.at(at, std::move(message), std::move(hint)));
  }

  RegionShape<Dim> all(bool yes) {
    return {
        [yes](const Vec<Dim>&) { return yes; }, RegionShape<Dim>::everywhere(),
        [yes](const Vec<Dim>&, const Vec<Dim>&) { return yes ? Coverage::all : Coverage::none; }};
  }

  RegionShape<Dim> box(const JsonValue& v) {
    constexpr double inf = std::numeric_limits<double>::infinity();
    const auto low = get_vector<Dim>(v, "min").value_or(Vec<Dim>::Constant(-inf));
    const auto high = get_vector<Dim>(v, "max").value_or(Vec<Dim>::Constant(inf));
    for (int d = 0; d < Dim; ++d)
      if (low[d] > high[d]) {
        error(v, fmt::format("the box is empty: min {} is above max {} along {}", low[d], high[d],
                             "xyz"[d]));
        return {};
      }
    const Vec<Dim> a = low.array() - eps_, b = high.array() + eps_;
    RegionShape<Dim> out{[a, b](const Vec<Dim>& x) {
                           return (x.array() >= a.array()).all() && (x.array() <= b.array()).all();
                         },
                         {a, b},
                         [a, b](const Vec<Dim>& from, const Vec<Dim>& to) {
                           if ((to.array() <= a.array()).any() || (from.array() >= b.array()).any())
                             return Coverage::none;
                           const bool in =
                               (from.array() >= a.array()).all() && (to.array() <= b.array()).all();
                           return in ? Coverage::all : Coverage::part;
                         }};
    out.solid = solid_box(low, high);
    return out;
  }

  /// Sides without a bound have no surface.
  static SolidPtr<Dim> solid_box(const Vec<Dim>& low, const Vec<Dim>& high) {
    const bool from = low.allFinite(), to = high.allFinite();
    if (from && to) return ((high - low).array() > 0).all() ? lahar::box<Dim>(low, high) : nullptr;
    if (!from && !to) return nullptr;
    std::vector<SolidPtr<Dim>> sides;
    for (int d = 0; d < Dim; ++d)
      sides.push_back(
          lahar::half_space<Dim>(from ? low : high, (from ? -1.0 : 1.0) * Vec<Dim>::Unit(d)));
    return common(std::move(sides));
  }

  RegionShape<Dim> half_space(const JsonValue& v) {
    const auto point = get_vector<Dim>(v, "point"), normal = get_vector<Dim>(v, "normal");
    if (!point || !normal) return {};
    if (normal->norm() == 0) {
      error(*v.find("normal"), "the normal must not be zero");
      return {};
    }
    const Vec<Dim> n = normal->normalized();
    auto bounds = RegionShape<Dim>::everywhere();
    for (int d = 0; d < Dim; ++d)
      if (std::abs(n[d]) == 1.0)
        (n[d] > 0 ? bounds.second : bounds.first)[d] = (*point)[d] + n[d] * eps_;
    RegionShape<Dim> out{
        [p = *point, n, eps = eps_](const Vec<Dim>& x) { return (x - p).dot(n) <= eps; }, bounds,
        [p = *point, n, eps = eps_](const Vec<Dim>& low, const Vec<Dim>& high) {
          const double at = (0.5 * (low + high) - p).dot(n);
          const double reach = 0.5 * (high - low).dot(n.cwiseAbs());
          return at - reach > eps    ? Coverage::none
                 : at + reach <= eps ? Coverage::all
                                     : Coverage::part;
        }};
    out.solid = lahar::half_space<Dim>(*point, n);
    return out;
  }

  RegionShape<Dim> sphere(const JsonValue& v) {
    const auto centre = get_vector<Dim>(v, "centre");
    const auto radius = get_number(v, "radius");
    if (!centre || !radius) return {};
    const Vec<Dim> half = Vec<Dim>::Constant(*radius + eps_);
    RegionShape<Dim> out{
        [c = *centre, r = half[0]](const Vec<Dim>& x) { return (x - c).norm() <= r; },
        {*centre - half, *centre + half},
        [c = *centre, r = half[0], eps = eps_](const Vec<Dim>& low, const Vec<Dim>& high) {
          return coverage_of<Dim>((0.5 * (low + high) - c).norm() - r, low, high, eps);
        }};
    out.solid = ball<Dim>(*centre, *radius);
    return out;
  }

  RegionShape<Dim> cylinder(const JsonValue& v) {
    const auto from = get_vector<Dim>(v, "from"), to = get_vector<Dim>(v, "to");
    const auto radius = get_number(v, "radius");
    if (!from || !to || !radius) return {};
    const double length = (*to - *from).norm();
    if (length == 0) {
      error(v, "the ends of a cylinder must differ");
      return {};
    }
    const Vec<Dim> axis = (*to - *from) / length;
    const double end = get_number(v, "radius_to").value_or(*radius);
    const double slope = (end - *radius) / length, steep = 1 / std::sqrt(1 + slope * slope);
    const Vec<Dim> disc = (1 - axis.array().square()).max(0.0).sqrt();  // reach of a radius of 1
    const Vec<Dim> margin = Vec<Dim>::Constant(2 * eps_);
    const Vec<Dim> near = *radius * disc, far = end * disc;
    const auto beyond = [=, p = *from, r = *radius](const Vec<Dim>& x) {  // the ends, the side
      const double along = (x - p).dot(axis), across = (x - p - along * axis).norm();
      return std::pair(std::max(-along, along - length), (across - r - slope * along) * steep);
    };
    RegionShape<Dim> out{
        [=, eps = eps_](const Vec<Dim>& x) {
          const auto [ends, side] = beyond(x);
          return ends <= eps && side <= eps;
        },
        {(*from - near).cwiseMin(*to - far) - margin, (*from + near).cwiseMax(*to + far) + margin},
        [=, eps = eps_](const Vec<Dim>& low, const Vec<Dim>& high) {
          const auto [ends, side] = beyond(0.5 * (low + high));
          return coverage_of<Dim>(std::max(ends, side), low, high, eps);
        }};
    out.solid = frustum<Dim>(*from, *to, *radius, end);
    return out;
  }

  RegionShape<Dim> polygon(const JsonValue& v);

  RegionShape<Dim> combination(const std::string& key, const JsonValue& v) {
    std::vector<RegionShape<Dim>> parts;
    for (const auto& item : v.as<JsonValue::Array>()) {
      parts.push_back(read(item));
      if (!parts.back().contains) return {};
    }
    if (parts.empty()) {
      error(v, fmt::format("'{}' needs at least one region", key));
      return {};
    }
    if (key == "union") return union_of(std::move(parts));
    if (key == "intersection") return intersection_of(std::move(parts));
    return difference_of(std::move(parts));
  }

  /// The shape of this name; null if there is none, or none that could be read (reported).
  const Geometry<Dim>* find(const JsonValue& name) {
    const auto it = geometries_.find(name.as<std::string>());
    if (it != geometries_.end()) return it->second.known() ? &it->second : nullptr;
    std::vector<std::string> names;
    for (const auto& [known, geometry] : geometries_) names.push_back(known);
    error(name, fmt::format("there is no geometry named '{}'", name.as<std::string>()),
          names.empty() ? "name surfaces, solids and polygons under \"geometry\""
                        : suggest(name.as<std::string>(), names, "geometries"));
    return nullptr;
  }

  RegionShape<Dim> named(const std::string& key, const JsonValue& name) {
    const Geometry<Dim>* at = find(name);
    if (!at) return {};
    if (key == "below" && at->surface) return side_of_surface<Dim>(at->surface, 1, eps_);
    if (key == "above" && at->surface) return side_of_surface<Dim>(at->surface, -1, eps_);
    if (key == "inside" && at->solid) return inside_solid<Dim>(at->solid, eps_);
    if constexpr (Dim == 3)
      if (key == "under" && at->outlines) return under_outlines(at->outlines, eps_);
    const char* wanted = key == "inside" ? "a solid" : key == "under" ? "polygons" : "a surface";
    error(name,
          fmt::format("'{}' needs {}, but the geometry '{}' is {}", key, wanted,
                      name.as<std::string>(), at->kind()),
          at->surface    ? "write \"below\", \"above\" or \"between\""
          : at->outlines ? "write \"under\""
                         : "write \"inside\"");
    return {};
  }

  RegionShape<Dim> between(const JsonValue& v) {
    const auto& names = v.as<JsonValue::Array>();
    if (names.size() != 2) {
      error(v, fmt::format("'between' needs the names of two surfaces, found {}", names.size()),
            "[lower, upper]");
      return {};
    }
    RegionShape<Dim> above = named("above", names[0]), below = named("below", names[1]);
    if (!above.contains || !below.contains) return {};
    const double low = above.bounds.first[Dim - 1], high = below.bounds.second[Dim - 1];
    if (low > high + eps_) {
      error(v,
            fmt::format("nothing lies between: '{}' is nowhere below '{}'",
                        names[0].as<std::string>(), names[1].as<std::string>()),
            "the lower surface comes first");
      return {};
    }
    RegionShape<Dim> out = intersection_of<Dim>({std::move(above), std::move(below)});
    // Where the surfaces touch, nothing lies between them, whatever the tolerance.
    out.contains = [both = std::move(out.contains), lower = find(names[0])->surface,
                    upper = find(names[1])->surface, least = 2 * eps_](const Vec<Dim>& x) {
      return both(x) && !(upper->height(x) - lower->height(x) <= least);
    };
    return out;
  }

  double eps_;
  const JsonDocument& document_;
  ProblemList& problems_;
  const Geometries<Dim>& geometries_;
};

// Inside by the crossing rule, or within eps of an edge.
bool in_polygon(const std::vector<Vec<2>>& corner, const Vec<2>& x, double eps) {
  bool inside = false;
  for (std::size_t i = 0, j = corner.size() - 1; i < corner.size(); j = i++) {
    const Vec<2> edge = corner[j] - corner[i], to = x - corner[i];
    const double squared = edge.squaredNorm();
    const double t = squared > 0 ? std::clamp(to.dot(edge) / squared, 0.0, 1.0) : 0.0;
    if ((to - t * edge).norm() <= eps) return true;
    if ((corner[i].y() > x.y()) != (corner[j].y() > x.y()) && to.x() < edge.x() * to.y() / edge.y())
      inside = !inside;
  }
  return inside;
}

double area_of(const Vec<2>& a, const Vec<2>& b, const Vec<2>& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

// The first two edges that cross each other between their ends; edges that touch do not.
std::optional<std::pair<std::size_t, std::size_t>> crossing_edges(
    const std::vector<Vec<2>>& corner) {
  const std::size_t n = corner.size();
  const auto end = [&](std::size_t i) -> const Vec<2>& { return corner[(i + 1) % n]; };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j) {
      const Vec<2>&a = corner[i], &b = end(i), &c = corner[j], &d = end(j);
      if (std::max(a.x(), b.x()) < std::min(c.x(), d.x()) ||
          std::max(c.x(), d.x()) < std::min(a.x(), b.x()))
        continue;
      if (area_of(a, b, c) * area_of(a, b, d) < 0 && area_of(c, d, a) * area_of(c, d, b) < 0)
        return std::pair(i, j);
    }
  return std::nullopt;
}

template <int Dim>
RegionShape<Dim> RegionReader<Dim>::polygon(const JsonValue& v) {
  const JsonValue* list = v.find("points");
  if (!list) return {};
  std::vector<Vec<2>> corner;
  for (const auto& p : list->as<JsonValue::Array>()) {
    const auto& xy = p.as<JsonValue::Array>();
    corner.emplace_back(xy[0].number(), xy[1].number());
  }
  if (corner.size() < 3) {
    error(*list, fmt::format("a polygon needs at least three points, found {}", corner.size()));
    return {};
  }
  if (const auto edges = crossing_edges(corner)) {
    const auto edge = [&](std::size_t i) {
      const Vec<2>&a = corner[i], &b = corner[(i + 1) % corner.size()];
      return fmt::format("({}, {}) to ({}, {})", a.x(), a.y(), b.x(), b.y());
    };
    problems_.warning(document_.at(
        *list,
        fmt::format("the polygon crosses itself: its edges {} and {} do", edge(edges->first),
                    edge(edges->second)),
        "points are those of the outline, in order; what it goes around twice is outside"));
  }
  Vec<2> low_corner = corner[0], high_corner = corner[0];
  for (const Vec<2>& x : corner)
    low_corner = low_corner.cwiseMin(x), high_corner = high_corner.cwiseMax(x);
  if constexpr (Dim == 2) {
    for (const char* key : {"axis", "range"})
      if (v.find(key)) {
        error(*v.find(key), fmt::format("'{}' has no meaning in two dimensions", key));
        return {};
      }
    RegionShape<2> out{
        [corner, eps = eps_](const Vec<2>& x) { return in_polygon(corner, x, eps); },
        {low_corner.array() - eps_, high_corner.array() + eps_},
        [=, outline = Outlines({{corner}}), eps = eps_](const Vec<2>& low, const Vec<2>& high) {
          if (outline.crosses(low, high)) return Coverage::part;
          return in_polygon(corner, 0.5 * (low + high), eps) ? Coverage::all : Coverage::none;
        }};
    out.solid = lahar::polygon(corner);
    out.exact = true;
    return out;
  } else {
    const int axis = get_direction(v, "axis").value_or(2);
    double low = -std::numeric_limits<double>::infinity(), high = -low;
    if (const JsonValue* range = v.find("range")) {
      const auto bounds = get_numbers(v, "range");
      if (bounds.size() != 2 || bounds[0] > bounds[1]) {
        error(*range, "'range' must be [from, to] with from <= to");
        return {};
      }
      low = bounds[0], high = bounds[1];
    }
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    RegionShape<3>::Box bounds;
    bounds.first[axis] = low - eps_, bounds.second[axis] = high + eps_;
    bounds.first[a] = low_corner[0] - eps_, bounds.second[a] = high_corner[0] + eps_;
    bounds.first[b] = low_corner[1] - eps_, bounds.second[b] = high_corner[1] + eps_;
    RegionShape<3> out{
        [=, eps = eps_](const Vec<3>& x) {
          return x[axis] >= low - eps && x[axis] <= high + eps &&
                 in_polygon(corner, {x[a], x[b]}, eps);
        },
        bounds,
        [=, outline = Outlines({{corner}}), eps = eps_](const Vec<3>& from, const Vec<3>& to) {
          if (to[axis] < low || from[axis] > high) return Coverage::none;
          const Vec<2> p(from[a], from[b]), q(to[a], to[b]);
          if (outline.crosses(p, q)) return Coverage::part;
          if (!in_polygon(corner, 0.5 * (p + q), eps)) return Coverage::none;
          const bool within = from[axis] >= low && to[axis] <= high;
          return within ? Coverage::all : Coverage::part;
        }};
    if (low < high) out.solid = prism(corner, axis, low, high);
    out.exact = true;
    return out;
  }
}

}  // namespace

template <int Dim>
Region<Dim>::Region(const Vec<Dim>& low, const Vec<Dim>& high)
    : shape_(std::make_unique<RegionShape<Dim>>()) {
  shape_->contains = [low, high](const Vec<Dim>& x) {
    return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
  };
  shape_->bounds = {low, high};
}

template <int Dim>
Region<Dim>::Region() : shape_(std::make_unique<RegionShape<Dim>>()) {
  shape_->contains = [](const Vec<Dim>&) { return true; };
  shape_->coverage = [](const Vec<Dim>&, const Vec<Dim>&) { return Coverage::all; };
}

template <int Dim>
Region<Dim>::Region(const JsonValue& value, double tolerance, const JsonDocument& document,
                    ProblemList& problems, const Geometries<Dim>& geometries)
    : Region() {
  known_ = value.is<JsonValue::Object>();
  if (!known_) return;
  auto shape = RegionReader<Dim>(tolerance, document, problems, geometries).read(value);
  if (shape.contains) {
    *shape_ = std::move(shape);
    return;
  }
  known_ = false;
  // Everywhere could be a great many cells.
  constexpr double inf = std::numeric_limits<double>::infinity();
  shape_->contains = [](const Vec<Dim>&) { return false; };
  shape_->bounds = {Vec<Dim>::Constant(inf), Vec<Dim>::Constant(-inf)};
}

template <int Dim>
Region<Dim>::Region(std::shared_ptr<const Surface<Dim>> surface, double tolerance)
    : shape_(std::make_unique<RegionShape<Dim>>(
          side_of_surface<Dim>(std::move(surface), 1, tolerance))) {}

template <int Dim>
Region<Dim>::Region(const std::vector<const Region*>& in_all,
                    const std::vector<const Region*>& in_none)
    : Region() {
  std::vector<RegionShape<Dim>> all, first_and_others;
  for (const Region* region : in_all) all.push_back(*region->shape_);
  first_and_others.push_back(intersection_of(std::move(all)));
  for (const Region* region : in_none) first_and_others.push_back(*region->shape_);
  *shape_ = difference_of(std::move(first_and_others));
}

template <int Dim>
Region<Dim>::Region(Region&&) noexcept = default;
template <int Dim>
Region<Dim>& Region<Dim>::operator=(Region&&) noexcept = default;
template <int Dim>
Region<Dim>::~Region() = default;

template <int Dim>
bool Region<Dim>::contains(const Vec<Dim>& x) const {
  return shape_->contains(x);
}

template <int Dim>
Coverage Region<Dim>::coverage(const Vec<Dim>& low, const Vec<Dim>& high) const {
  return shape_->coverage(low, high);
}

template <int Dim>
std::function<bool(const Vec<Dim>&)> Region<Dim>::contains_within(const Vec<Dim>& low,
                                                                  const Vec<Dim>& high) const {
  return shape_->contains_within(low, high);
}

template <int Dim>
bool Region<Dim>::cuts_exactly() const {
  return shape_->exact;
}

template <int Dim>
const SolidPtr<Dim>& Region<Dim>::solid() const {
  return shape_->solid;
}

template <int Dim>
const std::pair<Vec<Dim>, Vec<Dim>>& Region<Dim>::bounds() const {
  return shape_->bounds;
}

template class Region<2>;
template class Region<3>;

}  // namespace lahar
