#ifdef LAHAR_GDAL_LIBRARY
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/geometry/gdal_library.h"
#include "io/geometry/map_files.h"
#include "physics/base/error.h"

namespace lahar {

struct Raster::Source {
  Dataset dataset;
  GDALRasterBandH band = nullptr;
  std::array<double, 6> transform{};
  Index columns = 0, rows = 0;
  double scale = 1, offset = 0;
  double no_data = std::numeric_limits<double>::quiet_NaN();
  bool masked = false;    ///< by more than `no_data`
  std::string all_known;  ///< a file that declares no value for what is not known; or none
};

namespace {

/// Points beyond the box that is asked for.
constexpr Index margin = 2;

/// Cells of the raster that are read at once.
constexpr Index cells_at_once = Index{1} << 22;

[[noreturn]] void fail(const std::string& message, const std::string& hint = "") {
  throw InputError({Problem{.message = message, .hint = hint}});
}

/// Values that programs write where nothing is known.
bool is_usual_no_data(float value) {
  return value == -9999.F || value == -99999.F || value == -32768.F || value < -1e30F;
}

Dataset open(const MapFile& file) {
  Dataset dataset(gdal().GDALOpenEx(file.path.c_str(), GDAL_OF_RASTER | GDAL_OF_VERBOSE_ERROR,
                                    nullptr, nullptr, nullptr));
  if (!dataset)
    fail(fmt::format("GDAL cannot read a raster from '{}': {}", file.name, QuietGdal::said()),
         "ESRI ASCII grids and GeoTIFF are rasters");
  return dataset;
}

std::array<double, 6> transform_of(const Dataset& dataset, const MapFile& file) {
  std::array<double, 6> t{};
  if (gdal().GDALGetGeoTransform(dataset.get(), t.data()) != CE_None)
    fail(fmt::format("'{}' does not say where its cells lie", file.name),
         "an elevation raster has an origin and a cell size (georeferencing)");
  if (t[2] != 0 || t[4] != 0)
    fail(fmt::format("'{}' is rotated: its rows are not parallel to an axis", file.name),
         "gdalwarp makes a raster whose rows are");
  if (!(std::abs(t[1]) > 0 && std::abs(t[5]) > 0 && t[1] > 0))
    fail(fmt::format("'{}' has cells of {} by {} m", file.name, t[1], t[5]),
         "cells need a size greater than zero");
  return t;
}

/// Whether a raster says that its values have this unit. Most rasters say nothing.
bool has_unit(const std::string& name, std::string_view unit) {
  constexpr std::array metres = {"metre", "meter", "metres", "meters"};
  return name.empty() || name == unit ||
         (unit == "m" && std::find(metres.begin(), metres.end(), name) != metres.end());
}

void check_band(const Dataset& dataset, const MapFile& file, std::string_view unit) {
  const int bands = gdal().GDALGetRasterCount(dataset.get());
  if (bands != 1)
    fail(fmt::format("'{}' has {} bands; {} has one", file.name, bands,
                     unit == "m" ? "an elevation raster" : "a raster of a parameter"),
         "gdal_translate -b 1 takes the first");
  const char* said = gdal().GDALGetRasterUnitType(gdal().GDALGetRasterBand(dataset.get(), 1));
  const std::string name = said ? said : "";
  if (!has_unit(name, unit))
    fail(fmt::format("the {} of '{}' are in {}", unit == "m" ? "heights" : "values", file.name,
                     name),
         unit == "m" ? "metres are needed" : fmt::format("the unit here is '{}'", unit));
}

/// One raster of several: of numbers that know NaN, which is what lies between tiles.
Dataset join(const std::vector<MapFile>& tiles, std::vector<Dataset> parts,
             const std::string& reference) {
  std::vector<GDALDatasetH> handles;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    std::vector<std::string> words{"-of",      "VRT",          "-ot", "Float32",
                                   "-unscale", "-colorinterp", "gray"};
    if (!reference.empty()) words.insert(words.end(), {"-a_srs", reference});
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    auto* options = gdal().GDALTranslateOptionsNew(arguments.data(), nullptr);
    int error = 0;
    Dataset real(gdal().GDALTranslate("", parts[i].get(), options, &error));
    gdal().GDALTranslateOptionsFree(options);
    if (!real) fail(fmt::format("'{}' cannot be read: {}", tiles[i].name, QuietGdal::said()));
    parts[i] = std::move(real);
    handles.push_back(parts[i].get());
  }
  std::vector<std::string> words{"-strict", "-resolution", "highest", "-vrtnodata", "nan"};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  auto* options = gdal().GDALBuildVRTOptionsNew(arguments.data(), nullptr);
  int error = 0;
  Dataset all(gdal().GDALBuildVRT("", static_cast<int>(handles.size()), handles.data(), nullptr,
                                  options, &error));
  gdal().GDALBuildVRTOptionsFree(options);
  if (!all)
    fail(fmt::format("the rasters from '{}' on make no whole: {}", tiles[0].name,
                     QuietGdal::said()));
  return all;
}

}  // namespace

Raster::Raster(const std::vector<MapFile>& tiles, std::string_view unit)
    : source_(std::make_unique<Source>()) {
  const QuietGdal quiet;
  std::vector<Dataset> parts;
  for (const MapFile& tile : tiles) {
    parts.push_back(open(tile));
    check_band(parts.back(), tile, unit);
    transform_of(parts.back(), tile);
    GDALRasterBandH band = gdal().GDALGetRasterBand(parts.back().get(), 1);
    if ((gdal().GDALGetMaskFlags(band) & GMF_ALL_VALID) != 0) source_->all_known = tile.name;
    const std::string reference =
        plane_reference(gdal().GDALGetSpatialRef(parts.back().get()), tile.name);
    if (parts.size() > 1 && reference.empty() == reference_.empty() && !reference.empty() &&
        !same_reference(reference, reference_))
      fail(fmt::format("'{}' and '{}' are in different coordinate reference systems: {} and {}",
                       tiles[0].name, tile.name, reference_name(reference_),
                       reference_name(reference)),
           "gdalwarp -t_srs transforms a raster");
    if (parts.size() > 1 && reference.empty() != reference_.empty())
      fail(fmt::format("only one of '{}' and '{}' says its coordinate reference system",
                       tiles[0].name, tile.name),
           "gdal_edit.py -a_srs writes it into a GeoTIFF; an ASCII grid has it in a file .prj");
    if (parts.size() == 1) reference_ = reference;
  }
  Source& s = *source_;
  s.dataset = tiles.size() == 1 ? std::move(parts[0]) : join(tiles, std::move(parts), reference_);
  s.band = gdal().GDALGetRasterBand(s.dataset.get(), 1);
  s.transform = transform_of(s.dataset, tiles[0]);
  s.columns = gdal().GDALGetRasterXSize(s.dataset.get());
  s.rows = gdal().GDALGetRasterYSize(s.dataset.get());
  int given = 0;
  const double scale = gdal().GDALGetRasterScale(s.band, &given);
  if (given) s.scale = scale;
  const double offset = gdal().GDALGetRasterOffset(s.band, &given);
  if (given) s.offset = offset;
  const double none = gdal().GDALGetRasterNoDataValue(s.band, &given);
  if (given) s.no_data = none;
  s.masked = (gdal().GDALGetMaskFlags(s.band) & (GMF_NODATA | GMF_ALL_VALID)) == 0;
  const Vec<2> a(s.transform[0], s.transform[3]);
  const Vec<2> b = a + Vec<2>(s.transform[1] * static_cast<double>(s.columns),
                              s.transform[5] * static_cast<double>(s.rows));
  bounds_ = {a.cwiseMin(b), a.cwiseMax(b)};
}

Raster::~Raster() = default;

Raster::Part Raster::part(const Vec<2>& low, const Vec<2>& high, double finest) const {
  const Source& s = *source_;
  const double dx = s.transform[1], dy = std::abs(s.transform[5]);
  Part out;
  if (!((high - bounds_.first).minCoeff() > 0 && (bounds_.second - low).minCoeff() > 0)) return out;
  out.factor = std::max<Index>(1, static_cast<Index>(std::min(finest / std::max(dx, dy), 1e6)));
  out.factor = std::min({out.factor, s.columns, s.rows});
  // Along an axis: the first of `n` cells, and the number of groups of `factor`, around a range.
  const auto range = [&](double from, double to, double cell, Index n, Index& first) {
    const auto most = static_cast<double>(n);
    const auto begin = static_cast<Index>(std::clamp(std::floor(from / cell), 0.0, most - 1));
    const auto end = static_cast<Index>(std::clamp(std::ceil(to / cell), 1.0, most));
    first = std::max<Index>(begin - margin * out.factor, 0);
    const Index last = std::min(end + margin * out.factor, n);
    const Index groups = std::min((last - first + out.factor - 1) / out.factor, n / out.factor);
    first = last == n ? n - groups * out.factor : std::min(first, n - groups * out.factor);
    return groups;
  };
  out.columns = range(low.x() - bounds_.first.x(), high.x() - bounds_.first.x(), dx, s.columns,
                      out.first_column);
  out.rows =
      range(low.y() - bounds_.first.y(), high.y() - bounds_.first.y(), dy, s.rows, out.first_row);
  const auto f = static_cast<double>(out.factor);
  out.spacing = f * Vec<2>(dx, dy);
  const Vec<2> corner = bounds_.first + Vec<2>(dx * static_cast<double>(out.first_column),
                                               dy * static_cast<double>(out.first_row));
  out.first = corner + 0.5 * out.spacing;
  // Cells that are left over before the first group belong to it.
  out.bounds = {corner, corner + out.spacing.cwiseProduct(Vec<2>(static_cast<double>(out.columns),
                                                                 static_cast<double>(out.rows)))};
  if (out.first_column < out.factor) out.bounds.first.x() = bounds_.first.x();
  if (out.first_row < out.factor) out.bounds.first.y() = bounds_.first.y();
  return out;
}

Index Raster::rows_at_once(const Part& part) const {
  return std::max<Index>(1, cells_at_once / (part.columns * part.factor * part.factor));
}

std::vector<float> Raster::read(const Part& part, Index begin, Index end) const {
  const QuietGdal quiet;
  const Source& s = *source_;
  const Index rows = end - begin;
  // Rows of the file mostly begin in the north.
  const bool downwards = s.transform[5] < 0;
  const Index first = part.first_row + begin * part.factor;
  const Index row = downwards ? s.rows - first - rows * part.factor : first;
  std::vector<float> read(static_cast<std::size_t>(part.columns * rows));
  GDALRasterIOExtraArg extra;
  INIT_RASTERIO_EXTRA_ARG(extra);
  extra.eResampleAlg = part.factor > 1 ? GRIORA_Average : GRIORA_NearestNeighbour;
  const auto take = [&](GDALRasterBandH band, std::vector<float>& to) {
    return gdal().GDALRasterIOEx(
               band, GF_Read, static_cast<int>(part.first_column), static_cast<int>(row),
               static_cast<int>(part.columns * part.factor), static_cast<int>(rows * part.factor),
               to.data(), static_cast<int>(part.columns), static_cast<int>(rows), GDT_Float32, 0, 0,
               &extra) == CE_None;
  };
  const auto take_all = [&](GDALRasterBandH band, std::vector<float>& to) {
    if (!take(band, to))
      fail(fmt::format("the raster cannot be read: {}", QuietGdal::said()),
           "is the file whole? gdalinfo -stats reads all of it");
  };
  std::vector<float> mask;
  if (s.masked) mask.resize(read.size());
  take_all(s.band, read);
  if (s.masked) take_all(gdal().GDALGetMaskBand(s.band), mask);
  if (!s.all_known.empty()) {
    std::vector<float> single;  // cells: a mean hides the value
    if (part.factor > 1) {
      single.resize(read.size());
      extra.eResampleAlg = GRIORA_NearestNeighbour;
      take_all(s.band, single);
    }
    const std::vector<float>& cells = part.factor > 1 ? single : read;
    if (const auto value = std::find_if(cells.begin(), cells.end(), is_usual_no_data);
        value != cells.end())
      fail(fmt::format("'{}' has the value {}, which means in most rasters that nothing is known "
                       "there, but does not say so",
                       s.all_known, *value),
           fmt::format("gdal_edit.py -a_nodata {} says it in a GeoTIFF, a line NODATA_value {} in "
                       "the header of an ASCII grid",
                       *value, *value));
  }
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  const auto none = static_cast<float>(s.no_data);
  for (std::size_t i = 0; i < read.size(); ++i) {
    float& h = read[i];
    const bool known = std::isfinite(h) && h != none && !(s.masked && mask[i] == 0);
    h = known ? static_cast<float>(s.offset + s.scale * h) : unknown;
  }
  if (downwards)
    for (Index j = 0; j < rows / 2; ++j)
      std::swap_ranges(read.begin() + j * part.columns, read.begin() + (j + 1) * part.columns,
                       read.begin() + (rows - 1 - j) * part.columns);
  return read;
}

}  // namespace lahar
#endif
