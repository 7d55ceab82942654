/// \file Motions that are made solutions by a body force, and how far a computed motion is from
/// them: what `lahar verify manufactured` tabulates.
#pragma once

#include <string>
#include <vector>

namespace lahar {

/// A solid of neo-Hookean material in plane strain that starts undeformed and in motion.
enum class Motion {
  /// Wallstedt and Guilkey (2008), J. Comput. Phys. 227, 9628-9642: the unit square between smooth
  /// walls, u_i = A sin(pi X_i) sin(pi (c t + phi_i)), here with phi = (0, 1).
  axis_aligned,
  /// Kamojjala, Brannon, Sadeghirad and Guilkey (2015), Eng. with Computers 31, 31-48: a ring whose
  /// material turns by alpha(R, t) about its centre; shear and rotation, no change of volume. Here
  /// in
  /// a square of the same material that is at rest and held at its sides: a ring with free edges of
  /// squares (as particles fill it) turns as a whole by the torque that they miss.
  vortex
};

struct ManufacturedCase {
  Motion motion = Motion::axis_aligned;
  int cells = 16;           ///< per unit of length
  double amplitude = 0.05;  ///< A [-]: of the vortex the largest angle [rad]
  std::string functions;    ///< as the scenario's key; empty = its default
  std::string update;       ///< analysis.velocity_update
  int per_cell = 2;         ///< particles per cell and direction
  int threads = 0;
};

/// Largest over a period (axis_aligned) or half of one (vortex) of the root mean square over the
/// particles that should move of |u - exact u|, over the amplitude. Infinite where the run breaks
/// down.
double displacement_error(const ManufacturedCase& what);

}  // namespace lahar
