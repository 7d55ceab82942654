#include "io/regions.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <functional>

#include "io/values.h"

namespace lahar {

/// A region is kept as the function that tests a point.
template <int Dim>
struct Region<Dim>::Shape {
  std::function<bool(const Vec<Dim>&)> contains;
};

namespace {

template <int Dim>
using Test = std::function<bool(const Vec<Dim>&)>;

template <int Dim>
class RegionReader {
 public:
  RegionReader(double tolerance, const JsonDocument& document, ProblemList& problems)
      : eps_(tolerance), document_(document), problems_(problems) {}

  Test<Dim> read(const JsonValue& value) {
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
    if (key == "all") return [yes = shape.as<bool>()](const Vec<Dim>&) { return yes; };
    return combination(key, shape);
  }

 private:
  void error(const JsonValue& at, std::string message, std::string hint = "") {
    problems_.error(document_.at(at, std::move(message), std::move(hint)));
  }

  Test<Dim> box(const JsonValue& v) {
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
    return [a, b](const Vec<Dim>& x) {
      return (x.array() >= a.array()).all() && (x.array() <= b.array()).all();
    };
  }

  Test<Dim> half_space(const JsonValue& v) {
    const auto point = get_vector<Dim>(v, "point"), normal = get_vector<Dim>(v, "normal");
    if (!point || !normal) return {};
    if (normal->norm() == 0) {
      error(*v.find("normal"), "the normal must not be zero");
      return {};
    }
    const Vec<Dim> n = normal->normalized();
    return [p = *point, n, eps = eps_](const Vec<Dim>& x) { return (x - p).dot(n) <= eps; };
  }

  Test<Dim> sphere(const JsonValue& v) {
    const auto centre = get_vector<Dim>(v, "centre");
    const auto radius = get_number(v, "radius");
    if (!centre || !radius) return {};
    return [c = *centre, r = *radius + eps_](const Vec<Dim>& x) { return (x - c).norm() <= r; };
  }

  Test<Dim> cylinder(const JsonValue& v) {
    const auto from = get_vector<Dim>(v, "from"), to = get_vector<Dim>(v, "to");
    const auto radius = get_number(v, "radius");
    if (!from || !to || !radius) return {};
    const double length = (*to - *from).norm();
    if (length == 0) {
      error(v, "the ends of a cylinder must differ");
      return {};
    }
    const Vec<Dim> axis = (*to - *from) / length;
    return [=, p = *from, r = *radius + eps_, eps = eps_](const Vec<Dim>& x) {
      const double along = (x - p).dot(axis);
      return along >= -eps && along <= length + eps && (x - p - along * axis).norm() <= r;
    };
  }

  Test<Dim> polygon(const JsonValue& v);

  Test<Dim> combination(const std::string& key, const JsonValue& v) {
    std::vector<Test<Dim>> parts;
    for (const auto& item : v.as<JsonValue::Array>()) {
      auto part = read(item);
      if (!part) return {};
      parts.push_back(std::move(part));
    }
    if (parts.empty()) {
      error(v, fmt::format("'{}' needs at least one region", key));
      return {};
    }
    if (key == "union")
      return [parts](const Vec<Dim>& x) {
        for (const auto& in : parts)
          if (in(x)) return true;
        return false;
      };
    if (key == "intersection")
      return [parts](const Vec<Dim>& x) {
        for (const auto& in : parts)
          if (!in(x)) return false;
        return true;
      };
    return [parts](const Vec<Dim>& x) {
      for (std::size_t i = 1; i < parts.size(); ++i)
        if (parts[i](x)) return false;
      return parts[0](x);
    };
  }

  double eps_;
  const JsonDocument& document_;
  ProblemList& problems_;
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

template <int Dim>
Test<Dim> RegionReader<Dim>::polygon(const JsonValue& v) {
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
  if constexpr (Dim == 2) {
    for (const char* key : {"axis", "range"})
      if (v.find(key)) {
        error(*v.find(key), fmt::format("'{}' has no meaning in two dimensions", key));
        return {};
      }
    return [corner, eps = eps_](const Vec<2>& x) { return in_polygon(corner, x, eps); };
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
    return [=, a = (axis + 1) % 3, b = (axis + 2) % 3, eps = eps_](const Vec<3>& x) {
      return x[axis] >= low - eps && x[axis] <= high + eps && in_polygon(corner, {x[a], x[b]}, eps);
    };
  }
}

}  // namespace

template <int Dim>
Region<Dim>::Region() : shape_(std::make_unique<Shape>()) {
  shape_->contains = [](const Vec<Dim>&) { return true; };
}

template <int Dim>
Region<Dim>::Region(const JsonValue& value, double tolerance, const JsonDocument& document,
                    ProblemList& problems)
    : Region() {
  if (!value.is<JsonValue::Object>()) return;
  auto test = RegionReader<Dim>(tolerance, document, problems).read(value);
  if (test) shape_->contains = std::move(test);
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

template class Region<2>;
template class Region<3>;

}  // namespace lahar
