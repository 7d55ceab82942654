/// \file Rigid bodies that material meets inside of the mesh: terrain, obstacles, tools.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "physics/geometry/solid.h"

namespace lahar {

struct MathFunction;

/// Where a rigid body is, and how it moves.
template <int Dim>
struct Placement {
  using Components = Eigen::Matrix<double, Dim, 1, Eigen::DontAlign>;
  Components origin = Components::Zero();  ///< [m] place of RigidBody::centre
  Eigen::Matrix<double, Dim, Dim, Eigen::DontAlign> axes =
      Eigen::Matrix<double, Dim, Dim>::Identity();  ///< columns: its axes, rotated since the start
  Components velocity = Components::Zero();         ///< [m/s] of the origin
  /// [rad/s] about x, y, z; in two dimensions about z alone.
  Eigen::Matrix<double, 3, 1, Eigen::DontAlign> spin = Eigen::Matrix<double, 3, 1>::Zero();

  Vec<Dim> velocity_at(const Vec<Dim>& x) const;
};

/// A body of any shape that does not deform. Particles that meet it are pushed away and rubbed
/// (physics/kernels/rigid_contact.h).
template <int Dim>
struct RigidBody {
  enum class Motion {
    fixed,
    prescribed,  ///< velocity and spin times a function of time
    free         ///< by forces of particles, gravity, and its own mass
  };
  std::string name;
  SolidPtr<Dim> solid;     ///< where it is at the start
  double friction = 0;     ///< Coulomb's coefficient [-]; infinite: no sliding while pressed
  double cohesion = 0;     ///< [Pa] shear stress that acts beside friction while pressed
  double restitution = 0;  ///< speed after over speed before it strikes another rigid body [-]
  Motion motion = Motion::fixed;
  Vec<Dim> centre = Vec<Dim>::Zero();    ///< [m] it turns about this point; of a free body its mass
  Vec<Dim> velocity = Vec<Dim>::Zero();  ///< [m/s] prescribed; of a free body at the start
  Vec<3> spin = Vec<3>::Zero();          ///< [rad/s] the same
  int function = -1;                     ///< of a prescribed motion; -1 = constant
  double mass = 0;                       ///< [kg] of a free body
  /// [kg m^2] of a free body about its centre, at the start; in two dimensions zz alone matters.
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  Eigen::Vector3d held_spin = Eigen::Vector3d::Zero();  ///< 1: it does not turn about this axis
  Vec<Dim> held = Vec<Dim>::Zero();                     ///< 1: it does not move along this axis

  // Where the stages before this one have brought it.
  Vec<Dim> moved = Vec<Dim>::Zero();  ///< [m]
  Eigen::Matrix<double, Dim, Dim> turned = Eigen::Matrix<double, Dim, Dim>::Identity();

  /// It is where `solid` is, and stays there.
  bool stays() const {
    return motion == Motion::fixed && moved.isZero(0) &&
           turned == Eigen::Matrix<double, Dim, Dim>::Identity();
  }
};

/// Where a body that is not free is at a time [s]: a pure function of time. Velocities that are
/// slopes are means of the step of `dt` [s] before that, if one is given.
template <int Dim>
Placement<Dim> placement_at(const RigidBody<Dim>& body, const std::vector<MathFunction>& functions,
                            double time, double dt = 0);

/// A rotation by the vector `angle` [rad]: about its direction, by its length. In two dimensions
/// about z.
template <int Dim>
Eigen::Matrix<double, Dim, Dim> rotation_by(const Vec<3>& angle);

/// Force on a rigid body [N], and torque about its origin [N m].
struct Reaction {
  std::array<double, 3> force{}, torque{};
  /// A force at a point that is `arm` [m] away from the origin.
  template <int Dim>
  void add(const Vec<Dim>& at, const Vec<Dim>& arm);
  bool operator==(const Reaction&) const = default;
};

}  // namespace lahar
