/// \file One row of history.csv: conservation laws of the whole model at one step.
///
/// The header line has plain names (`pandas.read_csv("history.csv").kinetic` works); their units
/// are in manifest.json under "history". Numbers are the shortest that read back to the same bits.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Where a rigid body is after `step` updates, and what particles do to it then. Arrays have three
/// components in two dimensions, too.
struct RigidBodyRow {
  std::string name;
  std::array<double, 3> place{};             ///< [m] of its centre
  std::array<double, 3> rotation{};          ///< [rad] since the start: a vector along its axis
  std::array<double, 3> velocity{}, spin{};  ///< [m/s], [rad/s]
  std::array<double, 3> force{}, torque{};   ///< [N], [N m] about its centre
};

/// Sums over all particles after `step` updates; energies in J (2D: per metre of thickness).
struct HistoryRow {
  Index step = 0;
  double time = 0;  ///< [s]
  double dt = 0;    ///< [s] of the last step
  Index particles = 0;
  double mass = 0;                   ///< [kg]
  std::array<double, 3> momentum{};  ///< [kg m/s]
  double kinetic = 0;                ///< sum of m v^2 / 2
  double internal = 0;  ///< work of the stresses since the start (elastic: the strain energy)
  double external = 0;  ///< work of gravity, loads and prescribed velocities since the start
  double damping = 0;   ///< energy taken by damping, contact, friction and the velocity transfer
  double friction = 0;  ///< of damping: what friction at walls and between bodies took
  double balance =
      0;  ///< kinetic + internal + damping - external - kinetic at start: numerical drift
  double max_speed = 0;  ///< [m/s]
  double divided = 0;    ///< increments of materials that were done in parts, since the start
  std::vector<RigidBodyRow> bodies = {};  ///< rows of rigid_bodies.csv
};

struct HistoryColumn {
  const char* name;
  const char* unit;
  const char* meaning;
};

/// The columns of history.csv in order.
std::span<const HistoryColumn> history_columns();

std::string history_header();                 ///< with newline
std::string history_line(const HistoryRow&);  ///< with newline

/// The columns of rigid_bodies.csv, a row for each body where history.csv has one.
inline constexpr const char* rigid_bodies_file = "rigid_bodies.csv";
std::string rigid_bodies_header();
std::string rigid_bodies_lines(const HistoryRow&);

}  // namespace lahar
