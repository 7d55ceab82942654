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
  /// Kamojjala, Brannon, Sadeghirad and Guilkey (2015), Eng. with Computers 31, 31-48: a free ring
  /// whose material turns by alpha(R, t) about its centre, at half of the run by up to A [rad], and
  /// back; shear (up to 7 A) and rotation, no change of volume. Its particles lie along circles.
  vortex
};

/// For the vortex of 1 rad: at its half, waves along the most stretched fibres are four times as
/// fast as at first. Measured with 32 cells: a step twice as long has 2 to 12 % more error with
/// splines and uniform GIMP, 73 % with CPDI; one four times as long 25 % with quadratic splines.
inline constexpr double vortex_courant = 0.025;

struct ManufacturedCase {
  Motion motion = Motion::axis_aligned;
  int cells = 16;              ///< per unit of length
  double amplitude = 0.05;     ///< A [-]: of the vortex the largest angle [rad]
  std::string functions;       ///< as the scenario's key; empty = its default
  std::string update;          ///< analysis.velocity_update
  std::string scheme = "usl";  ///< analysis.mpm_scheme
  int per_cell = 2;            ///< particles per cell and direction
  double courant = 0.2;        ///< time step over that in which a wave crosses a cell, undeformed
  int threads = 0;
};

/// Largest over a period (axis_aligned) or half of one (vortex) of the root mean square over the
/// particles of |u - exact u|, over the amplitude. Infinite where the run breaks down.
double displacement_error(const ManufacturedCase& what);

}  // namespace lahar
