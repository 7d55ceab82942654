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

// Where the surface below which a body lies has no height, the body has a hole.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_holes() {
  const auto [low, high] = mesh_->bounds();
  for (const JsonValue* entry : get_list(root_, "rigid_bodies")) {
    const JsonValue* region = entry->find("region");
    const JsonValue* name = region ? region->find("below") : nullptr;
    if (!name || !name->is<std::string>()) continue;
    const auto found = geometry_.find(name->as<std::string>());
    if (found == geometry_.end() || !found->second.surface) continue;
    const Surface<Dim>& surface = *found->second.surface;
    const auto& axes = surface.axes();
    Index places = 0, holes = 0;
    Vec<Dim> first = Vec<Dim>::Zero();
    for (std::size_t at = 0; at < surface.heights().size(); ++at) {
      const std::size_t i = at % axes[0].size(), j = at / axes[0].size();
      Vec<Dim> x = Vec<Dim>::Zero();
      x[0] = axes[0][i];
      if constexpr (Dim == 3) x[1] = axes[1][j];
      bool inside = true;
      for (int d = 0; d < Dim - 1; ++d)
        inside =
            inside && x[d] >= low[d] - region_tolerance_ && x[d] <= high[d] + region_tolerance_;
      if (!inside) continue;
      ++places;
      if (!std::isnan(surface.heights()[at])) continue;
      if (holes++ == 0) first = x;
    }
    if (holes == 0) continue;
    in_.warning(
        *name,
        fmt::format("the surface '{}' has no height at {} of its {} places over the mesh, the "
                    "first at x = {:.6g}{}: the rigid body has holes there, through which material "
                    "falls",
                    found->first, format_count(holes), format_count(places), first[0],
                    Dim == 3 ? fmt::format(", y = {:.6g}", first[1]) : std::string()),
        Dim == 3 ? "gdal_fillnodata.py fills them; or let the mesh end before" : "");
  }
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
