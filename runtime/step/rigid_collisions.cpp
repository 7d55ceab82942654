#include "runtime/step/rigid_collisions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "physics/geometry/solid_samples.h"

namespace lahar {

namespace {

constexpr int cuts_of(int dim) {
  return dim == 2 ? 64 : 20;
}
template <int Dim>
bool is_free(const RigidBody<Dim>& body) {
  return body.motion == RigidBody<Dim>::Motion::free;
}

template <int Dim>
struct SurfacePlace {
  Vec<Dim> x, normal;
};

template <int Dim>
SurfacePlace<Dim> on_surface(const Solid<Dim>& solid, const Vec<Dim>& x) {
  const auto near = solid.nearest(x);
  return {x - near.distance * near.normal, near.normal};
}

constexpr double probe = 0.05;       ///< of the distance of points: so far off bends are measured
constexpr double least_bend = 0.01;  ///< [rad] over the distance of points

/// Whether a surface bends outwards at a point in some direction: by more than a hundredth, and
/// less than an edge, over the distance `reach` [m] of points.
template <int Dim>
bool is_round(const Solid<Dim>& solid, const Vec<Dim>& point, double reach) {
  constexpr double edge = 3;  // [rad]
  const SurfacePlace<Dim> at = on_surface(solid, point);
  const auto bends = [&](const Vec<Dim>& along) {
    const double angle = on_surface<Dim>(solid, at.x + probe * reach * along).normal.dot(along);
    return angle > least_bend * probe && angle < edge * probe;
  };
  const Vec<Dim> along = at.normal.unitOrthogonal();
  if constexpr (Dim == 3)
    if (bends(at.normal.cross(along))) return true;
  return bends(along);
}

/// Move a point on a round surface to where the surface looks along `down`, if that is not further
/// than 1.5 times `reach` [m]: by the curvature on the way there. False where it finds none.
template <int Dim>
bool move_to_extreme(const Solid<Dim>& solid, const Vec<Dim>& down, double reach, Vec<Dim>& point) {
  constexpr double close = 1e-5, furthest = 1;  // [rad] from `down`
  SurfacePlace<Dim> at = on_surface(solid, point);
  for (int k = 0; k < 4; ++k) {
    const Vec<Dim> sideways = down - down.dot(at.normal) * at.normal;
    const double angle = std::atan2(sideways.norm(), down.dot(at.normal));
    if (angle > furthest) return false;
    const Vec<Dim> along = sideways.normalized();
    const double bend =
        on_surface<Dim>(solid, at.x + probe * reach * along).normal.dot(along) / (probe * reach);
    if (angle < close || bend * reach < least_bend) {  // or flat along that way, as a roller
      point = at.x;
      return true;
    }
    if (angle > 1.5 * bend * reach) return false;
    at = on_surface<Dim>(solid, at.x + std::tan(angle) / bend * along);
  }
  return false;
}

template <int Dim>
std::vector<Vec<Dim>> directions_across(const Vec<Dim>& normal) {
  const Vec<Dim> one = normal.unitOrthogonal();
  if constexpr (Dim == 2) {
    return {one, -one};
  } else {
    std::vector<Vec<3>> all;
    const Vec<3> two = normal.cross(one);
    for (const int k : {-1, 0, 1})
      for (const int j : {-1, 0, 1})
        if (k != 0 || j != 0) all.push_back((k * one + j * two).normalized());
    return all;
  }
}

/// A point of a free body that may touch, and how deep it will be if it does not [m].
template <int Dim>
struct Candidate {
  Encounter<Dim> encounter;
  double gap_after;
  bool round;
};

/// Those of the candidates on which the others rest: of each part of the other body that is as good
/// as flat the outer ones, and the one that will be deepest.
template <int Dim>
std::vector<Encounter<Dim>> bearing(const std::vector<Candidate<Dim>>& all) {
  constexpr double flat = 0.996;  // cosine of 5 degrees
  std::vector<Encounter<Dim>> chosen;
  std::vector<char> is_sorted(all.size(), 0);
  for (std::size_t first = 0; first < all.size(); ++first) {
    if (is_sorted[first]) continue;
    const Vec<Dim> normal = all[first].encounter.normal;
    std::vector<std::size_t> part;
    for (std::size_t k = first; k < all.size(); ++k) {
      if (is_sorted[k] || all[k].encounter.normal.dot(normal) < flat) continue;
      is_sorted[k] = 1;
      part.push_back(k);
    }
    const auto largest = [&](auto value) {
      return *std::max_element(part.begin(), part.end(), [&](std::size_t j, std::size_t k) {
        return value(all[j]) < value(all[k]);
      });
    };
    std::vector<std::size_t> ends{largest([](const auto& at) { return -at.gap_after; })};
    for (const Vec<Dim>& direction : directions_across<Dim>(normal))
      ends.push_back(largest([&](const auto& at) { return at.encounter.x.dot(direction); }));
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    for (const std::size_t k : ends) chosen.push_back(all[k].encounter);
  }
  return chosen;
}

/// A free body, and another one that it may meet within dt: where they are, and where they would be
/// after that.
template <int Dim>
class Pair {
 public:
  struct Side {
    const RigidBody<Dim>& body;
    const Placement<Dim>&now, &after;
  };
  Pair(const Side& free, const Side& other, double dt) : free_(free), other_(other), dt_(dt) {}

  struct Place {
    Vec<Dim> x, normal;  ///< normal of the other body
    double gap;          ///< [m]
  };
  /// A point of the free body, as it was at the start.
  Place look(const Vec<Dim>& point) const {
    const Vec<Dim> x = free_.now.origin + free_.now.axes * (point - free_.body.centre);
    const auto near = other_.body.solid->nearest(in_other(x));
    return {x, other_.now.axes * near.normal, near.distance};
  }
  /// How far a point of the free body comes against the other one [m], if they do not touch.
  Vec<Dim> way(const Vec<Dim>& x) const {
    return dt_ * (free_.after.velocity_at(x) - other_.after.velocity_at(x));
  }
  /// From so far it may touch the other one [m].
  double reach(const Vec<Dim>& x) const {
    constexpr double spare = 2;
    const Vec<Dim> now = dt_ * (free_.now.velocity_at(x) - other_.now.velocity_at(x));
    return spare * std::max(now.norm(), way(x).norm());
  }
  /// No point within `radius` [m] of the centre may touch the other one.
  bool is_far(double radius) const {
    constexpr double spare = 4;  // both turn, twice as far as they do
    const double spin = std::max({free_.now.spin.norm(), free_.after.spin.norm(),
                                  other_.now.spin.norm(), other_.after.spin.norm()});
    const Vec<Dim> centre = free_.now.origin;
    return other_.body.solid->is_beyond(in_other(centre),
                                        radius + reach(centre) + spare * dt_ * spin * radius);
  }
  /// Move a point on a round surface to where both surfaces look at each other, on the way there no
  /// more than 1.5 times `spacing` [m] at once. False where it finds none.
  bool move_to_nearest(double spacing, Vec<Dim>& point, Place& at) const {
    constexpr int steps = 30;
    constexpr double aligned = 1e-6;  // [rad]
    for (int k = 0; k < steps; ++k) {
      const Vec<Dim> down = -(free_.now.axes.transpose() * at.normal);
      if (!move_to_extreme<Dim>(*free_.body.solid, down, spacing, point)) return false;
      const Vec<Dim> before = std::exchange(at, look(point)).normal;
      if ((at.normal - before).norm() < aligned) break;
    }
    return true;
  }

 private:
  Vec<Dim> in_other(const Vec<Dim>& x) const {
    return other_.body.centre + other_.now.axes.transpose() * (x - other_.now.origin);
  }

  Side free_, other_;
  double dt_;
};

}  // namespace

template <int Dim>
RigidCollisions<Dim>::RigidCollisions(const Model<Dim>& model) : model_(model) {
  for (const RigidBody<Dim>& body : model.rigid_bodies) {
    auto& points = points_.emplace_back();
    spacing_.push_back(0.0);
    radius_.push_back(0.0);
    if (!is_free(body)) continue;
    const auto [low, high] = body.solid->bounds();
    spacing_.back() = (high - low).maxCoeff() / cuts_of(Dim);
    for (const Vec<Dim>& x : surface_points(*body.solid, cuts_of(Dim))) {
      points.push_back({x, is_round(*body.solid, x, spacing_.back())});
      radius_.back() = std::max(radius_.back(), (x - body.centre).norm());
    }
  }
}

template <int Dim>
void RigidCollisions<Dim>::begin() {
  constexpr double touching = 1e-3;  // of the distance from its centre to the furthest point
  held_by_.assign(points_.size(), {});
  for (std::size_t k = 0; k < points_.size(); ++k)
    for (std::size_t side = 0; side < model_.sides.size() && !points_[k].empty(); ++side) {
      const RigidBody<Dim>& free = model_.rigid_bodies[k];
      const bool is_in_front = std::all_of(points_[k].begin(), points_[k].end(), [&](auto& point) {
        const Vec<Dim> x = free.centre + free.moved + free.turned * (point.x - free.centre);
        return model_.sides[side].solid->nearest(x).distance > -touching * radius_[k];
      });
      if (is_in_front) held_by_[k].push_back(points_.size() + side);
    }
}

template <int Dim>
const Placement<Dim>& RigidCollisions<Dim>::placement(const std::vector<Placement<Dim>>& of,
                                                      std::size_t k) {
  static const Placement<Dim> of_side;  // its centre is the origin
  return k < of.size() ? of[k] : of_side;
}

template <int Dim>
auto RigidCollisions<Dim>::encounters(const std::vector<Placement<Dim>>& at,
                                      const std::vector<Placement<Dim>>& after, double dt) const
    -> std::vector<Encounter<Dim>> {
  std::vector<Encounter<Dim>> all;
  for (std::size_t k = 0; k < at.size(); ++k) {
    for (std::size_t j = 0; j < at.size(); ++j)
      if (j != k && !points_[k].empty()) add_pair(k, j, at, after, dt, all);
    for (const std::size_t side : held_by_[k]) add_pair(k, side, at, after, dt, all);
  }
  return all;
}

template <int Dim>
void RigidCollisions<Dim>::add_pair(std::size_t free, std::size_t other,
                                    const std::vector<Placement<Dim>>& at,
                                    const std::vector<Placement<Dim>>& after, double dt,
                                    std::vector<Encounter<Dim>>& encounters) const {
  const double spacing = spacing_[free];
  const Pair<Dim> pair({body(free), at[free], after[free]},
                       {body(other), placement(at, other), placement(after, other)}, dt);
  if (pair.is_far(radius_[free] + spacing)) return;
  std::vector<Candidate<Dim>> all;
  std::vector<Vec<Dim>> extremes;
  for (const auto& [at_start, bends] : points_[free]) {
    auto place = pair.look(at_start);
    if (place.gap > pair.reach(place.x) + (bends ? spacing : 0.0)) continue;
    bool is_extreme = false;
    if (bends) {
      Vec<Dim> point = at_start;
      auto nearest = place;
      is_extreme = pair.move_to_nearest(spacing, point, nearest);
      if (is_extreme) {
        const auto is_here = [&](const Vec<Dim>& known) {
          return (known - point).norm() < 0.1 * spacing;
        };
        if (std::any_of(extremes.begin(), extremes.end(), is_here)) continue;
        extremes.push_back(point);
        place = nearest;
      } else if (place.gap > 0) {
        continue;  // a point beside it is nearer
      }
    }
    if (place.gap > pair.reach(place.x)) continue;
    const double gap_after = place.gap + pair.way(place.x).dot(place.normal);
    all.push_back({{free, other, place.x, place.normal, place.gap}, gap_after, is_extreme});
  }
  // Points on an edge beside a round place, as on the rim of a roller, are part of it.
  const auto is_beside_round = [&](const Candidate<Dim>& one) {
    return !one.round && std::any_of(all.begin(), all.end(), [&](const Candidate<Dim>& two) {
      return two.round && (two.encounter.x - one.encounter.x).norm() < 1.5 * spacing;
    });
  };
  std::vector<Candidate<Dim>> counting;
  std::copy_if(all.begin(), all.end(), std::back_inserter(counting),
               [&](const Candidate<Dim>& one) { return !is_beside_round(one); });
  for (const Encounter<Dim>& encounter : bearing(counting)) encounters.push_back(encounter);
}

template class RigidCollisions<2>;
template class RigidCollisions<3>;

}  // namespace lahar
