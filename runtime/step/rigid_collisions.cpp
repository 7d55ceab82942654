#include "runtime/step/rigid_collisions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include "physics/geometry/solid_samples.h"

namespace lahar {

namespace {

constexpr int cuts_of(int dim) {
  return dim == 2 ? 64 : 20;
}
/// No point of a body is too far from a side of the mesh for it.
constexpr double radius_of_sides = std::numeric_limits<double>::infinity();

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

/// A point of a body that may touch, and how deep it will be if it does not [m].
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

/// A body that is known by points on its surface, and another one that it may meet within dt: where
/// they are, and where they would be after that.
template <int Dim>
class Pair {
 public:
  struct Side {
    const RigidBody<Dim>& body;
    const Placement<Dim>&now, &after;
  };
  Pair(const Side& own, const Side& other, double dt) : own_(own), other_(other), dt_(dt) {}

  struct Place {
    Vec<Dim> x, normal;  ///< normal of the other body
    double gap;          ///< [m]
  };
  /// Where a point of the own body is now, that is `point` at the start.
  Vec<Dim> at(const Vec<Dim>& point) const {
    return own_.now.origin + own_.now.axes * (point - own_.body.centre);
  }
  Place look(const Vec<Dim>& x) const {
    const auto near = other_.body.solid->nearest(in_other(x));
    return {x, other_.now.axes * near.normal, near.distance};
  }
  /// A place that the point may touch, if it may. Where sides of the other body meet, as at the
  /// seam of two of them, the nearest one may be one that the point passes: then the one counts
  /// that is nearest a step later. The point has to be the foremost one of what is beside it: a
  /// point of a face does not run into the front of what slides on this face. Faces press what
  /// bulges, along their own normal.
  std::optional<Place> touch(const SurfacePoint<Dim>& point, const Place& here,
                             double spacing) const {
    constexpr double sideways = -0.1, steepest = 1.0 / 3, close = 0.1;
    const double thin = 0.01 * spacing;
    const Vec<Dim> w = own_.now.velocity_at(here.x) - other_.now.velocity_at(here.x);
    const bool bears = is_foremost(point.x, here.normal, spacing);
    if (bears && w.dot(here.normal) >= 0) return here;
    const Place ahead = look(here.x + dt_ * w);
    if (ahead.gap > -thin && ahead.normal.dot(here.normal) > sideways &&
        (!bears || w.dot(ahead.normal) > w.dot(here.normal)) &&
        is_foremost(point.x, ahead.normal, spacing))
      return Place{here.x, ahead.normal, ahead.gap - dt_ * w.dot(ahead.normal)};
    if (bears) return here;
    if (point.is_sharp) return {};
    const Vec<Dim> out = own_.now.axes * point.out;
    const double cosine = -out.dot(here.normal);
    if (cosine < steepest) return {};
    const double gap = here.gap / cosine;
    if (std::abs(look(here.x + gap * out).gap) > close * std::abs(gap) + thin) return {};
    return Place{here.x, -out, gap};
  }
  /// How far a point of the own body comes against the other one [m], if they do not touch.
  Vec<Dim> way(const Vec<Dim>& x) const {
    return dt_ * (own_.after.velocity_at(x) - other_.after.velocity_at(x));
  }
  /// From so far it may touch the other one [m].
  double reach(const Vec<Dim>& x) const {
    constexpr double spare = 2;
    const Vec<Dim> now = dt_ * (own_.now.velocity_at(x) - other_.now.velocity_at(x));
    return spare * std::max(now.norm(), way(x).norm());
  }
  /// No point within `radius` [m] of the centre may touch the other one.
  bool is_far(double radius) const {
    constexpr double spare = 4;  // both turn, twice as far as they do
    const double spin = std::max({own_.now.spin.norm(), own_.after.spin.norm(),
                                  other_.now.spin.norm(), other_.after.spin.norm()});
    const Vec<Dim> centre = own_.now.origin;
    return other_.body.solid->is_beyond(in_other(centre),
                                        radius + reach(centre) + spare * dt_ * spin * radius);
  }
  /// Move a point on a round surface to where both surfaces look at each other, on the way there no
  /// more than 1.5 times `spacing` [m] at once. False where it finds none.
  bool move_to_nearest(double spacing, Vec<Dim>& point, Place& place) const {
    constexpr int steps = 30;
    constexpr double aligned = 1e-6;  // [rad]
    for (int k = 0; k < steps; ++k) {
      const Vec<Dim> down = -(own_.now.axes.transpose() * place.normal);
      if (!move_to_extreme<Dim>(*own_.body.solid, down, spacing, point)) return false;
      const Vec<Dim> before = std::exchange(place, look(at(point))).normal;
      if ((place.normal - before).norm() < aligned) break;
    }
    return true;
  }

 private:
  Vec<Dim> in_other(const Vec<Dim>& x) const {
    return other_.body.centre + other_.now.axes.transpose() * (x - other_.now.origin);
  }

  /// Whether nothing of the own body beside a point, by a tenth of the `spacing` of points, is
  /// further against the other body's normal. Up to 8 degrees count as nothing.
  bool is_foremost(const Vec<Dim>& point, const Vec<Dim>& normal, double spacing) const {
    constexpr double flat = 0.14;  // tangent of 8 degrees
    const Vec<Dim> down = -(own_.now.axes.transpose() * normal);
    for (const Vec<Dim>& along : directions_across<Dim>(down))
      if (own_.body.solid->contains(point + probe * spacing * (along + flat * down))) return false;
    return true;
  }

  Side own_, other_;
  double dt_;
};

}  // namespace

template <int Dim>
RigidCollisions<Dim>::RigidCollisions(const Model<Dim>& model) : model_(model) {
  constexpr double inset = 1e-7;  // of the distance of points: an edge on an edge lies on a side
  const auto& bodies = model.rigid_bodies;
  const bool any_free = std::any_of(bodies.begin(), bodies.end(), is_free<Dim>);
  for (const RigidBody<Dim>& body : bodies) {
    auto& points = points_.emplace_back();
    spacing_.push_back(0.0);
    radius_.push_back(std::numeric_limits<double>::infinity());
    const auto [low, high] = body.solid->bounds();
    const double size = (high - low).maxCoeff();
    if (!any_free || !std::isfinite(size)) continue;
    spacing_.back() = size / cuts_of(Dim);
    radius_.back() = 0;
    for (SurfacePoint<Dim> point : surface_points(*body.solid, cuts_of(Dim))) {
      if (point.is_sharp) point.x -= inset * spacing_.back() * point.out;
      points.push_back({point, !point.is_sharp && is_round(*body.solid, point.x, spacing_.back())});
      radius_.back() = std::max(radius_.back(), (point.x - body.centre).norm());
    }
  }
}

template <int Dim>
void RigidCollisions<Dim>::begin() {
  constexpr double touching = 0.1;  // of the distance from its centre to the furthest point
  held_by_.assign(points_.size(), {});
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const RigidBody<Dim>& free = model_.rigid_bodies[k];
    for (std::size_t side = 0; side < model_.sides.size() && is_free(free); ++side) {
      const bool is_in_front = std::all_of(points_[k].begin(), points_[k].end(), [&](auto& point) {
        const Vec<Dim> x = free.centre + free.moved + free.turned * (point.at.x - free.centre);
        return model_.sides[side].solid->nearest(x).distance > -touching * radius_[k];
      });
      if (is_in_front) held_by_[k].push_back(points_.size() + side);
    }
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
      if (j != k && (is_free(body(k)) || is_free(body(j)))) add_pair(k, j, at, after, dt, all);
    for (const std::size_t side : held_by_[k]) add_pair(k, side, at, after, dt, all);
  }
  return all;
}

/// Whether a body that is not free holds the place of another one on a side of the mesh, too.
template <int Dim>
bool RigidCollisions<Dim>::is_covered(std::size_t own, const Vec<Dim>& x, double gap,
                                      const std::vector<Placement<Dim>>& at) const {
  constexpr double close = 1e-6;  // of the distance of points
  for (std::size_t j = 0; j < at.size(); ++j) {
    if (j == own || is_free(body(j))) continue;
    const Pair<Dim> pair({body(own), at[own], at[own]}, {body(j), at[j], at[j]}, 0);
    if (pair.look(x).gap <= gap + close * spacing_[own]) return true;
  }
  return false;
}

template <int Dim>
void RigidCollisions<Dim>::add_pair(std::size_t own, std::size_t other,
                                    const std::vector<Placement<Dim>>& at,
                                    const std::vector<Placement<Dim>>& after, double dt,
                                    std::vector<Encounter<Dim>>& encounters) const {
  if (points_[own].empty()) return;
  const double spacing = spacing_[own];
  const Pair<Dim> pair({body(own), at[own], after[own]},
                       {body(other), placement(at, other), placement(after, other)}, dt);
  if (pair.is_far(radius_[own] + spacing)) return;
  const Vec<Dim> centre = placement(at, other).origin;
  const double most = (other < radius_.size() ? radius_[other] : radius_of_sides) + spacing;
  std::vector<Candidate<Dim>> all;
  std::vector<Vec<Dim>> extremes;
  for (const auto& [point, bends] : points_[own]) {
    const Vec<Dim> x = pair.at(point.x);
    const double near = pair.reach(x) + (bends ? spacing : 0.0);
    if ((x - centre).norm() > most + near) continue;
    std::optional<typename Pair<Dim>::Place> place = pair.look(x);
    if (place->gap > near) continue;
    bool is_extreme = false;
    if (bends) {
      Vec<Dim> extreme = point.x;
      auto nearest = *place;
      is_extreme = pair.move_to_nearest(spacing, extreme, nearest);
      if (is_extreme) {
        const auto is_here = [&](const Vec<Dim>& known) {
          return (known - extreme).norm() < 0.1 * spacing;
        };
        if (std::any_of(extremes.begin(), extremes.end(), is_here)) continue;
        extremes.push_back(extreme);
        place = nearest;
      } else if (place->gap > 0) {
        continue;  // a point beside it is nearer
      }
    }
    if (place->gap > pair.reach(place->x)) continue;
    if (!is_extreme) place = pair.touch(point, *place, spacing);
    if (!place || (other >= at.size() && is_covered(own, place->x, place->gap, at))) continue;
    const double gap_after = place->gap + pair.way(place->x).dot(place->normal);
    all.push_back({{own, other, place->x, place->normal, place->gap}, gap_after, is_extreme});
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
