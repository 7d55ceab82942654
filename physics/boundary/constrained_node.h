/// \file Constraints of one node that has rotated axes, or friction on a rigid wall.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "physics/base/types.h"
#include "physics/boundary/node_impulse.h"

namespace lahar {

/// A node whose constraints act along axes of its own, that rubs against a wall, or is accelerated.
/// All of its prescribed velocities are here.
template <int Dim>
struct ConstrainedNode {
  using Axes = Eigen::Matrix<double, Dim, Dim, Eigen::DontAlign>;
  Local node = -1;
  Axes axes = Axes::Identity();            ///< columns: local axes
  std::array<bool, Dim> fixed{};           ///< velocity is prescribed along that axis
  std::array<double, Dim> velocity{};      ///< [m/s] prescribed, by local axis
  std::array<bool, Dim> accelerated{};     ///< acceleration is prescribed along that axis
  std::array<double, Dim> acceleration{};  ///< [m/s^2] prescribed, by local axis
  std::array<int, Dim> function{};         ///< of time, its factor: Model::functions; -1 = constant
  int normal = -1;      ///< local axis along the normal of a two-sided wall; -1 = no friction
  double outward = 1;   ///< sign of the normal that points out of the body
  double friction = 0;  ///< Coulomb's coefficient [-]
  /// One-sided walls, one per axis at most: sign of the axis that points out of the body, 0 = none.
  /// `velocity` along that axis is the wall's; `fixed` is false there.
  std::array<int, Dim> pushes{};
  std::array<double, Dim> rubs{};  ///< Coulomb's coefficient [-] of the one-sided wall
};

/// Work at a wall per mass of the node [J/kg].
struct WallWork {
  double reaction = 0;  ///< of what holds prescribed velocities and accelerations, on the node
  double taken = 0;     ///< from the node
  double friction = 0;  ///< of it, by friction
};

/// What one-sided walls did to a node in a step.
template <int Dim>
struct WallPush {
  std::array<bool, Dim> pressed{};     ///< the walls that pushed, by local axis
  bool stuck = false;                  ///< friction left no sliding
  NodeImpulse<Dim> by;                 ///< of all of them
  Vec<Dim> rubbed = Vec<Dim>::Zero();  ///< [m/s] of by.change, what friction did
  Vec<Dim> mapped = Vec<Dim>::Zero();  ///< [m/s] by MUSL's second mapping, before anything held it
  bool any() const { return std::find(pressed.begin(), pressed.end(), true) != pressed.end(); }
};

/// Prescribe the velocity of a node: its component along each fixed axis. One-sided walls do
/// nothing: their impulse depends on the velocity at the end of the step.
template <int Dim>
void prescribe_velocity(const ConstrainedNode<Dim>& wall, double* velocity);

/// Take from a velocity what moves into one-sided walls, and return it [m/s], along global axes.
/// For velocities that only strains are taken from, and those that a step begins with.
template <int Dim>
Vec<Dim> stop_at_wall(const ConstrainedNode<Dim>& wall, double* velocity);

/// The same as prescribe_velocity() at the end of a step of `dt` [s], where the prescribed
/// components also have no acceleration, and one-sided walls stop what moves into them. Returns the
/// work of what holds them per mass [J/kg].
template <int Dim>
double hold_velocity(const ConstrainedNode<Dim>& wall, double dt, double* velocity,
                     double* acceleration);

/// Advance the velocity of a node by its acceleration: first friction changes the acceleration,
/// then prescribed accelerations replace it (without their factors of time), then v += dt a, then
/// prescribed velocities, which also zero the acceleration.
/// `velocity` [m/s] is that before the step, with prescribed components, and becomes that after it;
/// `acceleration` [m/s^2] is that of all forces but the wall's, and becomes the final one.
///
/// Friction acts where the acceleration presses the node against the wall, and is limited by
/// mu |a_n| along the tangential velocity v_t + dt a_t that the node would get: it stops the node
/// if that suffices, else it slows it (CB-Geo MPM). A node at rest stays where |a_t| <= mu |a_n|.
/// One-sided walls act on v* = v + dt a, without their part in `a`. Where v* moves into the wall,
/// at the speed w along its normal, an impulse of w per mass stops it, and friction takes from the
/// sliding velocity at most mu w (Bardenhagen et al. 2001, of a rigid body). Directions that are
/// held take no part in sliding. Velocity and acceleration both change, by w and w / dt: particles
/// get all of the impulse, so that momentum is balanced. `as_cbgeo`: in 3D a node that begins to
/// slip is slowed by mu |a_n| |a_t| / (|a_t| - mu |a_n|), as there.
template <int Dim>
WallWork advance_at_wall(const ConstrainedNode<Dim>& wall, double dt, bool as_cbgeo,
                         double* velocity, double* acceleration, WallPush<Dim>* push = nullptr);

/// Hold a node that walls pushed, in MUSL's second mapping, which strains are taken from. The node
/// moves with the walls along their normals. It does not slide where friction stuck it. The mapping
/// smooths what walls did: a node that may leave a wall, but not enter it, would stretch what the
/// wall presses, step by step.
template <int Dim>
void hold_at_walls(const ConstrainedNode<Dim>& wall, const WallPush<Dim>& push, double* velocity);

extern template void prescribe_velocity(const ConstrainedNode<2>&, double*);
extern template void prescribe_velocity(const ConstrainedNode<3>&, double*);
extern template Vec<2> stop_at_wall(const ConstrainedNode<2>&, double*);
extern template Vec<3> stop_at_wall(const ConstrainedNode<3>&, double*);
extern template double hold_velocity(const ConstrainedNode<2>&, double, double*, double*);
extern template double hold_velocity(const ConstrainedNode<3>&, double, double*, double*);
extern template WallWork advance_at_wall(const ConstrainedNode<2>&, double, bool, double*, double*,
                                         WallPush<2>*);
extern template WallWork advance_at_wall(const ConstrainedNode<3>&, double, bool, double*, double*,
                                         WallPush<3>*);
extern template void hold_at_walls(const ConstrainedNode<2>&, const WallPush<2>&, double*);
extern template void hold_at_walls(const ConstrainedNode<3>&, const WallPush<3>&, double*);

}  // namespace lahar
