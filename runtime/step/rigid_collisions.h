/// \file Contact of free rigid bodies with other rigid bodies.
#pragma once

#include <vector>

#include "physics/model/model.h"

namespace lahar {

/// Points on the surfaces of free bodies that are held against all other bodies. A point that is
/// inside of another body by d is pushed out along its normal n; w is its velocity relative to it:
///
///     N = max(0, m omega^2 d - 2 zeta omega m w.n) / 4      omega = 0.05 / dt
///     |T| <= mu N,  T against the velocity along the surface
///
/// Where the surface is round, points next to the other body move to where it is nearest to that
/// one. So a ball touches a plane in one point, and the push there does not turn it. Up to four
/// such points share the push of four; of a flat face any number shares the push of 64, or of 32
/// where the other body is free and its points push, too. m is the mass of the body, or of two free
/// ones their reduced mass; mu is the larger coefficient of the two. So the push is soft enough for
/// dt: its damping takes at most half of a velocity in one step. And it is so stiff that a body at
/// rest sinks in by some hundred g dt^2. This dt is a part of the step of particles
/// (RigidMotion::move()).
template <int Dim>
class RigidCollisions {
 public:
  explicit RigidCollisions(const Model<Dim>& model);
  struct Point {
    Vec<Dim> x;  ///< [m] at the start
    bool round;  ///< the surface bends there
  };
  /// Points of a free body that may be inside of another one before long.
  struct Near {
    std::size_t free, other;
    std::vector<Point> points;
  };
  /// Those within dt [s] from where bodies are `at`, with twice the way that they make.
  std::vector<Near> near(const std::vector<Placement<Dim>>& at, double gravity, double dt) const;
  /// Add what bodies do to each other at these points.
  void add(const std::vector<Near>& near, const std::vector<Placement<Dim>>& at, double dt,
           std::vector<Reaction>& reactions) const;

 private:
  void add_pair(const Near& near, const std::vector<Placement<Dim>>& at, double dt,
                std::vector<Reaction>& reactions) const;

  const Model<Dim>& model_;
  std::vector<std::vector<Point>> points_;  ///< by body; none of bodies not free
  std::vector<double> spacing_;             ///< [m] of these points
};

}  // namespace lahar
