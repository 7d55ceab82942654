/// \file What maps add up over particles, raster cell by raster cell.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "physics/model/gauges.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Whole numbers by raster cell: volume, volume times velocity (three components) are added, of
/// minus the largest pressure the least counts.
///
/// Volumes are in units of 2^-60 of (a raster cell's area) x (twice the height of the mesh), those
/// times velocities of 2^14 m/s times that: what a raster cell may hold is far below 2^63.
struct MapSums {
  static constexpr std::size_t n_added = 4;
  std::vector<Index> added;  ///< n_added for each raster cell
  std::vector<Index> least;  ///< one for each
};

/// Particles in a raster cell.
struct MapTerm {
  Index cell;
  std::array<Index, MapSums::n_added> added{};
  double trace = std::numeric_limits<double>::infinity();  ///< [Pa] the least of their stresses
};

/// The particles of a patch that are in the raster, those of a cell together where they follow each
/// other; three dimensions.
std::vector<MapTerm> map_terms(const Patch<3>& patch, const MapPlan& plan);
/// There is room in `sums`.
void add_to(MapSums& sums, const MapTerm& term);

/// Rasters of the whole run, as they are kept: by kind, one after the other.
enum class MapKind {
  thickness,
  speed,
  pressure,
  max_thickness,
  max_speed,
  max_pressure,
  arrival_time
};
inline constexpr std::size_t n_maps = 7;
/// Nothing has happened yet: zero, and nan where nothing has arrived.
std::vector<double> empty_maps(const MapPlan& plan);
/// Bring the rasters up to date with what is there at `time` [s].
void add_to_maps(std::vector<double>& maps, const MapPlan& plan, double time,
                 std::span<const Index> added, std::span<const Index> least);

}  // namespace lahar
