#ifdef LAHAR_GDAL_LIBRARY
#include "io/geometry/gdal_library.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "io/base/text.h"
#include "io/geometry/map_files.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

/// Blocks of files that GDAL keeps [bytes].
constexpr GIntBig block_cache = GIntBig{64} << 20;

[[noreturn]] void fail(const std::string& message, const std::string& hint) {
  throw InputError({Problem{.message = message, .hint = hint}});
}

Gdal load() {
  void* library = ::dlopen(LAHAR_GDAL_LIBRARY, RTLD_NOW | RTLD_LOCAL);
  if (!library)
    fail(fmt::format("the library of GDAL cannot be loaded: {}", ::dlerror()),
         "install the package libgdal-dev");
  Gdal gdal;
#define LAHAR_GDAL_LOAD(name)                                                 \
  gdal.name = reinterpret_cast<decltype(gdal.name)>(::dlsym(library, #name)); \
  if (!gdal.name)                                                             \
    fail("the library of GDAL has no function " #name,                        \
         "configure and build again with the libgdal-dev that is installed now");
  LAHAR_GDAL_FUNCTIONS(LAHAR_GDAL_LOAD)
#undef LAHAR_GDAL_LOAD
  // Other formats lead to other files, or into the net.
  gdal.GDALRegister_GTiff();
  gdal.GDALRegister_AAIGrid();
  gdal.RegisterOGRGeoJSON();
  gdal.RegisterOGRShape();
  gdal.CPLSetConfigOption("CPL_VSIL_CURL_ALLOWED_FILENAME", "none");
  gdal.GDALSetCacheMax64(block_cache);
  return gdal;
}

std::string wkt_of(OGRSpatialReferenceH reference) {
  char* text = nullptr;
  std::string wkt;
  if (gdal().OSRExportToWkt(reference, &text) == OGRERR_NONE && text) wkt = text;
  gdal().VSIFree(text);
  return wkt;
}

struct DestroyReference {
  void operator()(void* reference) const { gdal().OSRDestroySpatialReference(reference); }
};
using Reference = std::unique_ptr<void, DestroyReference>;

std::string name_of(OGRSpatialReferenceH reference) {
  const char* name = gdal().OSRGetName(reference);
  return name && *name ? name : "without a name";
}

/// GDAL reads files of the same name with other endings, such as .prj and .dbf.
void check_neighbours(const MapFile& file) {
  namespace fs = std::filesystem;
  constexpr std::uintmax_t longest = 1 << 20;  // of a text that GDAL reads as a whole [bytes]
  const fs::path path(file.path), folder = path.parent_path();
  const std::string stem = path.stem().string() + ".";
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(stem)) continue;
    const fs::file_status status = entry.status(error);
    if (!fs::exists(status) || fs::is_directory(status)) continue;
    if (!fs::is_regular_file(status))
      fail(fmt::format("'{}' beside '{}' is not a regular file", name, file.name),
           "GDAL reads it together with the map; remove it");
    const auto size = entry.file_size(error);
    if (!error && size > longest && (name.ends_with(".prj") || name.ends_with(".cpg")))
      fail(fmt::format("'{}' beside '{}' has {}; at most {} are read", name, file.name,
                       format_bytes(static_cast<double>(size)),
                       format_bytes(static_cast<double>(longest))),
           "it has the name of a coordinate reference system or of an encoding");
  }
}

Dataset open_map(const MapFile& file, unsigned kind, std::array<const char*, 3> drivers) {
  check_neighbours(file);
  return Dataset(gdal().GDALOpenEx(file.path.c_str(), kind | GDAL_OF_VERBOSE_ERROR, drivers.data(),
                                   nullptr, nullptr));
}

}  // namespace

Dataset open_raster(const MapFile& file) {
  return open_map(file, GDAL_OF_RASTER, {"GTiff", "AAIGrid", nullptr});
}

Dataset open_polygons(const MapFile& file) {
  return open_map(file, GDAL_OF_VECTOR, {"GeoJSON", "ESRI Shapefile", nullptr});
}

bool has_gdal() {
  try {
    gdal();
    return true;
  } catch (const InputError&) {
    return false;
  }
}

const Gdal& gdal() {
  static const Gdal loaded = load();
  return loaded;
}

std::string QuietGdal::said() {
  std::string text = gdal().CPLGetLastErrorMsg();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string plane_reference(OGRSpatialReferenceH given, const std::string& file) {
  if (!given) return "";
  const Reference reference(gdal().OSRClone(given));
  gdal().OSRDemoteTo2D(reference.get(), nullptr);
  if (gdal().OSRIsGeographic(reference.get()))
    fail(fmt::format("'{}' is in degrees: its coordinate reference system is {}", file,
                     name_of(reference.get())),
         "transform it to one in metres, such as UTM: gdalwarp -t_srs for rasters, ogr2ogr -t_srs "
         "for polygons");
  const double metres = gdal().OSRGetLinearUnits(reference.get(), nullptr);
  if (std::abs(metres - 1) > 1e-9)
    fail(fmt::format("'{}' is not in metres: one unit of {} is {} m", file,
                     name_of(reference.get()), metres),
         "transform it to a coordinate reference system in metres");
  return wkt_of(reference.get());
}

namespace {

Reference reference_of(const std::string& wkt) {
  return Reference(gdal().OSRNewSpatialReference(wkt.c_str()));
}

}  // namespace

std::string reference_name(const std::string& wkt) {
  return name_of(reference_of(wkt).get());
}

bool same_reference(const std::string& wkt, const std::string& other) {
  return wkt == other || gdal().OSRIsSame(reference_of(wkt).get(), reference_of(other).get());
}

}  // namespace lahar
#endif
