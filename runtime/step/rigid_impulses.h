/// \file Impulses of rigid bodies that touch each other.
#pragma once

#include <Eigen/Core>
#include <span>

#include "physics/base/types.h"

namespace lahar {

/// A rigid body that impulses change; in two dimensions it moves in the plane z = 0.
struct StruckBody {
  Vec<3> velocity = Vec<3>::Zero();      ///< [m/s] of its origin
  Vec<3> spin = Vec<3>::Zero();          ///< [rad/s]
  Vec<3> inverse_mass = Vec<3>::Zero();  ///< [1/kg] along axes; 0: nothing moves it there
  Eigen::Matrix3d inverse_inertia = Eigen::Matrix3d::Zero();  ///< [1/(kg m^2)] about the origin

  Vec<3> velocity_at(const Vec<3>& arm) const { return velocity + spin.cross(arm); }
};

/// A point at which a body meets another one.
struct Touch {
  std::size_t body, other;            ///< of the list of bodies
  Vec<3> arm = Vec<3>::Zero();        ///< [m] from the origin of the body
  Vec<3> other_arm = Vec<3>::Zero();  ///< [m] from that of the other one
  Vec<3> normal = Vec<3>::Zero();     ///< unit vector from the other body to this one
  double least = 0;                   ///< [m/s] so fast at least they part, along the normal
  double friction = 0;                ///< Coulomb's coefficient [-], may be infinite
};

struct Impulses {
  int sweeps = 0;
  double work = 0;       ///< [J] by which they change the kinetic energy of what moves freely
  double exchanged = 0;  ///< [J] sizes of the parts of which the work is a sum
  bool makes_energy() const { return work > 1e-9 * exchanged; }  ///< beyond rounding
};

/// Give bodies the velocities that they have after impulses at all points. With w the velocity of
/// the body against the other one at a point, N the impulse along the normal n, T across:
///
///     N >= 0,  w.n >= least,  N (w.n - least) = 0
///     |T| <= mu N,  and T is against w across n where |T| = mu N, or else w across n is 0
///
/// (Moreau 1988; Jean 1999), by sweeps of the projected Gauss-Seidel method over the points, there
/// and back, with conjugate gradients between them, until no sweep changes a velocity by more than
/// `tolerance` [m/s], 500 at most.
/// Momentum of free bodies together is kept to rounding. `dimension` is 2 or 3: friction acts along
/// one direction or in a plane. A point at which bodies can hardly move along the normal, as they
/// are held, has no impulse.
Impulses strike(std::span<StruckBody> bodies, std::span<const Touch> touches, int dimension,
                double tolerance);

}  // namespace lahar
