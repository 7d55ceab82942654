/// \file Maps: elevation rasters and polygons, which GDAL reads. Throws InputError for what is
/// wrong with them, without a place: it is for the caller to say where the file is named.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "physics/geometry/outlines.h"
#include "physics/geometry/surface.h"

namespace lahar {

/// Coordinates of maps are not larger [m].
inline constexpr double farthest_of_map = 1e12;

/// Whether this build reads maps at all, and the library that it needs can be loaded.
bool has_gdal();

/// A file that exists.
struct MapFile {
  std::string name;  ///< for messages
  std::string path;
};

/// How a model lies on the map.
struct MapFrame {
  Vec<2> origin = Vec<2>::Zero();  ///< [m] place on the map where the model has x = y = 0
  std::string reference;           ///< WKT of the coordinate reference system; empty if not said
};

/// Name of a coordinate reference system, from its WKT.
std::string reference_name(const std::string& wkt);
bool same_reference(const std::string& wkt, const std::string& other);

/// Cells of equal size in rows, one file or several that lie beside each other; of it the part that
/// a model needs. Coordinates are those of the map [m]. Values are heights [m], or of another
/// `unit`.
class Raster {
 public:
  explicit Raster(const std::vector<MapFile>& tiles, std::string_view unit = "m");
  ~Raster();
  Raster(const Raster&) = delete;
  Raster& operator=(const Raster&) = delete;

  const std::string& reference() const { return reference_; }  ///< WKT; empty if not said
  const std::pair<Vec<2>, Vec<2>>& bounds() const { return bounds_; }

  /// A grid over a part of the raster: one point for each `factor` x `factor` of its cells, in
  /// their centre, with their mean height.
  struct Part {
    Index columns = 0, rows = 0;  ///< of points
    Index first_column = 0, first_row = 0, factor = 1;
    Vec<2> first = Vec<2>::Zero(), spacing = Vec<2>::Ones();  ///< [m] of points, both ascending
    std::pair<Vec<2>, Vec<2>> bounds;                         ///< [m] of the cells
    Index points() const { return columns * rows; }
  };
  /// What covers the box from `low` to `high` and some points more, with distances of points up to
  /// `finest` [m] if the raster is that fine. Without points if the box is elsewhere.
  Part part(const Vec<2>& low, const Vec<2>& high, double finest) const;
  /// How many rows are read at once. Their number bounds the memory that reading takes.
  Index rows_at_once(const Part& part) const;
  /// The memory that this takes [bytes].
  double bytes_at_once(const Part& part) const;
  /// Heights of rows from `begin` to `end`, rows and points ascending; NaN where not known.
  std::vector<float> read(const Part& part, Index begin, Index end) const;

 private:
  struct Source;
  std::unique_ptr<Source> source_;
  std::string reference_;
  std::pair<Vec<2>, Vec<2>> bounds_;
};

/// Where two tiles both have values that are not the same.
struct TileDifference {
  double difference = 0;      ///< [m], or the unit of the values
  Vec<2> x = Vec<2>::Zero();  ///< [m] of the map
  std::string below, above;   ///< names: the value of `above`, which comes later, is taken
};

/// The largest difference of tiles that overlap, from `low` to `high` on the map: of heights more
/// than a tenth of a cell, a cell where the cells of the tiles do not meet; of other values more
/// than a tenth. Heights may differ by `harmless` [m]. Looks at some places of large overlaps.
std::optional<TileDifference> difference_of_tiles(const std::vector<MapFile>& files,
                                                  const Vec<2>& low, const Vec<2>& high,
                                                  bool heights, double harmless = 0);

/// The surface through the points of a part, moved by -`origin`. It reaches to the edges of the
/// cells: straight on from the last two points.
Surface<3> surface_of(const Raster::Part& part, std::vector<float> heights, const Vec<2>& origin);

/// Polygons of a file.
struct PolygonFile {
  std::vector<Outlines::Polygon> polygons;  ///< [m] of the map
  std::string reference;                    ///< WKT; empty if not said
};

/// All polygons, or those of features that fit `filter` (as in SQL after WHERE).
PolygonFile read_polygons(const MapFile& file, const std::string& filter);

}  // namespace lahar
