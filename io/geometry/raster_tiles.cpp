// How far tiles of a raster differ where they overlap.
#ifdef LAHAR_GDAL_LIBRARY
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "io/geometry/gdal_library.h"
#include "io/geometry/map_files.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

/// Heights that differ by less than this part of a cell do no harm [-]. Where the cells of two
/// tiles do not meet, heights are those of different places.
constexpr double least_share = 0.1, least_share_apart = 1;
/// And values of parameters, by less than this share of themselves [-].
constexpr double least_share_of_value = 0.1;
/// Places of an overlap that are compared along each axis, at most.
constexpr Index most_places = 512;

class Tile {
 public:
  explicit Tile(const MapFile& file) : dataset_(open_raster(file)) {
    if (dataset_ && gdal().GDALGetGeoTransform(dataset_.get(), t_.data()) != CE_None)
      dataset_.reset();
    if (!dataset_) return;
    band_ = gdal().GDALGetRasterBand(dataset_.get(), 1);
    columns_ = gdal().GDALGetRasterXSize(dataset_.get());
    rows_ = gdal().GDALGetRasterYSize(dataset_.get());
    int given = 0;
    const double scale = gdal().GDALGetRasterScale(band_, &given);
    if (given) scale_ = scale;
    const double offset = gdal().GDALGetRasterOffset(band_, &given);
    if (given) offset_ = offset;
    const Vec<2> a(t_[0], t_[3]);
    const Vec<2> b(t_[0] + t_[1] * static_cast<double>(columns_),
                   t_[3] + t_[5] * static_cast<double>(rows_));
    low = a.cwiseMin(b);
    high = a.cwiseMax(b);
  }
  bool is_open() const { return dataset_ != nullptr; }
  Vec<2> cell() const { return {std::abs(t_[1]), std::abs(t_[5])}; }

  /// Whether its cells are those of another one, as far as both reach.
  bool meets(const Tile& other) const {
    constexpr double rounding = 1e-3;  // of a cell
    const Vec<2> shift = (low - other.low).cwiseQuotient(cell());
    return ((cell() - other.cell()).cwiseAbs().array() < rounding * cell().array()).all() &&
           (shift.array() - shift.array().round()).abs().maxCoeff() < rounding;
  }

  /// Along a row of the map at y: values at columns x, NaN where none is known.
  std::vector<double> values(const std::vector<double>& x, double y) const {
    const Index row = within(std::floor((y - t_[3]) / t_[5]), rows_);
    const Index first = within(std::floor((x.front() - t_[0]) / t_[1]), columns_);
    const Index last = within(std::floor((x.back() - t_[0]) / t_[1]), columns_);
    const std::vector<float> line = take(band_, first, row, last - first + 1),
                             mask =
                                 take(gdal().GDALGetMaskBand(band_), first, row, last - first + 1);
    std::vector<double> found;
    for (const double at : x) {
      const auto i =
          static_cast<std::size_t>(within(std::floor((at - t_[0]) / t_[1]), columns_) - first);
      const bool known = !line.empty() && !mask.empty() && mask[i] != 0 && std::isfinite(line[i]);
      found.push_back(known ? offset_ + scale_ * static_cast<double>(line[i]) : std::nan(""));
    }
    return found;
  }

  Vec<2> low = Vec<2>::Zero(), high = Vec<2>::Zero();  ///< [m] of the map

 private:
  static Index within(double at, Index n) {
    return static_cast<Index>(std::clamp(at, 0.0, static_cast<double>(n - 1)));
  }
  static std::vector<float> take(GDALRasterBandH band, Index column, Index row, Index n) {
    std::vector<float> to(static_cast<std::size_t>(n));
    GDALRasterIOExtraArg extra;
    INIT_RASTERIO_EXTRA_ARG(extra);
    const auto width = static_cast<int>(n);
    if (gdal().GDALRasterIOEx(band, GF_Read, static_cast<int>(column), static_cast<int>(row), width,
                              1, to.data(), width, 1, GDT_Float32, 0, 0, &extra) != CE_None)
      to.clear();  // Raster::read() reports the error
    return to;
  }

  Dataset dataset_;
  GDALRasterBandH band_ = nullptr;
  std::array<double, 6> t_{};
  Index columns_ = 0, rows_ = 0;
  double scale_ = 1, offset_ = 0;
};

/// Centres of cells from `low` to `high`, not too many.
std::vector<double> places(double low, double high, double cell) {
  const auto cells = std::max<Index>(1, std::llround((high - low) / cell));
  const Index stride = (cells + most_places - 1) / most_places;
  std::vector<double> x;
  for (Index i = 0; i < cells; i += stride)
    x.push_back(low + (static_cast<double>(i) + 0.5) * (high - low) / static_cast<double>(cells));
  return x;
}

}  // namespace

std::optional<TileDifference> difference_of_tiles(const std::vector<MapFile>& files,
                                                  const Vec<2>& low, const Vec<2>& high,
                                                  bool heights, double harmless) {
  if (files.size() < 2) return {};
  const QuietGdal quiet;
  std::vector<Tile> tiles;
  for (const MapFile& file : files) {
    tiles.emplace_back(file);
    if (!tiles.back().is_open()) return {};
  }
  TileDifference worst;
  double worst_share = 1;  // of what is too much
  for (std::size_t b = 1; b < tiles.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) {
      const Vec<2> from = tiles[a].low.cwiseMax(tiles[b].low).cwiseMax(low);
      const Vec<2> to = tiles[a].high.cwiseMin(tiles[b].high).cwiseMin(high);
      const Vec<2> cell = tiles[a].cell().cwiseMax(tiles[b].cell());
      if (!((to - from).array() > 0.5 * cell.array()).all()) continue;
      const double share = tiles[a].meets(tiles[b]) ? least_share : least_share_apart;
      const auto x = places(from.x(), to.x(), cell.x());
      for (const double y : places(from.y(), to.y(), cell.y())) {
        const auto one = tiles[a].values(x, y), other = tiles[b].values(x, y);
        for (std::size_t i = 0; i < x.size(); ++i) {
          const double difference = std::abs(one[i] - other[i]);
          const double most =
              heights ? std::max(share * cell.minCoeff(), harmless)
                      : least_share_of_value * std::max(std::abs(one[i]), std::abs(other[i]));
          if (!(difference > worst_share * most)) continue;
          worst_share = difference / most;
          worst = {difference, {x[i], y}, files[a].name, files[b].name};
        }
      }
    }
  if (worst.difference == 0) return {};
  return worst;
}

}  // namespace lahar
#endif
