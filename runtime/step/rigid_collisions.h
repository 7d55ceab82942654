/// \file Where rigid bodies meet. At least one of two that meet is free.
#pragma once

#include <vector>

#include "physics/geometry/solid_samples.h"
#include "physics/model/model.h"

namespace lahar {

/// A point of a body at, or just before, the surface of another body.
template <int Dim>
struct Encounter {
  std::size_t body, other;  ///< of the model, and behind its bodies its sides
  Vec<Dim> x;               ///< [m]
  Vec<Dim> normal;          ///< of the other body's surface, towards this one
  double gap;               ///< [m] from that surface; negative inside
};

/// Points on the surfaces of bodies that are held against all other bodies, if one of both is free,
/// and against sides of the mesh behind which they do not begin. Where a surface is round, points
/// next to the other body move to where it is nearest to that one: a ball touches a plane in one
/// point, and a push there does not turn it. Many points may meet one flat part of the other body.
/// Then those at the outer ends count, and the one that will be deepest.
template <int Dim>
class RigidCollisions {
 public:
  explicit RigidCollisions(const Model<Dim>& model);
  /// Find which sides of the mesh hold which bodies, when the run or the stage begins.
  void begin();
  /// A body of the model, or a side of it.
  const RigidBody<Dim>& body(std::size_t k) const {
    const auto& bodies = model_.rigid_bodies;
    return k < bodies.size() ? bodies[k] : model_.sides[k - bodies.size()];
  }
  double spacing(std::size_t k) const { return spacing_[k]; }  ///< [m] of the points of a body
  /// Points that may touch within dt [s], in which bodies would come from `at` to `after` if they
  /// did not touch.
  std::vector<Encounter<Dim>> encounters(const std::vector<Placement<Dim>>& at,
                                         const std::vector<Placement<Dim>>& after, double dt) const;

 private:
  struct Point {
    SurfacePoint<Dim> at;  ///< at the start
    bool round;            ///< the surface bends there
  };
  void add_pair(std::size_t own, std::size_t other, const std::vector<Placement<Dim>>& at,
                const std::vector<Placement<Dim>>& after, double dt,
                std::vector<Encounter<Dim>>& encounters) const;
  bool is_covered(std::size_t own, const Vec<Dim>& x, double gap,
                  const std::vector<Placement<Dim>>& at) const;
  static const Placement<Dim>& placement(const std::vector<Placement<Dim>>& of, std::size_t k);

  const Model<Dim>& model_;
  std::vector<std::vector<Point>> points_;  ///< by body; none of those without an end
  std::vector<double> spacing_;             ///< [m] of these points
  std::vector<double> radius_;              ///< [m] of a ball about the centre with all points
  std::vector<std::vector<std::size_t>> held_by_;  ///< sides, as body() numbers them, by body
};

}  // namespace lahar
