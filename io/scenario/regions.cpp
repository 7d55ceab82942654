#include "io/scenario/regions.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "io/json/values.h"

namespace lahar {

namespace {

template <int Dim>
using Box = std::pair<Vec<Dim>, Vec<Dim>>;

template <int Dim>
Box<Dim> everywhere() {
  constexpr double inf = std::numeric_limits<double>::infinity();
  return {Vec<Dim>::Constant(-inf), Vec<Dim>::Constant(inf)};
}

/// A region is kept as the function that tests a point, and a box around it.
template <int Dim>
struct Test {
  std::function<bool(const Vec<Dim>&)> contains;
  Box<Dim> bounds = everywhere<Dim>();
};

}  // namespace

template <int Dim>
struct Region<Dim>::Shape {
  Test<Dim> test;
};

namespace {

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
    if (key == "all") return {[yes = shape.as<bool>()](const Vec<Dim>&) { return yes; }};
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
    return {[a, b](const Vec<Dim>& x) {
              return (x.array() >= a.array()).all() && (x.array() <= b.array()).all();
            },
            {a, b}};
  }

  Test<Dim> half_space(const JsonValue& v) {
    const auto point = get_vector<Dim>(v, "point"), normal = get_vector<Dim>(v, "normal");
    if (!point || !normal) return {};
    if (normal->norm() == 0) {
      error(*v.find("normal"), "the normal must not be zero");
      return {};
    }
    const Vec<Dim> n = normal->normalized();
    Box<Dim> bounds = everywhere<Dim>();
    for (int d = 0; d < Dim; ++d)
      if (std::abs(n[d]) == 1.0)
        (n[d] > 0 ? bounds.second : bounds.first)[d] = (*point)[d] + n[d] * eps_;
    return {[p = *point, n, eps = eps_](const Vec<Dim>& x) { return (x - p).dot(n) <= eps; },
            bounds};
  }

  Test<Dim> sphere(const JsonValue& v) {
    const auto centre = get_vector<Dim>(v, "centre");
    const auto radius = get_number(v, "radius");
    if (!centre || !radius) return {};
    const Vec<Dim> half = Vec<Dim>::Constant(*radius + eps_);
    return {[c = *centre, r = half[0]](const Vec<Dim>& x) { return (x - c).norm() <= r; },
            {*centre - half, *centre + half}};
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
    const Vec<Dim> half = Vec<Dim>::Constant(*radius + 2 * eps_);
    return {[=, p = *from, r = *radius + eps_, eps = eps_](const Vec<Dim>& x) {
              const double along = (x - p).dot(axis);
              return along >= -eps && along <= length + eps && (x - p - along * axis).norm() <= r;
            },
            {from->cwiseMin(*to) - half, from->cwiseMax(*to) + half}};
  }

  Test<Dim> polygon(const JsonValue& v);

  Test<Dim> combination(const std::string& key, const JsonValue& v) {
    std::vector<Test<Dim>> parts;
    for (const auto& item : v.as<JsonValue::Array>()) {
      parts.push_back(read(item));
      if (!parts.back().contains) return {};
    }
    if (parts.empty()) {
      error(v, fmt::format("'{}' needs at least one region", key));
      return {};
    }
    Box<Dim> bounds = parts[0].bounds;
    auto& [low, high] = bounds;
    if (key == "union") {
      for (const auto& [contains, box] : parts)
        low = low.cwiseMin(box.first), high = high.cwiseMax(box.second);
      return {[parts](const Vec<Dim>& x) {
                for (const auto& part : parts)
                  if (part.contains(x)) return true;
                return false;
              },
              bounds};
    }
    if (key == "intersection") {
      for (const auto& [contains, box] : parts)
        low = low.cwiseMax(box.first), high = high.cwiseMin(box.second);
      return {[parts](const Vec<Dim>& x) {
                for (const auto& part : parts)
                  if (!part.contains(x)) return false;
                return true;
              },
              bounds};
    }
    return {[parts](const Vec<Dim>& x) {
              for (std::size_t i = 1; i < parts.size(); ++i)
                if (parts[i].contains(x)) return false;
              return parts[0].contains(x);
            },
            bounds};
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
    return {[corner, eps = eps_](const Vec<2>& x) { return in_polygon(corner, x, eps); },
            {low_corner.array() - eps_, high_corner.array() + eps_}};
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
    Box<3> bounds;
    bounds.first[axis] = low - eps_, bounds.second[axis] = high + eps_;
    bounds.first[a] = low_corner[0] - eps_, bounds.second[a] = high_corner[0] + eps_;
    bounds.first[b] = low_corner[1] - eps_, bounds.second[b] = high_corner[1] + eps_;
    return {[=, eps = eps_](const Vec<3>& x) {
              return x[axis] >= low - eps && x[axis] <= high + eps &&
                     in_polygon(corner, {x[a], x[b]}, eps);
            },
            bounds};
  }
}

}  // namespace

template <int Dim>
Region<Dim>::Region(const Vec<Dim>& low, const Vec<Dim>& high)
    : shape_(std::make_unique<Shape>(Shape{{[low, high](const Vec<Dim>& x) {
                                              return (x.array() >= low.array()).all() &&
                                                     (x.array() <= high.array()).all();
                                            },
                                            {low, high}}})) {}

template <int Dim>
Region<Dim>::Region() : shape_(std::make_unique<Shape>()) {
  shape_->test.contains = [](const Vec<Dim>&) { return true; };
}

template <int Dim>
Region<Dim>::Region(const JsonValue& value, double tolerance, const JsonDocument& document,
                    ProblemList& problems)
    : Region() {
  if (!value.is<JsonValue::Object>()) return;
  auto test = RegionReader<Dim>(tolerance, document, problems).read(value);
  if (test.contains) {
    shape_->test = std::move(test);
    return;
  }
  // Reported. Everywhere could be a great many cells.
  constexpr double inf = std::numeric_limits<double>::infinity();
  shape_->test = {[](const Vec<Dim>&) { return false; },
                  {Vec<Dim>::Constant(inf), Vec<Dim>::Constant(-inf)}};
}

template <int Dim>
Region<Dim>::Region(Region&&) noexcept = default;
template <int Dim>
Region<Dim>& Region<Dim>::operator=(Region&&) noexcept = default;
template <int Dim>
Region<Dim>::~Region() = default;

template <int Dim>
bool Region<Dim>::contains(const Vec<Dim>& x) const {
  return shape_->test.contains(x);
}

template <int Dim>
const Box<Dim>& Region<Dim>::bounds() const {
  return shape_->test.bounds;
}

namespace {

/// The points of a grid between two positions, both included; the first axis runs fastest.
template <int Dim>
struct GridBox {
  std::array<Index, Dim> size, from, to;

  Index points() const {
    Index n = 1;
    for (std::size_t d = 0; d < Dim; ++d) n *= std::max<Index>(to[d] - from[d] + 1, 0);
    return n;
  }
  /// Call `visit(id)` for those with numbers in [begin, end).
  void visit(Index begin, Index end, const std::function<void(Index)>& visit) const {
    if (begin >= end) return;
    std::array<Index, Dim> at = from;
    for (std::size_t d = 0, rest = static_cast<std::size_t>(begin); d < Dim; ++d) {
      const auto width = static_cast<std::size_t>(to[d] - from[d] + 1);
      at[d] += static_cast<Index>(rest % width);
      rest /= width;
    }
    for (Index left = end - begin; left > 0; --left) {
      Index id = 0;
      for (std::size_t d = Dim; d-- > 0;) id = id * size[d] + at[d];
      visit(id);
      for (std::size_t d = 0; d < Dim && ++at[d] > to[d]; ++d) at[d] = from[d];
    }
  }
};

/// Cells (`extra` 0) or nodes (1) of a structured mesh in a box widened by a cell against rounding.
template <int Dim>
GridBox<Dim> grid_near(const Mesh<Dim>& mesh, const Box<Dim>& box, Index extra) {
  GridBox<Dim> grid{mesh.counts(), {}, {}};
  const Vec<Dim> low = (box.first - mesh.origin()).cwiseQuotient(mesh.spacing());
  const Vec<Dim> high = (box.second - mesh.origin()).cwiseQuotient(mesh.spacing());
  for (int d = 0; d < Dim; ++d) {
    const auto k = static_cast<std::size_t>(d);
    grid.size[k] += extra;
    const auto last = static_cast<double>(grid.size[k] - 1);
    grid.from[k] = static_cast<Index>(std::clamp(std::floor(low[d]) - 1, 0.0, last + 1));
    grid.to[k] = static_cast<Index>(std::clamp(std::floor(high[d]) + 1, -1.0, last));
  }
  return grid;
}

}  // namespace

template <int Dim>
CellsNear<Dim>::CellsNear(const Mesh<Dim>& mesh, const Region<Dim>& region)
    : grid_(mesh.is_structured()), size_(mesh.n_cells()) {
  if (!grid_) return;
  const GridBox<Dim> grid = grid_near<Dim>(mesh, region.bounds(), 0);
  counts_ = grid.size;
  low_ = grid.from;
  high_ = grid.to;
  size_ = grid.points();
}

template <int Dim>
void CellsNear<Dim>::visit(Index begin, Index end, const std::function<void(Index)>& visit) const {
  if (grid_) return GridBox<Dim>{counts_, low_, high_}.visit(begin, end, visit);
  for (Index cell = begin; cell < end; ++cell) visit(cell);
}

template <int Dim>
void for_cells_near(const Mesh<Dim>& mesh, const Region<Dim>& region,
                    const std::function<void(Index)>& visit) {
  const CellsNear<Dim> cells(mesh, region);
  cells.visit(0, cells.size(), visit);
}

template <int Dim>
void for_nodes_near(const Mesh<Dim>& mesh, const Region<Dim>& region,
                    const std::function<void(Index)>& visit) {
  if (mesh.is_structured()) {
    const GridBox<Dim> grid = grid_near<Dim>(mesh, region.bounds(), 1);
    return grid.visit(0, grid.points(), visit);
  }
  for (Index node = 0; node < mesh.n_nodes(); ++node) visit(node);
}

#define LAHAR_INSTANTIATE(Dim)                                            \
  template class Region<Dim>;                                             \
  template class CellsNear<Dim>;                                          \
  template void for_cells_near<Dim>(const Mesh<Dim>&, const Region<Dim>&, \
                                    const std::function<void(Index)>&);   \
  template void for_nodes_near<Dim>(const Mesh<Dim>&, const Region<Dim>&, \
                                    const std::function<void(Index)>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
