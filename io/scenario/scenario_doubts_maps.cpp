// Warnings of maps, and of terrain and polygons that do not fit the mesh.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/base/text.h"
#include "io/scenario/scenario_builder.h"

namespace lahar {

template <int Dim>
std::string ScenarioBuilder<Dim>::mesh_extent(int axes) const {
  const auto [low, high] = mesh_->bounds();
  std::string extent = "the mesh has ";
  for (int d = 0; d < axes; ++d)
    extent +=
        fmt::format("{}{} from {:.6g} to {:.6g}", d > 0 ? ", " : "", "xyz"[d], low[d], high[d]);
  return extent;
}

// A particle counts for the cell of a map that its centre is in: of cells about as wide as
// particles are apart some have none, others twice as many.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_fine_maps() {
  constexpr double least = 1.5;  // cells over the distance of particles
  const MapPlan& plan = model_.output.measured.maps;
  if (!plan.wanted) return;
  double largest = 0;
  for (const double volume : model_.particles.volume) largest = std::max(largest, volume);
  const double distance = std::pow(team_.most(std::vector<double>{largest}).front(), 1.0 / Dim);
  if (!(plan.cell < least * distance)) return;
  const JsonValue& maps = *section("post_processing").find("maps");
  const JsonValue* cell = maps.find("cell_size");
  in_.warning(cell ? *cell : maps,
              fmt::format("cells of the maps, {:.3g} m, are small for particles that are {:.3g} m "
                          "apart: thickness will be too large in some and missing in others",
                          plan.cell, distance),
              fmt::format("a cell_size of {:.3g} m or more; two particles per cell and direction "
                          "are usual",
                          2 * distance));
}

template <int Dim>
void ScenarioBuilder<Dim>::warn_of_short_terrain() {
  const auto mesh = mesh_->bounds();
  const Vec<Dim> cell = outer_cell();
  const auto entries = get_list(root_, "rigid_bodies");
  const auto& bodies = model_.rigid_bodies;
  for (std::size_t k = 0; k < std::min(entries.size(), bodies.size()); ++k) {
    const JsonValue* region = entries[k]->find("region");
    if (!region || !region->find("below")) continue;
    const auto [low, high] = bodies[k].solid->bounds();
    if ((low.array() > mesh.second.array()).any() || (high.array() < mesh.first.array()).any())
      continue;  // it touches nothing
    for (int d = 0; d < Dim - 1; ++d) {
      const bool begins = low[d] > mesh.first[d] + cell[d],
                 ends = high[d] < mesh.second[d] - cell[d];
      if (!begins && !ends) continue;
      in_.warning(*region,
                  fmt::format("the rigid body '{}' ends inside of the mesh, at {} = {:.6g}: what "
                              "moves beyond falls",
                              bodies[k].name, "xyz"[d], begins ? low[d] : high[d]),
                  mesh_extent(Dim - 1));
    }
  }
}

namespace {

/// Places of a surface over a box in plan that have no height.
template <int Dim>
struct SurfaceHoles {
  Index places = 0, count = 0;
  Vec<Dim> first = Vec<Dim>::Zero();  ///< [m]
};

/// Of holes with an end: along an axis, heights are known on both sides.
template <int Dim>
bool is_enclosed(const Surface<Dim>& surface, std::size_t i, std::size_t j) {
  const auto& axes = surface.axes();
  const auto known = [&](std::size_t from, std::size_t to, bool along_x) {
    for (std::size_t k = from; k < to; ++k) {
      const std::size_t at = along_x ? k + j * axes[0].size() : i + k * axes[0].size();
      if (!std::isnan(surface.heights()[at])) return true;
    }
    return false;
  };
  const std::size_t nx = axes[0].size(), ny = surface.heights().size() / nx;
  return (known(0, i, true) && known(i + 1, nx, true)) ||
         (known(0, j, false) && known(j + 1, ny, false));
}

template <int Dim>
SurfaceHoles<Dim> holes_of(const Surface<Dim>& surface, const std::pair<Vec<Dim>, Vec<Dim>>& box,
                           double tolerance, bool enclosed_only) {
  constexpr Index most_looked_at = 1000;  // of holes in which heights are looked for around
  SurfaceHoles<Dim> holes;
  const auto& axes = surface.axes();
  Index enclosed = 0, looked_at = 0;
  for (std::size_t at = 0; at < surface.heights().size(); ++at) {
    const std::size_t i = at % axes[0].size(), j = at / axes[0].size();
    Vec<Dim> x = Vec<Dim>::Zero();
    x[0] = axes[0][i];
    if constexpr (Dim == 3) x[1] = axes[1][j];
    bool inside = true;
    for (int d = 0; d < Dim - 1; ++d)
      inside = inside && x[d] >= box.first[d] - tolerance && x[d] <= box.second[d] + tolerance;
    if (!inside) continue;
    ++holes.places;
    if (!std::isnan(surface.heights()[at])) continue;
    if (enclosed_only && looked_at < most_looked_at) {
      ++looked_at;
      if (!is_enclosed(surface, i, j)) continue;
      ++enclosed;
    } else if (enclosed_only && enclosed == 0) {
      break;  // a mask around what is there
    }
    if (holes.count++ == 0) holes.first = x;
  }
  return holes;
}

}  // namespace

// Where the surface below which a body or soil lies has no height, it has a hole. Soil may end
// where heights do.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_holes() {
  const auto look = [&](const JsonValue& entry, bool is_body) {
    const JsonValue* region = entry.find("region");
    const JsonValue* name =
        region && region->is<JsonValue::Object>() ? region->find("below") : nullptr;
    if (!name || !name->is<std::string>()) return;
    const auto found = geometry_.find(name->as<std::string>());
    if (found == geometry_.end() || !found->second.surface) return;
    const auto holes =
        holes_of<Dim>(*found->second.surface, mesh_->bounds(), region_tolerance_, !is_body);
    if (holes.count == 0) return;
    in_.warning(
        *name,
        fmt::format("the surface '{}' has no height at {} of its {} places over the mesh, the "
                    "first at x = {:.6g}{}: {}",
                    found->first, format_count(holes.count), format_count(holes.places),
                    holes.first[0],
                    Dim == 3 ? fmt::format(", y = {:.6g}", holes.first[1]) : std::string(),
                    is_body ? "the rigid body has holes there, through which material falls"
                            : "below them are no particles"),
        Dim == 3 ? "gdal_fillnodata.py fills them; or let the mesh end before" : "");
  };
  for (const JsonValue* entry : get_list(root_, "rigid_bodies")) look(*entry, true);
  for (const GeneratorRows& made : generators_)
    if (&made == &generators_.front() || made.generator != (&made - 1)->generator)
      look(*made.generator, false);  // layers are one generator
}

// Maps are in coordinates of the model.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_distant_maps() {
  const MapPlan& plan = model_.output.measured.maps;
  if (!plan.wanted) return;
  const auto [low, high] = mesh_->bounds();
  bool apart = false;
  for (std::size_t d = 0; d < 2; ++d) {
    const double end = plan.low[d] + plan.cell * static_cast<double>(plan.n[d]);
    apart |= plan.low[d] >= high[static_cast<int>(d)] || end <= low[static_cast<int>(d)];
  }
  if (!apart) return;
  const JsonValue& maps = *section("post_processing").find("maps");
  const JsonValue* at = maps.find("min");
  if (!at) at = maps.find("max");
  const Vec<2>& origin = in_.map.origin;
  in_.warning(
      at ? *at : maps, "the maps lie outside of the mesh, and stay empty",
      mesh_extent(2) + (origin.isZero(0.0)
                            ? std::string()
                            : fmt::format("; 'min' and 'max' are coordinates of the model, those "
                                          "of the map less the 'map_origin' ({:.10g}, {:.10g})",
                                          origin[0], origin[1])));
}

namespace {

/// The names of polygons under which a region lies.
void names_of_polygons(const JsonValue& region, std::vector<const JsonValue*>& names) {
  if (region.is<JsonValue::Array>())
    for (const JsonValue& part : region.as<JsonValue::Array>()) names_of_polygons(part, names);
  if (!region.is<JsonValue::Object>()) return;
  for (const auto& [key, offset, value] : region.as<JsonValue::Object>()) {
    if (key == "under" && value.is<std::string>()) names.push_back(&value);
    const bool less = key == "difference" && value.is<JsonValue::Array>();
    if (less && !value.as<JsonValue::Array>().empty())
      names_of_polygons(value.as<JsonValue::Array>().front(), names);
    if (!less) names_of_polygons(value, names);
  }
}

}  // namespace

// Polygons that particles lie under, and that the mesh's border cuts. Those that reach beyond it at
// both ends of an axis mean all of it.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_cut_polygons() {
  if constexpr (Dim == 3) {
    constexpr int points = 1000;  // of each side of the mesh that are looked at
    const auto [low, high] = mesh_->bounds();
    const double beyond = 10 * region_tolerance_;
    for (const GeneratorRows& made : generators_) {
      std::vector<const JsonValue*> names;
      if (const JsonValue* region = made.generator->find("region"))
        names_of_polygons(*region, names);
      for (const JsonValue* name : names) {
        const auto found = geometry_.find(name->as<std::string>());
        if (found == geometry_.end() || !found->second.outlines) continue;
        const Outlines& outlines = *found->second.outlines;
        for (int d = 0; d < 2; ++d) {
          const int along = 1 - d;
          const auto [from, to] = outlines.bounds();
          if (from[d] < low[d] - beyond && to[d] > high[d] + beyond) continue;
          for (const bool at_end : {false, true}) {
            Vec<2> x;
            x[d] = at_end ? high[d] + beyond : low[d] - beyond;
            int inside = 0;
            for (int k = 0; k < points; ++k) {
              x[along] = low[along] + (high[along] - low[along]) * (k + 0.5) / points;
              inside += outlines.contains(x, 0.0) ? 1 : 0;
            }
            if (inside == 0) continue;
            in_.warning(*name,
                        fmt::format("the polygons '{}' reach beyond the mesh, over {:.3g} m of its "
                                    "side {} = {:g}: what lies outside gets no particles",
                                    found->first, (high[along] - low[along]) * inside / points,
                                    "xy"[d], at_end ? high[d] : low[d]),
                        mesh_extent(2));
          }
        }
      }
    }
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
