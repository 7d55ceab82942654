#ifdef LAHAR_GDAL_LIBRARY
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <regex>

#include "io/geometry/gdal_library.h"
#include "io/geometry/map_files.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

[[noreturn]] void fail(const std::string& message, const std::string& hint = "") {
  throw InputError({Problem{.message = message, .hint = hint}});
}

struct DestroyFeature {
  void operator()(void* feature) const { gdal().OGR_F_Destroy(feature); }
};
struct DestroyGeometry {
  void operator()(void* geometry) const { gdal().OGR_G_DestroyGeometry(geometry); }
};
using GeometryHandle = std::unique_ptr<void, DestroyGeometry>;

Outlines::Ring ring_of(OGRGeometryH line) {
  Outlines::Ring ring;
  const int n = gdal().OGR_G_GetPointCount(line);
  for (int i = 0; i < n; ++i)
    ring.emplace_back(gdal().OGR_G_GetX(line, i), gdal().OGR_G_GetY(line, i));
  if (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
  return ring;
}

/// Adds what a geometry has: it is a polygon, or has geometries that are.
void add(OGRGeometryH geometry, const std::string& what, std::vector<Outlines::Polygon>& to) {
  const Gdal& g = gdal();
  const auto type = g.OGR_GT_Flatten(g.OGR_G_GetGeometryType(geometry));
  if (type != wkbPolygon && type != wkbMultiPolygon && type != wkbGeometryCollection)
    fail(fmt::format("{} is a {}, not a polygon", what, g.OGR_G_GetGeometryName(geometry)));
  const int parts = g.OGR_G_GetGeometryCount(geometry);
  if (type != wkbPolygon) {
    for (int i = 0; i < parts; ++i) add(g.OGR_G_GetGeometryRef(geometry, i), what, to);
    return;
  }
  Outlines::Polygon polygon;
  for (int i = 0; i < parts; ++i) {
    polygon.push_back(ring_of(g.OGR_G_GetGeometryRef(geometry, i)));
    for (const Vec<2>& x : polygon.back())
      if (!(x.cwiseAbs().maxCoeff() <= farthest_of_map))
        fail(fmt::format("{} has a corner at ({:g}, {:g})", what, x.x(), x.y()),
             "coordinates are finite numbers of metres");
    if (polygon.back().size() < 3)
      fail(fmt::format("{} has a ring of {} points", what, polygon.back().size()),
           "a ring has three corners at least");
  }
  if (!polygon.empty()) to.push_back(std::move(polygon));
}

void add_feature(OGRFeatureH feature, const std::string& file, std::vector<Outlines::Polygon>& to) {
  const Gdal& g = gdal();
  const std::string what = fmt::format("feature {} of '{}'", g.OGR_F_GetFID(feature), file);
  OGRGeometryH geometry = g.OGR_F_GetGeometryRef(feature);
  if (!geometry || g.OGR_G_IsEmpty(geometry)) return;
  const GeometryHandle straight(g.OGR_G_GetLinearGeometry(geometry, 0, nullptr));
  add(straight.get(), what, to);
  g.CPLErrorReset();
  if (!g.OGR_G_IsValid(straight.get()) &&
      QuietGdal::said().find("not enabled") == std::string::npos)
    fail(fmt::format("the polygon of {} is not simple: {}", what, QuietGdal::said()),
         "the outline must not cross or touch itself; ogr2ogr -makevalid mends many");
}

/// Whether a file of GeoJSON says that its coordinate reference system is not known.
bool is_without_reference(const MapFile& file) {
  std::string head(4096, ' ');
  std::ifstream in(file.path, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  return std::regex_search(head, std::regex(R"("crs"\s*:\s*null)"));
}

/// GeoJSON is in degrees unless it says something else, which files in metres often do not.
bool are_degrees(const std::vector<Outlines::Polygon>& polygons) {
  for (const auto& polygon : polygons)
    for (const auto& ring : polygon)
      for (const Vec<2>& x : ring)
        if (std::abs(x.x()) > 360 || std::abs(x.y()) > 90) return false;
  return true;
}

OGRLayerH only_layer(const Dataset& dataset, const MapFile& file) {
  const int layers = gdal().GDALDatasetGetLayerCount(dataset.get());
  if (layers == 1) return gdal().GDALDatasetGetLayer(dataset.get(), 0);
  std::string names;
  for (int i = 0; i < layers; ++i)
    names += fmt::format("{}{}", i ? ", " : "",
                         gdal().OGR_L_GetName(gdal().GDALDatasetGetLayer(dataset.get(), i)));
  fail(fmt::format("'{}' has {} layers{}{}", file.name, layers, layers ? ": " : "", names),
       "a file with one layer is needed; ogr2ogr writes a layer into a file of its own");
}

}  // namespace

PolygonFile read_polygons(const MapFile& file, const std::string& filter) {
  const Gdal& g = gdal();
  const QuietGdal quiet;
  const Dataset dataset = open_polygons(file);
  if (!dataset)
    fail(fmt::format("GDAL cannot read polygons from '{}': {}", file.name, QuietGdal::said()),
         "GeoJSON and shapefiles are read; ogr2ogr converts other formats");
  OGRLayerH layer = only_layer(dataset, file);
  if (!filter.empty() && g.OGR_L_SetAttributeFilter(layer, filter.c_str()) != OGRERR_NONE)
    fail(fmt::format("'where' does not fit '{}': {}", file.name, QuietGdal::said()),
         "for example \"zone = 'upper' AND depth > 2\"");
  PolygonFile out;
  g.OGR_L_ResetReading(layer);
  g.CPLErrorReset();
  while (const std::unique_ptr<void, DestroyFeature> feature{g.OGR_L_GetNextFeature(layer)})
    add_feature(feature.get(), file.name, out.polygons);
  if (out.polygons.empty())
    fail(filter.empty() ? fmt::format("'{}' has no polygons", file.name)
                        : fmt::format("'{}' has no polygons where {}", file.name, filter));
  OGRSpatialReferenceH reference = g.OGR_L_GetSpatialRef(layer);
  const bool assumed = reference && g.OSRIsGeographic(reference) &&
                       (is_without_reference(file) || !are_degrees(out.polygons));
  out.reference = assumed ? "" : plane_reference(reference, file.name);
  return out;
}

}  // namespace lahar
#endif
