/// \file What `lahar verify plate-with-hole` measures, and the picture of it.
#pragma once

#include <string>
#include <vector>

#include "io/frames/frame.h"
#include "physics/model/model.h"
#include "runtime/verify/hole_series.h"

namespace lahar {

/// Geometry of the case (examples/plate-with-hole.json), all of the plate [m], and the load [Pa].
inline constexpr double plate_radius = 0.5, plate_width = 5, plate_length = 8, plate_load = 100,
                        plate_cell = 0.0625;

/// The case with the published discretisation, 40,155 particles; overrides as for --set.
Model<2> published_plate(const std::vector<std::string>& overrides);

/// Stresses over the load: A is the hole's edge across the load, B along the load.
struct HoleStresses {
  double a_xx = 0, b_xx = 0, b_yy = 0;
};

/// Stress at the hole of a plate whose particles are a frame of the case, also of finer or longer
/// ones.
///
/// No particle is at the hole, and the cells that the hole cuts see it as a staircase, so a series
/// that satisfies elasticity and leaves the hole free is fitted to the particles from one cell to
/// two radii away from it. Of the exact stresses at those particles it makes the exact ones at the
/// hole, to 1e-4.
HoleStresses stresses_at_hole(const Frame& frame);

/// Time of one number of threads.
struct ThreadTime {
  int threads = 1;
  double nanoseconds = 0;  ///< per particle and step: median over repeated runs
  double spread = 0;       ///< slowest over fastest of them
};

/// The stress field, the stress along the ligament above the hole against the exact one, and the
/// time against the number of threads, as SVG.
std::string plate_picture(const Frame& frame, const HoleSeries& exact,
                          const std::vector<ThreadTime>& times);

}  // namespace lahar
