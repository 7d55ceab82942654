#ifdef LAHAR_GDAL_LIBRARY
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "io/base/text.h"
#include "io/geometry/gdal_library.h"
#include "io/geometry/map_files.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

/// Cells of a file.
struct Window {
  Index column, row, columns, rows;
};

}  // namespace

struct Raster::Source {
  Dataset dataset;
  GDALRasterBandH band = nullptr;
  std::array<double, 6> transform{};
  Index columns = 0, rows = 0;
  double scale = 1, offset = 0;
  double no_data = std::numeric_limits<double>::quiet_NaN();
  bool masked = false;    ///< by more than `no_data`
  std::string all_known;  ///< a file that declares no value for what is not known; or none
  std::string names;      ///< of all files, for messages
  bool heights = true;    ///< else values of a parameter
  double bytes = 0;       ///< of all files

  /// Means over parts of a window, which has `columns` x `rows` of them.
  std::vector<float> take(GDALRasterBandH from, const Window& window, Index columns,
                          Index rows) const;
  std::vector<float> take_mask(const Window& window, Index columns, Index rows) const;
  bool is_known(const std::vector<float>& values, const std::vector<float>& mask,
                std::size_t i) const {
    return std::isfinite(values[i]) && values[i] != static_cast<float>(no_data) &&
           (mask.empty() || mask[i] != 0);
  }
  /// A number of the file times its scale, plus its offset. Throws InputError if single precision
  /// does not hold it.
  float value(float number) const;
  /// Refuses values of single cells that mean that nothing is known there, where the file does not
  /// say so.
  void check(const Window& window, const std::vector<float>& cells,
             const std::vector<float>& mask) const;
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

/// Values that may mean the same, where all others are far away. No soil has a negative parameter.
bool may_be_no_data(float value, bool heights) {
  return is_usual_no_data(value) || value == -32767.F || value == -999.F || value >= 1e20F ||
         (heights && (value == 9999.F || value == 99999.F));
}

/// Of single cells: those with one such value, and all others.
struct StrangeCells {
  float value = 0;
  Index count = 0;
  std::size_t first = 0;                                            ///< its place in the block
  float low = std::numeric_limits<float>::infinity(), high = -low;  ///< of the others
  /// A depth or a height lies among others that are not much smaller.
  bool far_from_others() const {
    constexpr float share = 0.5F;  // of the value
    if (low > high) return is_usual_no_data(value) || value >= 1e20F;
    const float gap = share * std::abs(value);
    return count > 0 && (value < low - gap || value > high + gap);
  }
};

/// What looks unlike the rest among cells that are known. `is_known(i)`.
StrangeCells strange_cells(const std::vector<float>& cells, bool heights, const auto& is_known) {
  StrangeCells found;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (!is_known(i)) continue;
    if (!may_be_no_data(cells[i], heights)) {
      found.low = std::min(found.low, cells[i]);
      found.high = std::max(found.high, cells[i]);
    } else if (found.count == 0 || std::abs(cells[i]) > std::abs(found.value)) {
      found.value = cells[i];
      found.count = 1;
      found.first = i;
    } else if (cells[i] == found.value) {
      ++found.count;
    }
  }
  return found;
}

Dataset open(const MapFile& file) {
  Dataset dataset = open_raster(file);
  if (!dataset)
    fail(fmt::format("GDAL cannot read a raster from '{}': {}", file.name, QuietGdal::said()),
         "ESRI ASCII grids and GeoTIFF are read; gdal_translate converts other formats");
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
  const Vec<2> cell(t[1], t[5]), first(t[0], t[3]);
  const Vec<2> last = first + Vec<2>(cell.x() * gdal().GDALGetRasterXSize(dataset.get()),
                                     cell.y() * gdal().GDALGetRasterYSize(dataset.get()));
  const double farthest = std::max(first.cwiseAbs().maxCoeff(), last.cwiseAbs().maxCoeff());
  constexpr double rounding = 1e-13;  // of coordinates [-]
  if (!first.allFinite() || !(farthest <= farthest_of_map) ||
      !(cell.cwiseAbs().minCoeff() > rounding * farthest))
    fail(fmt::format("'{}' has cells of {} by {} m from ({:g}, {:g}) to ({:g}, {:g})", file.name,
                     t[1], t[5], first.x(), first.y(), last.x(), last.y()),
         "coordinates are finite numbers of metres, and cells are not lost in their rounding");
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

/// GDAL's driver for rasters that are made of others, while they are made: a file of this format,
/// also one beside a map, may lead to any other.
class JoiningDriver {
 public:
  JoiningDriver() { gdal().GDALRegister_VRT(); }
  ~JoiningDriver() { gdal().GDALDeregisterDriver(gdal().GDALGetDriverByName("VRT")); }
  JoiningDriver(const JoiningDriver&) = delete;
  JoiningDriver& operator=(const JoiningDriver&) = delete;
};

/// One raster of several: of numbers that know NaN, which is what lies between tiles.
Dataset join(const std::vector<MapFile>& tiles, std::vector<Dataset> parts,
             const std::string& reference) {
  const JoiningDriver driver;
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
  if (!std::isfinite(s.scale) || !std::isfinite(s.offset))
    fail(fmt::format("'{}' has values that are numbers of the file times {} plus {}", tiles[0].name,
                     s.scale, s.offset));
  const double none = gdal().GDALGetRasterNoDataValue(s.band, &given);
  if (given) s.no_data = none;
  s.heights = unit == "m";
  std::error_code error;
  for (const MapFile& tile : tiles)
    s.bytes += static_cast<double>(std::filesystem::file_size(tile.path, error));
  for (const MapFile& tile : tiles) s.names += (s.names.empty() ? "" : "', '") + tile.name;
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
  // A file without data for most of its cells claims any number of them.
  constexpr double cells_of_byte = 1e6, few_cells = 1e9;
  const double cells = f * f * static_cast<double>(out.columns) * static_cast<double>(out.rows);
  if (cells > few_cells + cells_of_byte * s.bytes)
    fail(fmt::format("'{}' has {:.3g} cells where the mesh is, but only {:.0f} bytes", s.names,
                     cells, s.bytes),
         "is the file whole, and its cell size right? gdal_translate -tr makes larger cells");
  if (out.first_column < out.factor) out.bounds.first.x() = bounds_.first.x();
  if (out.first_row < out.factor) out.bounds.first.y() = bounds_.first.y();
  return out;
}

Index Raster::rows_at_once(const Part& part) const {
  return std::max<Index>(1, cells_at_once / (part.columns * part.factor * part.factor));
}

double Raster::bytes_at_once(const Part& part) const {
  // GDAL reads blocks as a whole, as they are in the file and as numbers of up to 8 bytes.
  constexpr double of_block = 16;
  // Cells, and a mask.
  constexpr double of_cell = 2 * sizeof(float);
  int columns = 0, rows = 0;
  gdal().GDALGetBlockSize(source_->band, &columns, &rows);
  const double cells = static_cast<double>(rows_at_once(part)) *
                       static_cast<double>(part.columns * part.factor * part.factor);
  return of_cell * cells + of_block * static_cast<double>(columns) * static_cast<double>(rows);
}

std::vector<float> Raster::Source::take(GDALRasterBandH from, const Window& window, Index columns,
                                        Index rows) const {
  std::vector<float> to(static_cast<std::size_t>(columns * rows));
  GDALRasterIOExtraArg extra;
  INIT_RASTERIO_EXTRA_ARG(extra);
  extra.eResampleAlg = columns < window.columns ? GRIORA_Average : GRIORA_NearestNeighbour;
  if (gdal().GDALRasterIOEx(from, GF_Read, static_cast<int>(window.column),
                            static_cast<int>(window.row), static_cast<int>(window.columns),
                            static_cast<int>(window.rows), to.data(), static_cast<int>(columns),
                            static_cast<int>(rows), GDT_Float32, 0, 0, &extra) != CE_None)
    fail(fmt::format("the raster cannot be read: {}", QuietGdal::said()),
         "is the file whole? gdalinfo -stats reads all of it");
  return to;
}

std::vector<float> Raster::Source::take_mask(const Window& window, Index columns,
                                             Index rows) const {
  if (!masked) return {};
  return take(gdal().GDALGetMaskBand(band), window, columns, rows);
}

void Raster::Source::check(const Window& window, const std::vector<float>& cells,
                           const std::vector<float>& mask) const {
  const StrangeCells found =
      strange_cells(cells, heights, [&](std::size_t i) { return is_known(cells, mask, i); });
  if (found.count == 0) return;
  if (!all_known.empty() && (is_usual_no_data(found.value) || found.far_from_others()))
    fail(fmt::format("'{}' has the value {}, which means in most rasters that nothing is known "
                     "there, but does not say so",
                     all_known, found.value),
         fmt::format("gdal_edit.py -a_nodata {} says it in a GeoTIFF, a line NODATA_value {} in "
                     "the header of an ASCII grid",
                     found.value, found.value));
  if (!found.far_from_others()) return;
  const auto column = static_cast<Index>(found.first) % window.columns + window.column;
  const auto row = static_cast<Index>(found.first) / window.columns + window.row;
  fail(fmt::format("'{}' has the value {} in {} cells, the first at ({:.10g}, {:.10g}), {}: it "
                   "looks like a second value for what is not known, beside the one that the file "
                   "declares{}",
                   names, found.value, format_count(found.count),
                   transform[0] + transform[1] * (static_cast<double>(column) + 0.5),
                   transform[3] + transform[5] * (static_cast<double>(row) + 0.5),
                   found.low > found.high
                       ? std::string("and no other")
                       : fmt::format("and else from {:.6g} to {:.6g}", found.low, found.high),
                   std::isnan(no_data) ? std::string() : fmt::format(" ({:g})", no_data)),
       fmt::format(
           "give all unknown cells one value: gdalwarp -srcnodata {} -dstnodata {} IN OUT, "
           "or write the declared value into these cells",
           found.value,
           std::isnan(no_data) ? std::string("VALUE_DECLARED") : fmt::format("{:g}", no_data)));
}

float Raster::Source::value(float number) const {
  const double is = offset + scale * static_cast<double>(number);
  if (!(std::abs(is) <= static_cast<double>(std::numeric_limits<float>::max())))
    fail(fmt::format("'{}' has the value {:g}", names, is), "is its scale or offset right?");
  return static_cast<float>(is);
}

std::vector<float> Raster::read(const Part& part, Index begin, Index end) const {
  const QuietGdal quiet;
  const Source& s = *source_;
  const Index rows = end - begin;
  // Rows of the file mostly begin in the north.
  const bool downwards = s.transform[5] < 0;
  const Index first = part.first_row + begin * part.factor;
  const Index row = downwards ? s.rows - first - rows * part.factor : first;
  const Window window{part.first_column, row, part.columns * part.factor, rows * part.factor};
  std::vector<float> read = s.take(s.band, window, part.columns, rows);
  const std::vector<float> mask = s.take_mask(window, part.columns, rows);
  if (part.factor == 1)
    s.check(window, read, mask);
  else  // a mean hides the value
    s.check(window, s.take(s.band, window, window.columns, window.rows),
            s.take_mask(window, window.columns, window.rows));
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < read.size(); ++i)
    read[i] = s.is_known(read, mask, i) ? s.value(read[i]) : unknown;
  if (downwards)
    for (Index j = 0; j < rows / 2; ++j)
      std::swap_ranges(read.begin() + j * part.columns, read.begin() + (j + 1) * part.columns,
                       read.begin() + (rows - 1 - j) * part.columns);
  return read;
}

}  // namespace lahar
#endif
