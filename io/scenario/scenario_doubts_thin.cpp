// Warnings of rigid bodies so thin that material on both of their sides shares nodes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "io/scenario/in_space.h"
#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

constexpr std::size_t most_samples = 10'000;  ///< particles of a member that are looked at first

/// How thick a body may be for material on both of its sides to share nodes [cells].
double shared_thickness(ShapeFunctions functions) {
  switch (functions) {
    case ShapeFunctions::quadratic_spline:
      return 3;
    case ShapeFunctions::cubic_spline:
      return 4;
    default:
      return 1;
  }
}

/// A particle beside a body.
template <int Dim>
struct Beside {
  double distance;   ///< [m] to the surface
  double thickness;  ///< [m] of the body behind it
  Vec<Dim> normal;
};

/// Nothing where the body is thicker than `most` [m], or x is further away than that.
template <int Dim>
std::optional<Beside<Dim>> thickness_behind(const Solid<Dim>& solid, const Vec<Dim>& x, double most,
                                            double cell) {
  constexpr double part = 0.1, surface = 0.02;  // of a cell; distances may be those of tangents
  constexpr int halvings = 8;
  if (solid.is_beyond(x, most)) return {};
  const auto nearest = solid.nearest(x);
  if (!(nearest.distance >= 0) || nearest.distance >= most) return {};
  const auto is_inside = [&](double t) {
    return solid.contains(x - (nearest.distance + t) * nearest.normal);
  };
  double inside = surface * cell, outside = inside;
  if (!is_inside(inside)) return {};  // a plane beyond the edge where it ends
  do {
    outside += part * cell;
    if (outside > most) return {};
    if (is_inside(outside)) inside = outside;
  } while (inside == outside);
  for (int k = 0; k < halvings; ++k) {
    const double middle = 0.5 * (inside + outside);
    (is_inside(middle) ? inside : outside) = middle;
  }
  return Beside<Dim>{nearest.distance, inside, nearest.normal};
}

/// What lies in a cell beside a body, seen along one direction.
struct Side {
  Index cell = -1;
  int body = -1, contact = 0;  ///< rigid body; body in contact that the particle is of
  double distance = 0;         ///< [m] the least
  std::array<double, 3> normal{};
  /// Cosine of the angle between normals.
  double along(const std::array<double, 3>& other) const {
    return normal[0] * other[0] + normal[1] * other[1] + normal[2] * other[2];
  }
};

/// Sides of one cell, as far as there is room.
struct SidesOfCell {
  std::array<Side, 4> sides;
};

/// Keeps one side for each cell, bodies and direction.
void merge_sides(std::vector<Side>& sides) {
  const auto key = [](const Side& s) { return std::array<Index, 3>{s.cell, s.body, s.contact}; };
  std::stable_sort(sides.begin(), sides.end(),
                   [&](const Side& a, const Side& b) { return key(a) < key(b); });
  std::vector<Side> kept;
  std::size_t first = 0;  // of those with this key
  for (const Side& side : sides) {
    if (kept.empty() || key(kept.back()) != key(side)) first = kept.size();
    const auto same = std::find_if(kept.begin() + static_cast<std::ptrdiff_t>(first), kept.end(),
                                   [&](const Side& other) { return other.along(side.normal) > 0; });
    if (same == kept.end())
      kept.push_back(side);
    else
      same->distance = std::min(same->distance, side.distance);
  }
  sides = std::move(kept);
}

/// What of thickness counts, and how far from a body particles are looked at [m].
struct ThinLimits {
  double cell, thickness, reach;
};

/// A particle beside a body, with less of it behind than ThinLimits::thickness.
template <int Dim>
struct NearParticle {
  std::size_t particle;
  int body;
  Beside<Dim> at;
};

template <int Dim>
std::vector<NearParticle<Dim>> particles_beside(const Model<Dim>& model, std::size_t body,
                                                const ThinLimits& limits, std::size_t stride = 1) {
  std::vector<NearParticle<Dim>> near;
  const Solid<Dim>& solid = *model.rigid_bodies[body].solid;
  for (std::size_t i = 0; i < model.particles.x.size(); i += stride)
    if (const auto at = thickness_behind(solid, model.particles.x[i], limits.reach, limits.cell);
        at && at->thickness < limits.thickness)
      near.push_back({i, static_cast<int>(body), *at});
  return near;
}

/// Of bodies that are thin beside some particle, all particles beside them. Collective.
template <int Dim>
std::vector<NearParticle<Dim>> particles_beside_thin(const Model<Dim>& model,
                                                     const ThinLimits& limits, const Team& team) {
  const std::size_t n = model.rigid_bodies.size();
  const std::size_t stride = 1 + model.particles.x.size() / most_samples;
  std::vector<double> thin(n);
  for (std::size_t k = 0; k < n; ++k)
    thin[k] = particles_beside(model, k, limits, stride).empty() ? 0 : 1;
  thin = team.most(std::move(thin));
  std::vector<NearParticle<Dim>> all;
  for (std::size_t k = 0; k < n; ++k) {
    if (thin[k] == 0) continue;
    const auto near = particles_beside(model, k, limits);
    all.insert(all.end(), near.begin(), near.end());
  }
  return all;
}

/// What is found of one body.
struct ThinPlace {
  Index beside = 0, shared = 0;  ///< particles that touch it; that share nodes with the other side
  double thickness = 0;          ///< [m] sum behind these
  std::array<double, 3> place{};
  bool fluid = true;  ///< all of these are
  void add(const ThinPlace& other) {
    if (shared == 0) place = other.place;
    beside += other.beside;
    shared += other.shared;
    thickness += other.thickness;
    fluid = fluid && other.fluid;
  }
};

std::size_t place_in(const std::vector<Index>& sorted, Index value) {
  return static_cast<std::size_t>(std::lower_bound(sorted.begin(), sorted.end(), value) -
                                  sorted.begin());
}

/// What of particles beside thin bodies has material on the other side, by body. Collective.
template <int Dim>
std::vector<ThinPlace> thin_places(const std::vector<NearParticle<Dim>>& near,
                                   const Model<Dim>& model, const Mesh<Dim>& mesh,
                                   const ThinLimits& limits, const Team& team) {
  constexpr double opposite = -0.5;  // cosine between normals of both sides, at most
  const auto& p = model.particles;
  const auto contact_of = [&](std::size_t i) { return model.materials[p.material[i]].body; };
  const auto keeper = [&](Index cell) { return team.member(cell, mesh.n_cells()); };
  std::vector<Side> sides;
  for (const auto& [i, body, at] : near)
    sides.push_back({p.cell[i], body, contact_of(i), at.distance, in_space<Dim>(at.normal)});
  merge_sides(sides);
  std::vector<std::vector<Side>> to(static_cast<std::size_t>(team.size()));
  for (const Side& side : sides) to[static_cast<std::size_t>(keeper(side.cell))].push_back(side);
  sides = joined(team.exchange(std::move(to)));
  merge_sides(sides);
  // Cells on the other side, a quarter, three quarters, ... of a cell behind the body.
  std::vector<Index> cells;
  std::vector<std::size_t> ends;  // in `cells`, by near particle
  for (const auto& [i, body, at] : near) {
    for (double s = 0.25 * limits.cell; at.distance + at.thickness + s < limits.reach;
         s += 0.5 * limits.cell) {
      const Index there = mesh.locate(p.x[i] - (at.distance + at.thickness + s) * at.normal).cell;
      if (there >= 0) cells.push_back(there);
    }
    ends.push_back(cells.size());
  }
  std::vector<Index> asked = cells;
  sort_unique(asked);
  const auto answers = ask<SidesOfCell>(team, asked, keeper, [&](Index cell) {
    SidesOfCell answer;
    auto from = std::lower_bound(sides.begin(), sides.end(), cell,
                                 [](const Side& side, Index key) { return side.cell < key; });
    for (Side& side : answer.sides)
      if (from != sides.end() && from->cell == cell) side = *from++;
    return answer;
  });
  std::vector<ThinPlace> own(model.rigid_bodies.size());
  for (std::size_t k = 0, c = 0; k < near.size(); ++k) {
    const auto& [i, body, at] = near[k];
    ThinPlace place{.beside = 1, .place = in_space<Dim>(p.x[i])};
    const auto normal = in_space<Dim>(at.normal);
    for (; c < ends[k]; ++c)
      for (const Side& side : answers[place_in(asked, cells[c])].sides)
        if (side.body == body && side.contact == contact_of(i) && side.along(normal) < opposite &&
            at.distance + at.thickness + side.distance < limits.reach)
          place.shared = 1;
    if (place.shared > 0) {
      place.thickness = at.thickness;
      place.fluid = has_pressure(model.materials[p.material[i]].law);
    }
    own[static_cast<std::size_t>(body)].add(place);
  }
  std::vector<ThinPlace> all(own.size());
  for (const auto& part : team.gather(own))
    for (std::size_t k = 0; k < all.size(); ++k) all[k].add(part[k]);
  return all;
}

}  // namespace

// A node has one velocity for all particles around it, on whichever side of a body they lie.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_thin_bodies() {
  constexpr double least = 0.02;  // of the particles beside a body; fewer lie at its edges
  const auto& bodies = model_.rigid_bodies;
  if (bodies.empty() || in_.cbgeo_defaults || !in_.stage.empty() || !mesh_->is_structured()) return;
  const double cell = outer_cell().maxCoeff();
  const double most = shared_thickness(model_.analysis.functions);
  // Splines are zero beyond. Others hardly reach past a body of a cell and a particle beside it.
  const ThinLimits limits{cell, 0.99 * most * cell, std::max(most, 1.6) * cell};
  const auto near = particles_beside_thin(model_, limits, team_);
  if (!team_.any(!near.empty())) return;
  const std::vector<ThinPlace> places = thin_places(near, model_, *mesh_, limits, team_);
  const auto entries = get_list(root_, "rigid_bodies");
  for (std::size_t k = 0; k < std::min(places.size(), entries.size()); ++k) {
    const ThinPlace& at = places[k];
    if (static_cast<double>(at.shared) <= least * static_cast<double>(at.beside)) continue;
    const double thickness = at.thickness / static_cast<double>(at.shared);
    in_.warning(
        *entries[k],
        fmt::format("the rigid body '{}' is {:.2g} cells thick where material lies on both of its "
                    "sides, as at ({:.6g}): both sides share velocities of nodes, so that each "
                    "drags the other along",
                    bodies[k].name, thickness / cell,
                    fmt::join(std::span(at.place).first(Dim), ", ")),
        fmt::format("take cells of at most {:.2g} m{}", thickness / most,
                    at.fluid ? ""
                             : "; or give one side velocities of its own: \"interface\": true and "
                               "\"contact\": {\"bodies\": [{\"pset\": ...}]} in analysis"));
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
