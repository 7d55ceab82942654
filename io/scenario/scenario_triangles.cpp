// Named shapes from triangulated surfaces: solids that they enclose, and the heights of open ones.
#include <fmt/format.h>

#include <algorithm>

#include "io/base/text.h"
#include "io/geometry/triangles_check.h"
#include "io/geometry/triangles_file.h"
#include "io/scenario/scenario_builder.h"
#include "physics/geometry/triangle_heights.h"
#include "physics/geometry/triangle_solid.h"

namespace lahar {

namespace {

/// What a triangle takes while a solid is made [bytes].
constexpr double triangle_bytes = 160;
/// Distances are exact in this many cells around a solid: walls and regions ask no further.
constexpr double cells_around = 8;

}  // namespace

/// The triangles of the file under `key`, which all members read.
template <int Dim>
std::optional<Triangles> ScenarioBuilder<Dim>::read_triangles_of(const JsonValue& shape,
                                                                 std::string_view key) {
  const auto file = in_.open(shape, key);
  if (!file) return std::nullopt;
  TrianglesPlace place{.scale = get_number(shape, "scale").value_or(1)};
  place.offset = get_vector<3>(shape, "offset").value_or(Vec<3>::Zero());
  phase(fmt::format("'{}'", file->name));
  std::optional<Triangles> triangles;
  all_or_none(team_, [&] {
    triangles = read_triangles(*file, place, in_.problems);
    if (!triangles) return;
    const bool good = key == "solid" ? check_solid(file->name, *triangles, in_.problems)
                                     : check_surface(file->name, *triangles, in_.problems);
    if (!good) triangles.reset();
  });
  if (triangles)
    need_memory(
        *shape.find(key), triangle_bytes * static_cast<double>(triangles->corners.size()),
        fmt::format("{} triangles", format_count(static_cast<Index>(triangles->corners.size()))));
  return triangles;
}

template <int Dim>
Geometry<Dim> ScenarioBuilder<Dim>::from_solid(const JsonValue& shape) {
  Geometry<Dim> out;
  if constexpr (Dim == 3) {
    auto triangles = read_triangles_of(shape, "solid");
    if (!triangles) return out;
    const double band =
        mesh_ ? cells_around * outer_cell().maxCoeff() : std::numeric_limits<double>::infinity();
    const std::string& file = shape.find("solid")->as<std::string>();
    all_or_none(team_, [&] {
      TriangleTree tree(std::move(*triangles));
      if (check_crossings(file, tree, in_.problems))
        out.solid = solid_of_triangles(std::move(tree), band);
    });
    if (mesh_ && out.solid) warn_of_distant_shape(*shape.find("solid"), out.solid->bounds());
  } else {
    in_.error(*shape.find("solid"), "a solid of triangles is for 3D",
              "in two dimensions take a region, such as a polygon");
  }
  return out;
}

template <int Dim>
Geometry<Dim> ScenarioBuilder<Dim>::from_triangles(const JsonValue& shape) {
  Geometry<Dim> out;
  if constexpr (Dim == 3) {
    const auto triangles = read_triangles_of(shape, "triangles");
    if (!triangles) return out;
    const JsonValue& at = *shape.find("triangles");
    const double spacing = get_number(shape, "spacing").value_or(spacing_for(*triangles));
    const auto counts = grid_counts(*triangles, spacing);
    need_memory(at, sizeof(float) * static_cast<double>(counts[0]) * static_cast<double>(counts[1]),
                fmt::format("heights at {} x {} points", counts[0], counts[1]));
    TriangleHeights heights;
    all_or_none(team_, [&] { heights = triangle_heights(*triangles, spacing); });
    const auto refuse = [&](const TriangleFlaw& flaw, std::string_view what) {
      if (flaw.count > 0 && !out.known())
        in_.error(at,
                  fmt::format("the surface has several heights at one place: {} {}, the first at "
                              "({:.6g}, {:.6g}, {:.6g})",
                              flaw.count, what, flaw.at[0], flaw.at[1], flaw.at[2]),
                  "a surface has one height above each place; overhangs are solids");
      return flaw.count > 0;
    };
    if (refuse(heights.steep, "vertical triangles") ||
        refuse(heights.folded, "edges under or over which it turns back") ||
        refuse(heights.double_points, "points with two heights"))
      return out;
    warn_of_distant_shape(at, heights.surface.bounds());
    out.surface = std::make_shared<const Surface<3>>(std::move(heights.surface));
  } else {
    in_.error(*shape.find("triangles"), "a surface of triangles is for 3D",
              "in two dimensions give its points: \"points\": [[x, y], ...]");
  }
  return out;
}

/// A shape that lies beside the mesh is in other units, or elsewhere.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_distant_shape(const JsonValue& at,
                                                 const std::pair<Vec<Dim>, Vec<Dim>>& bounds) {
  if (!mesh_) return;
  const auto [low, high] = mesh_->bounds();
  for (int d = 0; d < Dim; ++d)
    if (bounds.first[d] > high[d] || bounds.second[d] < low[d])
      return in_.warning(
          at,
          fmt::format("the shape lies outside of the mesh: along {} it reaches from {:.6g} to "
                      "{:.6g} m, the mesh from {:.6g} to {:.6g} m",
                      "xyz"[d], bounds.first[d], bounds.second[d], low[d], high[d]),
          "coordinates are in metres; 'scale' and 'offset' convert others");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
