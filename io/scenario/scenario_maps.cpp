// Shapes from maps: elevation rasters and polygons, in coordinates of the map.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "io/base/text.h"
#include "io/geometry/ascii_grid.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

namespace {

/// Of a raster that is finer, means over this part of the smallest cell of the mesh are taken [-].
constexpr double finest_spacing = 0.5;

/// Heights of tiles may differ by this part of a cell of the mesh [-].
constexpr double least_step = 0.1;
/// Surfaces reach beyond the mesh by this part of a cell [-]: rounding does not lose nodes.
constexpr double overhang = 1e-3;

/// What is read, with an edge around it, and cut to the mesh: copies at the same time.
constexpr double copies_of_heights = 3;

std::string box_text(const std::pair<Vec<2>, Vec<2>>& box) {
  return fmt::format("from ({:.10g}, {:.10g}) to ({:.10g}, {:.10g})", box.first.x(), box.first.y(),
                     box.second.x(), box.second.y());
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::read_map_origin() {
  const JsonValue* given = section("mesh").find("map_origin");
  if (!given) return;
  const auto origin = get_numbers(section("mesh"), "map_origin");
  if constexpr (Dim == 2) return in_.error(*given, "'map_origin' has no meaning in two dimensions");
  if (origin.size() != 2)
    return in_.error(*given,
                     fmt::format("'map_origin' must be [x, y], found {} numbers", origin.size()));
  in_.map.origin = {origin[0], origin[1]};
}

/// The files of a name or a list of names; none if one is missing (reported). `whole`: they will be
/// in memory.
template <int Dim>
std::vector<MapFile> ScenarioBuilder<Dim>::map_files(const JsonValue& names, bool whole) {
  std::vector<MapFile> files;
  if constexpr (Dim == 2) {
    in_.error(names, "maps are for three dimensions",
              "in two dimensions a surface goes through points: {\"points\": [[x, y], ...]}");
    return files;
  }
  std::vector<const JsonValue*> all{&names};
  if (names.is<JsonValue::Array>()) {
    all.clear();
    for (const JsonValue& name : names.as<JsonValue::Array>()) all.push_back(&name);
    if (all.empty()) in_.error(names, "the list of files is empty");
  }
  for (const JsonValue* name : all)
    if (const auto file = in_.open_named(*name, whole)) files.push_back({file->name, file->path});
  if (files.size() != all.size()) files.clear();
  return files;
}

/// Whether a file (`name`) may be used together with those before it.
template <int Dim>
bool ScenarioBuilder<Dim>::check_reference(const JsonValue& name, const std::string& reference) {
  if (reference.empty()) return true;
  const std::string file =
      (name.is<std::string>() ? name : name.as<JsonValue::Array>()[0]).template as<std::string>();
  if (map_file_.empty()) {
    map_file_ = file;
    in_.map.reference = reference;
    return true;
  }
  if (same_reference(reference, in_.map.reference)) return true;
  in_.error(
      name,
      fmt::format("'{}' and '{}' are in different coordinate reference systems: {} and {}",
                  map_file_, file, reference_name(in_.map.reference), reference_name(reference)),
      "transform one of them: gdalwarp -t_srs for rasters, ogr2ogr -t_srs for polygons");
  return false;
}

/// Lets all members do what may throw on one of them alone; false where it did, which is reported.
/// A second file that fails for the same reason, such as a library that is not there, is not.
template <int Dim>
bool ScenarioBuilder<Dim>::all_can(const JsonValue& at, const std::function<void()>& part) {
  try {
    all_or_none(team_, part);
    return true;
  } catch (const InputError& e) {
    for (const Problem& problem : e.problems())
      if (said_of_maps_.insert(problem.message).second)
        in_.error(at, problem.message, problem.hint);
    return false;
  }
}

namespace {

/// A surface where a box in plan is, with edges there.
Surface<3> cut_to(const Surface<3>& surface, const Vec<3>& low, const Vec<3>& high) {
  Surface<3>::Axes axes;
  for (int d = 0; d < 2; ++d) {
    const auto& axis = surface.axes()[static_cast<std::size_t>(d)];
    auto& to = axes[static_cast<std::size_t>(d)];
    const double from = std::max(low[d], axis.front()), end = std::min(high[d], axis.back());
    to.push_back(from);
    for (const double x : axis)
      if (x > from && x < end) to.push_back(x);
    to.push_back(end);
  }
  std::vector<float> heights;
  heights.reserve(axes[0].size() * axes[1].size());
  for (const double y : axes[1])
    for (const double x : axes[0]) heights.push_back(static_cast<float>(surface.height({x, y, 0})));
  return {std::move(axes), std::move(heights)};
}

}  // namespace

template <int Dim>
Geometry<Dim> ScenarioBuilder<Dim>::from_raster(const JsonValue& names, std::string_view unit) {
  const std::vector<MapFile> files = map_files(names, false);
  Geometry<Dim> out;
  if constexpr (Dim == 3) {
    if (files.empty() || !mesh_) return out;
    std::unique_ptr<Raster> raster;
    Raster::Part part;
    std::optional<TileDifference> gap;
    const auto [low, high] = mesh_->bounds();
    const double cell = smallest_cell(*mesh_, team_);
    const Vec<2> from = low.template head<2>() + in_.map.origin;
    const Vec<2> to = high.template head<2>() + in_.map.origin;
    if (!all_can(names, [&] {
          if (team_.index() == 0)
            for (const MapFile& file : files) check_ascii_grid(file);
          raster = std::make_unique<Raster>(files, unit);
          part = raster->part(from, to, finest_spacing * cell);
          gap = difference_of_tiles(files, from, to, unit == "m", least_step * cell);
        }))
      return out;
    if (!check_reference(names, raster->reference())) return out;
    if (part.points() == 0) {
      in_.error(names,
                fmt::format("the raster lies beside the mesh: it extends {}, the mesh {}",
                            box_text(raster->bounds()), box_text({from, to})),
                "\"map_origin\": [x, y] in mesh is the place on the map where the model has x = 0 "
                "and y = 0");
      return out;
    }
    if (gap)
      in_.warning(names,
                  fmt::format("'{}' and '{}' overlap and differ there, by up to {:.3g} {} at "
                              "({:.10g}, {:.10g}): the values of '{}' are taken, with a step where "
                              "it ends",
                              gap->below, gap->above, gap->difference, unit, gap->x.x(), gap->x.y(),
                              gap->above),
                  "do both mean heights above the same level? List the better one last, or cut the "
                  "other one: gdalwarp -te XMIN YMIN XMAX YMAX");
    const auto points = static_cast<double>(part.points());
    need_memory(names, copies_of_heights * sizeof(float) * points,
                fmt::format("a raster of {} points", format_count(part.points())));
    const double reading = raster->bytes_at_once(part);
    need_memory(names, reading,
                fmt::format("reading {0} x {0} cells of {1} x {2} m for each point", part.factor,
                            part.spacing.x() / static_cast<double>(part.factor),
                            part.spacing.y() / static_cast<double>(part.factor)));
    auto heights = heights_of(*raster, part, names);
    memory_ -= reading;
    if (heights.empty()) return out;
    const Vec<3> more(overhang * cell, overhang * cell, 0);
    out.surface = std::make_shared<const Surface<3>>(
        cut_to(surface_of(part, std::move(heights), in_.map.origin), low - more, high + more));
    memory_ -= (copies_of_heights - 1) * sizeof(float) * points;
  }
  return out;
}

/// All heights, of which each member reads a share; none if reported. Collective.
template <int Dim>
std::vector<float> ScenarioBuilder<Dim>::heights_of(const Raster& raster, const Raster::Part& part,
                                                    const JsonValue& names) {
  const Index rows = raster.rows_at_once(part), blocks = (part.rows + rows - 1) / rows;
  std::vector<float> own;
  if (!all_can(names, [&] {
        const Index end = team_.part(blocks, team_.index() + 1);
        for (Index b = team_.part(blocks, team_.index()); b < end; ++b) {
          const auto read = raster.read(part, b * rows, std::min((b + 1) * rows, part.rows));
          own.insert(own.end(), read.begin(), read.end());
        }
      }))
    return {};
  const bool known =
      std::any_of(own.begin(), own.end(), [](float height) { return !std::isnan(height); });
  if (!team_.any(known)) {
    in_.error(names, "the raster has no value where the mesh is: all of it is nodata there");
    return {};
  }
  return joined(team_.gather(own));
}

template <int Dim>
Geometry<Dim> ScenarioBuilder<Dim>::from_polygons(const JsonValue& value) {
  const JsonValue& name = *value.find("polygons");
  const std::vector<MapFile> files = map_files(name, true);
  PolygonFile read;
  if (files.empty() || !all_can(name, [&] {
        read = read_polygons(files[0], get_text(value, "where").value_or(""));
      }))
    return {};
  if (!check_reference(name, read.reference)) return {};
  for (Outlines::Polygon& polygon : read.polygons)
    for (Outlines::Ring& ring : polygon)
      for (Vec<2>& x : ring) x -= in_.map.origin;
  Geometry<Dim> out;
  out.outlines = std::make_shared<const Outlines>(read.polygons);
  if (!mesh_) return out;
  const auto [low, high] = mesh_->bounds();
  const auto& box = out.outlines->bounds();
  for (int d = 0; d < 2; ++d)
    if (box.first[d] > high[d] || box.second[d] < low[d]) {
      const Vec<2> from = low.template head<2>() + in_.map.origin;
      in_.error(name,
                fmt::format("the polygons lie beside the mesh: they extend {}, the mesh {}",
                            box_text({box.first + in_.map.origin, box.second + in_.map.origin}),
                            box_text({from, high.template head<2>() + in_.map.origin})),
                "\"map_origin\": [x, y] in mesh is the place on the map where the model has x = 0 "
                "and y = 0");
      return {};
    }
  return out;
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
