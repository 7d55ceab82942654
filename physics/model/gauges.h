/// \file What a run measures while it goes on: gauges (a table each) and maps (rasters).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// A quantity that is measured again and again. Arrays have three components in two dimensions,
/// too.
struct Gauge {
  enum class Kind {
    points,     ///< fields at places, as means of the particles around them
    columns,    ///< thickness, height and velocity of what lies over places in plan
    front,      ///< how far particles are along a direction
    plane,      ///< what is beyond a plane, and how much passes it
    particles,  ///< sums and means over particles
    track,      ///< single particles
    force,      ///< what material presses on nodes that are held, or on a rigid body with
  };
  Kind kind = Kind::points;
  std::string name;
  std::vector<std::array<double, 3>> places;  ///< [m] of points and columns
  std::array<double, 3> radius{};             ///< [m] of the particles around a place, by axis
  std::vector<std::string> fields;            ///< of points and tracks: as frames name them
  /// Of fronts and planes, of length 1: positions count along it from `origin`.
  std::array<double, 3> direction{};
  std::array<double, 3> origin{};  ///< [m] moments are about it, too
  int material = -1;               ///< id of the only one that counts; -1 = all count
  bool of_set = false;             ///< only `ids` count
  std::vector<Index> ids;          ///< ascending: of particles, or of nodes that bear forces
  int body = -1;                   ///< of forces: number of the rigid body; -1 = on nodes
  /// Of forces on nodes: axes along which all of `ids` are held, as a wall is. If there are any,
  /// what holds single nodes along other axes belongs to other walls, as in corners.
  std::array<bool, 3> held{};
};

/// Rasters in plan of what happened in the whole run; in three dimensions only.
struct MapPlan {
  bool wanted = false;
  std::array<double, 2> low{};  ///< [m] least corner
  double cell = 0;              ///< [m] edge of a raster cell
  std::array<Index, 2> n{};     ///< cells along x and y
  double threshold = 0;         ///< [m] thinner layers are nothing
  double height = 0;            ///< [m] of the mesh
  Index cells() const { return n[0] * n[1]; }
};

struct GaugePlan {
  std::vector<Gauge> gauges;
  MapPlan maps;
  Index steps = 0;  ///< between rows; 0 = with rows of history.csv
  double dt = 0;    ///< [s] rows at multiples of this time instead; 0 = none
  bool any() const { return !gauges.empty() || maps.wanted; }
};

}  // namespace lahar
