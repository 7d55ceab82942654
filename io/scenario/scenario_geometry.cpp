// Named shapes: surfaces through points and those that follow from others.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"

namespace lahar {

namespace {

constexpr std::array shape_keys = {"points", "raster", "surface", "triangles", "solid", "polygons"};

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_geometry() {
  read_map_origin();  // maps of parameters need it, too
  const JsonValue* named = root_.find("geometry");
  if (!named) return;
  phase("geometry");
  for (const auto& [name, offset, value] : named->as<JsonValue::Object>())
    if (name.empty()) in_.error(value, "a geometry needs a name");
  for (const auto& [name, offset, value] : named->as<JsonValue::Object>())
    build_shape(name, value, {});
}

/// The shape of this name, which may have been built because another follows from it. `users`: the
/// names that led here.
template <int Dim>
void ScenarioBuilder<Dim>::build_shape(const std::string& name, const JsonValue& value,
                                       std::vector<std::string> users) {
  if (!geometry_.emplace(name, Geometry<Dim>{}).second || !value.is<JsonValue::Object>()) return;
  std::vector<std::string> found, all;
  for (const char* key : shape_keys) {
    all.push_back(fmt::format("'{}'", key));
    if (written(value, key)) found.push_back(all.back());
  }
  if (found.size() != 1)
    return in_.error(
        value,
        found.empty() ? fmt::format("the geometry '{}' has no shape", name)
                      : fmt::format("the geometry '{}' has several shapes: {}", name, join(found)),
        fmt::format("give one of {}", join(all)));
  for (const char* key : {"lower_by", "raise_by"})
    if (const JsonValue* by = value.find(key); by && !written(value, "surface"))
      return in_.error(*by, fmt::format("'{}' needs 'surface': what is it to be moved from?", key));
  if (const JsonValue* where = value.find("where"); where && !written(value, "polygons"))
    return in_.error(*where, "'where' needs 'polygons', whose features it selects");
  for (const char* key : {"scale", "offset", "spacing"})
    if (const JsonValue* of = value.find(key);
        of && !written(value, "triangles") && (!written(value, "solid") || key[1] == 'p'))
      return in_.error(*of, fmt::format("'{}' is for surfaces of triangles", key));
  users.push_back(name);
  if (const JsonValue* points = value.find("points")) geometry_[name] = through_points(*points);
  if (const JsonValue* raster = value.find("raster")) geometry_[name] = from_raster(*raster);
  if (value.find("triangles")) geometry_[name] = from_triangles(value);
  if (value.find("solid")) geometry_[name] = from_solid(value);
  if (value.find("polygons")) geometry_[name] = from_polygons(value);
  if (value.find("surface")) geometry_[name] = moved_surface(value, users);
}

namespace {

using Points = JsonValue::Array;

/// Coordinates of points along an axis, ascending, each once.
std::vector<double> coordinates(const Points& points, std::size_t axis) {
  std::vector<double> x;
  for (const JsonValue& p : points) x.push_back(p.as<JsonValue::Array>()[axis].number());
  sort_unique(x);
  return x;
}

std::size_t position(const std::vector<double>& axis, double x) {
  return static_cast<std::size_t>(std::lower_bound(axis.begin(), axis.end(), x) - axis.begin());
}

}  // namespace

template <int Dim>
Geometry<Dim> ScenarioBuilder<Dim>::through_points(const JsonValue& value) {
  const Points& points = value.as<Points>();
  typename Surface<Dim>::Axes axes;
  std::size_t places = 1;
  for (std::size_t d = 0; d < Dim - 1; ++d) {
    axes[d] = coordinates(points, d);
    places *= axes[d].size();
    if (axes[d].size() < 2) {
      in_.error(value, fmt::format("a surface needs points at two places along {} at least, found "
                                   "{}",
                                   "xy"[d], axes[d].size()));
      return {};
    }
  }
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> heights(places, unknown);
  const JsonValue* before = nullptr;
  for (const JsonValue& point : points) {
    const auto& x = point.as<JsonValue::Array>();
    if (Dim == 2 && before && !(x[0].number() > before->as<JsonValue::Array>()[0].number())) {
      in_.error(point, "the points of a surface must have ascending x",
                "a surface has one height above each place; overhangs are solids");
      return {};
    }
    before = &point;
    std::size_t at = position(axes[0], x[0].number());
    if constexpr (Dim == 3) at += position(axes[1], x[1].number()) * axes[0].size();
    if (!std::isnan(heights[at])) {
      in_.error(point, "there is another point at this place in plan");
      return {};
    }
    heights[at] = static_cast<float>(x[Dim - 1].number());
  }
  if (points.size() != places) {
    in_.error(value,
              fmt::format("the points are no grid: {} places in x and {} in y make {} points, "
                          "found {}",
                          axes[0].size(), axes[Dim - 2].size(), places, points.size()),
              "give a point for each x and y that occur; other points are for files");
    return {};
  }
  Geometry<Dim> out;
  out.surface = std::make_shared<const Surface<Dim>>(std::move(axes), std::move(heights));
  return out;
}

/// The surface that a key names; null if reported.
template <int Dim>
std::shared_ptr<const Surface<Dim>> ScenarioBuilder<Dim>::surface_named(
    const JsonValue& name, const std::vector<std::string>& users) {
  const std::string& wanted = name.as<std::string>();
  const JsonValue& all = section("geometry");
  if (std::find(users.begin(), users.end(), wanted) != users.end()) {
    in_.error(name, fmt::format("the surfaces follow from each other in a circle: {}, {}",
                                join(users), wanted));
    return nullptr;
  }
  std::vector<std::string> names;
  static const JsonValue::Object none;
  const auto& entries = all.is<JsonValue::Object>() ? all.as<JsonValue::Object>() : none;
  for (const auto& [known, offset, value] : entries) {
    names.push_back(known);
    if (known != wanted) continue;
    build_shape(known, value, users);
    const Geometry<Dim>& geometry = geometry_[known];
    if (geometry.known() && !geometry.surface)
      in_.error(name,
                fmt::format("the geometry '{}' is {}, not a surface", wanted, geometry.kind()));
    return geometry.surface;
  }
  in_.error(name, fmt::format("there is no geometry named '{}'", wanted),
            names.empty() ? "name surfaces, solids and polygons under \"geometry\""
                          : suggest(wanted, names, "geometries"));
  return nullptr;
}

/// The surface whose name is under `key`, after geometry has been read; null if reported.
template <int Dim>
std::shared_ptr<const Surface<Dim>> ScenarioBuilder<Dim>::surface_under(const JsonValue& object,
                                                                        std::string_view key) {
  const auto name = get_text(object, key);
  if (!name) return nullptr;
  const auto found = geometry_.find(*name);
  if (found == geometry_.end() || (found->second.known() && !found->second.surface)) {
    in_.error(*object.find(key),
              fmt::format("'{}' must name a surface; '{}' is {}", key, *name,
                          found == geometry_.end() ? "not in geometry" : found->second.kind()),
              "geometry has surfaces from rasters, points and grids");
    return nullptr;
  }
  return found->second.surface;  // null: it could not be read, which has been reported
}

namespace {

/// Coordinates of both axes where both are, ascending; those closer than rounding once.
std::vector<double> joined_axis(const std::vector<double>& a, const std::vector<double>& b) {
  const double low = std::max(a.front(), b.front()), high = std::min(a.back(), b.back());
  std::vector<double> x;
  for (const auto* axis : {&a, &b})
    std::copy_if(axis->begin(), axis->end(), std::back_inserter(x),
                 [&](double at) { return at >= low && at <= high; });
  std::sort(x.begin(), x.end());
  const double least = 1e-9 * (high - low);
  x.erase(std::unique(x.begin(), x.end(), [&](double p, double q) { return q - p <= least; }),
          x.end());
  return x;
}

/// Points of the grid with these axes, the first runs fastest.
template <int Dim>
Vec<Dim> grid_point(const typename Surface<Dim>::Axes& axes, std::size_t at) {
  Vec<Dim> x = Vec<Dim>::Zero();
  for (std::size_t d = 0; d < Dim - 1; ++d, at /= axes[0].size())
    x[static_cast<int>(d)] = axes[d][d + 2 == Dim ? at : at % axes[d].size()];
  return x;
}

/// Whether heights of a raster there go straight on from those inside: between the edge and the
/// first centres.
template <int Dim>
bool is_at_edge(const Surface<Dim>& surface, const Vec<Dim>& x) {
  for (std::size_t d = 0; d < Dim - 1; ++d) {
    const auto& axis = surface.axes()[d];
    const double at = x[static_cast<int>(d)];
    if (at < axis[1] || at > axis[axis.size() - 2]) return true;
  }
  return false;
}

}  // namespace

// Where a map of thicknesses has no data there is nothing: it falls to 0 from the last centre to
// the next, so that all cells together have the map's volume. Beyond its outer centres it does not
// fall below 0.
template <int Dim>
Geometry<Dim> ScenarioBuilder<Dim>::moved_surface(const JsonValue& value,
                                                  const std::vector<std::string>& users) {
  const JsonValue *lower = value.find("lower_by"), *raise = value.find("raise_by");
  if (written(value, "lower_by") == written(value, "raise_by")) {
    in_.error(value, "a surface that follows from another needs 'lower_by' or 'raise_by'",
              "a number [m], or the name of a surface that has the thickness");
    return {};
  }
  const auto from = surface_named(*value.find("surface"), users);
  const JsonValue* by = lower ? lower : raise;
  if (!from || !by) return {};
  const double sign = lower ? -1 : 1;
  Geometry<Dim> out;
  auto heights = from->heights();
  if (by->is_number()) {
    for (float& h : heights) h = static_cast<float>(h + sign * by->number());
    out.surface = std::make_shared<const Surface<Dim>>(from->axes(), std::move(heights));
    return out;
  }
  auto thickness = surface_named(*by, users);
  if (!thickness) return {};
  const bool is_map = written(*root_.find("geometry")->find(by->as<std::string>()), "raster");
  if (const auto& known = thickness->heights();
      std::any_of(known.begin(), known.end(), [](float h) { return std::isnan(h); })) {
    need_memory(*by, sizeof(float) * static_cast<double>(known.size()), "surfaces");
    auto all = known;
    std::replace_if(
        all.begin(), all.end(), [](float h) { return std::isnan(h); }, 0.0F);
    thickness = std::make_shared<const Surface<Dim>>(thickness->axes(), std::move(all));
  }
  typename Surface<Dim>::Axes axes;
  std::size_t places = 1;
  for (std::size_t d = 0; d < Dim - 1; ++d) {
    axes[d] = joined_axis(from->axes()[d], thickness->axes()[d]);
    places *= axes[d].size();
    if (axes[d].size() < 2) {
      in_.error(*by, "the surface and its thickness are not at the same places in plan");
      return {};
    }
  }
  need_memory(*by, sizeof(float) * static_cast<double>(places), "surfaces");
  heights.resize(places);
  for (std::size_t i = 0; i < places; ++i) {
    const Vec<Dim> x = grid_point<Dim>(axes, i);
    double t = thickness->height(x);
    if (t < 0 && is_map && is_at_edge(*thickness, x)) t = 0;
    if (t < 0) {
      in_.error(*by,
                fmt::format("the thickness is {} at {}", t,
                            Dim == 2 ? fmt::format("x = {}", x[0])
                                     : fmt::format("x = {}, y = {}", x[0], x[Dim - 2])),
                "a thickness must not be negative");
      return {};
    }
    heights[i] = static_cast<float>(from->height(x) + sign * t);
  }
  out.surface = std::make_shared<const Surface<Dim>>(std::move(axes), std::move(heights));
  return out;
}

template <int Dim>
Region<Dim> ScenarioBuilder<Dim>::region_of(const JsonValue& value) {
  return Region<Dim>(value, region_tolerance_, in_.document, in_.problems, geometry_);
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
