// Warnings of gravity that points elsewhere than the supports, the terrain or the strength say, and
// of gauges that measure nothing.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

/// The axis of the largest component of gravity, if it is nearly all of it; -1 otherwise.
template <int Dim>
int upright_axis(const Vec<Dim>& gravity) {
  constexpr double upright = 0.9;  // cosine between gravity and an axis, at least
  int axis = 0;
  const double most = gravity.cwiseAbs().maxCoeff(&axis);
  return most > upright * gravity.norm() ? axis : -1;
}

/// Whether a body may lie over what is between two corners. Terrain does not, nor a wall beside.
template <int Dim>
bool may_hold_from_above(const Solid<Dim>& body, const Vec<Dim>& foot, const Vec<Dim>& top) {
  constexpr int up = Dim - 1;
  const auto [low, high] = body.bounds();
  if (!std::isfinite(high[up])) {
    constexpr double far = 100;  // sizes
    Vec<Dim> over = 0.5 * (foot + top);
    over[up] += far * (top - foot).norm();
    return body.nearest(over).distance < 0;
  }
  if (!std::isfinite(low[up]) || high[up] <= top[up]) return false;
  for (int d = 0; d < up; ++d)
    if (low[d] > top[d] || high[d] < foot[d]) return false;
  return true;
}

template <int Dim>
std::string text_of_vector(const Vec<Dim>& x) {
  std::string text;
  for (int d = 0; d < Dim; ++d) text += fmt::format("{}{:g}", d > 0 ? ", " : "", x[d] + 0.0);
  return "[" + text + "]";
}

}  // namespace

// Up, along +y or +z, where all that holds the material lies at its foot or below.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_gravity_upward() {
  const JsonValue* given = section("external_loading_conditions").find("gravity");
  if (!given || model_.gravity.norm() == 0 || rows_.total() == 0) return;
  warn_of_gravity_across(*given);
  constexpr int up = Dim - 1;
  if (upright_axis(model_.gravity) != up || model_.gravity[up] < 0) return;
  if (team_.any(!model_.node_frames.empty())) return;
  std::vector<Index> nodes;
  for_each_condition([&]<class T>() {
    for (const T& entry : entries_of<T>(model_))
      if (ActsOnNode<T> || place_of(entry).second == up) nodes.push_back(entry.node);
  });
  const bool driven =
      std::any_of(model_.particle_velocities.begin(), model_.particle_velocities.end(),
                  [](const auto& v) { return v.dir == up; });
  if (team_.any(driven || !model_.tractions.empty())) return;
  double highest = -infinity;  // of supports
  for (const Vec<Dim>& x : places_of(nodes)) highest = std::max(highest, x[up]);
  std::vector<double> most(2 * Dim, -infinity);  // of particles: minus the least, and the largest
  for (const Vec<Dim>& x : model_.particles.x)
    for (int d = 0; d < Dim; ++d) {
      const auto k = static_cast<std::size_t>(d);
      most[k] = std::max(most[k], -x[d]);
      most[Dim + k] = std::max(most[Dim + k], x[d]);
    }
  most.push_back(highest);
  most = team_.most(std::move(most));
  highest = most.back();
  Vec<Dim> foot, top;
  for (int d = 0; d < Dim; ++d) {
    foot[d] = -most[static_cast<std::size_t>(d)];
    top[d] = most[static_cast<std::size_t>(Dim + d)];
  }
  const auto& bodies = model_.rigid_bodies;
  const bool other = std::any_of(bodies.begin(), bodies.end(), [&](const RigidBody<Dim>& body) {
    return may_hold_from_above(*body.solid, foot, top);
  });
  const bool held = highest > -infinity || !bodies.empty();
  if (!held || other || highest > foot[up] + outer_cell()[up]) return;
  Vec<Dim> down = model_.gravity;
  down[up] = -down[up];
  in_.warning(*given,
              fmt::format("gravity points up, along +{}, and all that holds the material is below "
                          "it",
                          "xyz"[up]),
              fmt::format("is {} meant?", text_of_vector<Dim>(down)));
}

// Heights of surfaces are along y in two dimensions, along z in three.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_gravity_across(const JsonValue& given) {
  constexpr int up = Dim - 1;
  const int axis = upright_axis(model_.gravity);
  const auto surface = std::find_if(geometry_.begin(), geometry_.end(),
                                    [](const auto& one) { return one.second.surface != nullptr; });
  if (axis < 0 || axis == up || surface == geometry_.end()) return;
  Vec<Dim> down = Vec<Dim>::Zero();
  down[up] = -model_.gravity.norm();
  in_.warning(given,
              fmt::format("gravity is along {}, but the heights of the surface '{}' are along {}",
                          "xyz"[axis], surface -> first, "xyz"[up]),
              fmt::format("is {} meant?", text_of_vector<Dim>(down)));
}

// Some kPa hold a slope, some Pa do not. Less than 2 Pa are there to keep particles together. Yield
// stresses of clay are some kPa, too.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_small_strength() {
  constexpr double least = 2, most = 100;  // [Pa] as kPa: silt to hard clay
  constexpr double share = 0.01;           // of rho g H: more than that has an effect
  const double g = model_.gravity.norm();
  if (g == 0 || rows_.total() == 0) return;
  const Vec<Dim> down = model_.gravity / g;
  double low = infinity, high = -infinity;
  for (const Vec<Dim>& x : model_.particles.x) {
    low = std::min(low, x.dot(down));
    high = std::max(high, x.dot(down));
  }
  const auto ends = team_.most(std::vector<double>{-low, high});
  const auto materials = get_list(root_, "materials");
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const bool rubs = materials[m]->find("friction");
    const char* key = rubs ? "cohesion" : "yield_stress";
    const auto strength = get_number(*materials[m], key);
    if (!strength || *strength < least || *strength > most) continue;
    const double weight = model_.materials[m].density * g * (ends[0] + ends[1]);
    if (*strength > share * weight) continue;
    in_.warning(
        *materials[m]->find(key),
        fmt::format("is the {} of '{}' meant in kPa? {:g} Pa bear nothing beside rho g H = {:.3g} "
                    "Pa",
                    rubs ? "cohesion" : "yield stress", model_.materials[m].name, *strength,
                    weight),
        fmt::format("stresses are in Pa: {:g} kPa are {:g}{}", *strength, 1e3 * *strength,
                    rubs ? ". If it only keeps grains together, 1 Pa does so, too" : ""));
  }
}

// Sides of the box around the mesh at which material lies that may flow, and no node is held.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_open_sides() {
  if (in_.cbgeo_defaults || model_.gravity.norm() == 0 || rows_.total() == 0) return;
  if (!model_.rigid_bodies.empty() || team_.any(!model_.node_frames.empty())) return;
  if (model_.analysis.all_may_leave()) return;
  constexpr double near = 0.75;  // cells to the outermost particles that touch a side, at most
  const auto [low, high] = mesh_->bounds();
  const Vec<Dim> cell = outer_cell();
  const auto distance = [&, low = low, high = high](const Vec<Dim>& x, std::size_t side) {
    const auto d = static_cast<Eigen::Index>(side / 2);
    return side % 2 == 0 ? x[d] - low[d] : high[d] - x[d];
  };
  std::vector<double> touched(2 * Dim, 0.0), held(2 * Dim, 0.0);
  for (std::size_t p = 0; p < model_.particles.x.size(); ++p) {
    if (is_elastic(model_.materials[model_.particles.material[p]].law)) continue;
    for (std::size_t side = 0; side < touched.size(); ++side)
      if (distance(model_.particles.x[p], side) < near * cell[static_cast<int>(side / 2)])
        touched[side] = 1.0;
  }
  std::vector<Index> nodes;
  std::vector<int> axes;  // -1: all
  for_each_condition([&]<class T>() {
    for (const T& entry : entries_of<T>(model_)) {
      nodes.push_back(entry.node);
      axes.push_back(ActsOnNode<T> ? -1 : place_of(entry).second);
    }
  });
  const std::vector<Vec<Dim>> places = places_of(nodes);
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t side = 0; side < held.size(); ++side) {
      const int axis = static_cast<int>(side / 2);
      if ((axes[i] < 0 || axes[i] == axis) && distance(places[i], side) < 0.5 * cell[axis])
        held[side] = 1.0;
    }
  if (model_.analysis.plane == Plane::axisymmetric) held[0] = 1.0;  // of the axis
  touched = team_.most(std::move(touched));
  held = team_.most(std::move(held));
  for (std::size_t side = 0; side < held.size(); ++side) {
    const int axis = static_cast<int>(side / 2);
    if (touched[side] == 0.0 || held[side] > 0.0) continue;
    if (model_.gravity[axis] * (side % 2 == 0 ? -1.0 : 1.0) < 0) continue;  // the top
    in_.warning(section("mesh"),
                fmt::format("material touches the side {} = {:g} of the mesh, where no node is "
                            "held along {}: what moves out of the mesh ends the run",
                            "xyz"[axis], side % 2 == 0 ? low[axis] : high[axis], "xyz"[axis]),
                "hold the nodes of that side with a velocity constraint or a wall, or let the mesh "
                "reach further than the material");
  }
}

// Whole lines and sections may begin outside, but what is there has no rows but zeros.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_distant_gauges() {
  const auto [low, high] = mesh_->bounds();
  const auto entries = get_list(section("post_processing"), "gauges");
  const auto& gauges = model_.output.measured.gauges;
  for (std::size_t k = 0; k < std::min(entries.size(), gauges.size()); ++k) {
    const int axes = gauges[k].kind == Gauge::Kind::columns ? Dim - 1 : Dim;
    const auto is_outside = [&, low = low, high = high](const auto& x) {
      bool outside = false;
      for (int d = 0; d < axes; ++d) {
        const double at = x[static_cast<std::size_t>(d)];
        outside |= at < low[d] - region_tolerance_ || at > high[d] + region_tolerance_;
      }
      return outside;
    };
    if (gauges[k].kind == Gauge::Kind::plane) {
      double least = infinity, most = -infinity;  // of the mesh's corners, along the normal
      for (int corner = 0; corner < 1 << Dim; ++corner) {
        double at = 0;
        for (int d = 0; d < Dim; ++d)
          at += gauges[k].direction[static_cast<std::size_t>(d)] *
                ((corner >> d & 1 ? high : low)[d] - gauges[k].origin[static_cast<std::size_t>(d)]);
        least = std::min(least, at);
        most = std::max(most, at);
      }
      if (least > 0 || most < 0)
        in_.warning(*entries[k],
                    fmt::format("the plane of the gauge '{}' does not meet the mesh: nothing "
                                "passes it",
                                gauges[k].name),
                    mesh_extent(Dim));
      continue;
    }
    const auto& places = gauges[k].places;
    const auto lost = std::count_if(places.begin(), places.end(), is_outside);
    if (lost == 0) continue;
    const JsonValue* at = entries[k]->find("at");
    if (!at) at = entries[k]->find(is_outside(places.front()) ? "from" : "to");
    const std::string which = places.size() == 1
                                  ? std::string("the place")
                                  : fmt::format("{} of the {} places", lost, places.size());
    in_.warning(
        at ? *at : *entries[k],
        fmt::format("{} of the gauge '{}' {} outside of the mesh, where nothing is measured", which,
                    gauges[k].name, lost == 1 ? "lies" : "lie"),
        mesh_extent(axes));
  }
}

namespace {

/// Whether a body outside of the mesh may come into it by its own velocity, or by gravity.
template <int Dim>
bool may_come(const RigidBody<Dim>& body, const Vec<Dim>& gravity,
              const std::pair<Vec<Dim>, Vec<Dim>>& mesh) {
  using Motion = typename RigidBody<Dim>::Motion;
  if (body.motion == Motion::fixed) return false;
  if (body.motion == Motion::prescribed && (body.function >= 0 || !body.spin.isZero(0)))
    return true;  // by a way that is not straight
  const auto [low, high] = body.solid->bounds();
  for (int d = 0; d < Dim; ++d) {
    const double side = low[d] > mesh.second[d] ? 1 : high[d] < mesh.first[d] ? -1 : 0;
    const double pull = body.motion == Motion::free && body.held[d] == 0 ? gravity[d] : 0.0;
    if (side * body.velocity[d] >= 0 && side * pull >= 0 && side != 0) return false;
  }
  return true;
}

}  // namespace

// A body touches particles, and these are in the mesh.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_distant_bodies() {
  const auto mesh = mesh_->bounds();
  const auto entries = get_list(root_, "rigid_bodies");
  const auto& bodies = model_.rigid_bodies;
  for (std::size_t k = 0; k < std::min(entries.size(), bodies.size()); ++k) {
    const auto [low, high] = bodies[k].solid->bounds();
    const bool apart =
        (low.array() > mesh.second.array()).any() || (high.array() < mesh.first.array()).any();
    const bool moves = bodies[k].motion != RigidBody<Dim>::Motion::fixed;
    if (!apart || may_come<Dim>(bodies[k], model_.gravity, mesh)) continue;
    if (moves && !in_.stage.empty()) continue;  // it is where the stage before brought it
    in_.warning(
        *entries[k],
        fmt::format("the rigid body '{}' lies outside of the mesh, where it touches nothing{}",
                    bodies[k].name,
                    moves ? ", and neither its velocity nor gravity brings it in" : ""),
        mesh_extent(Dim));
  }
}

// A body that passes more than a particle in a step pushes it out of its middle, or jumps over it.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_fast_bodies() {
  constexpr double most = 0.5;  // cells in a step: the distance of particles
  const auto moves = [](const RigidBody<Dim>& body) {
    return body.motion != RigidBody<Dim>::Motion::fixed;
  };
  if (std::ranges::none_of(model_.rigid_bodies, moves) || is_implicit(model_.analysis) ||
      rows_.total() == 0)
    return;
  const auto entries = get_list(root_, "rigid_bodies");
  const double dt = first_step(), cell = outer_cell().minCoeff();
  if (!std::isfinite(dt)) return;
  for (std::size_t k = 0; k < std::min(entries.size(), model_.rigid_bodies.size()); ++k) {
    const RigidBody<Dim>& body = model_.rigid_bodies[k];
    if (!moves(body)) continue;
    double factor = 1;
    if (body.function >= 0)
      factor = model_.functions[static_cast<std::size_t>(body.function)].largest();
    const auto [low, high] = body.solid->bounds();
    double arm = 0;  // of its farthest corner from the centre
    if (!body.spin.isZero(0) && low.allFinite() && high.allFinite())
      arm = (high - body.centre).cwiseAbs().cwiseMax((low - body.centre).cwiseAbs()).norm();
    const double speed = factor * (body.velocity.norm() + body.spin.norm() * arm);
    if (!(speed * dt > most * cell)) continue;
    const JsonValue* velocity = entries[k]->find("velocity");
    in_.warning(velocity ? *velocity : *entries[k],
                fmt::format("the rigid body '{}' moves at up to {:.4g} m/s, by {:.2g} cells in a "
                            "step of {:.3g} s: it jumps over particles, and pushes others out of "
                            "its middle. No limit of the step takes the speed of bodies",
                            body.name, speed, speed * dt / cell, dt),
                fmt::format("is it in m/s? Else take steps of at most {:.2g} s: \"dt\" in analysis "
                            "bounds adaptive ones, too",
                            most * cell / speed));
  }
}

// A node without a constraint bears no force.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_idle_gauges() {
  const auto entries = get_list(section("post_processing"), "gauges");
  const auto& gauges = model_.output.measured.gauges;
  const auto is_force = [](const Gauge& gauge) {
    return gauge.kind == Gauge::Kind::force && gauge.body < 0;
  };
  if (in_.cbgeo_defaults || std::none_of(gauges.begin(), gauges.end(), is_force)) return;
  std::vector<Index> held;
  for_each_condition([&]<class T>() {
    if constexpr (!std::is_same_v<T, NodeForce> && !std::is_same_v<T, NodePressure>)
      for (const T& entry : entries_of<T>(model_)) held.push_back(entry.node);
  });
  sort_unique(held);
  for (std::size_t k = 0; k < std::min(entries.size(), gauges.size()); ++k) {
    if (!is_force(gauges[k])) continue;
    const bool any = std::any_of(gauges[k].ids.begin(), gauges[k].ids.end(), [&](Index node) {
      return std::binary_search(held.begin(), held.end(), node);
    });
    if (team_.any(any)) continue;
    const JsonValue* set = entries[k]->find("nset");
    in_.warning(
        set ? *set : *entries[k],
        fmt::format("nothing holds a node of the gauge '{}': its force stays zero", gauges[k].name),
        "a gauge of forces measures what material presses on nodes with a constraint or a "
        "wall; 'plane' and 'points' measure inside of the material");
  }
}

// Nothing sets the material in motion.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_no_load() {
  const Model<Dim>& m = model_;
  // A stage begins with the motion of the one before.
  if (in_.cbgeo_defaults || rows_.total() == 0 || !in_.stage.empty()) return;
  const auto& held = entries_of<NodeVelocity>(m);
  bool acts =
      m.gravity.norm() > 0 || !m.tractions.empty() || !m.particle_velocities.empty() ||
      !m.injections.empty() || !m.liquid_velocities.empty() || !entries_of<NodeForce>(m).empty() ||
      !entries_of<NodeAcceleration>(m).empty() || !entries_of<NodeDisplacement>(m).empty() ||
      !entries_of<NodePressure>(m).empty() ||
      std::any_of(held.begin(), held.end(), [](const NodeVelocity& v) { return v.velocity != 0; });
  acts |= !m.particles.stress.empty() || !m.particles.pore_pressure.empty() ||
          !m.particles.displacement.empty() ||
          std::any_of(m.particles.velocity.begin(), m.particles.velocity.end(),
                      [](const Vec<Dim>& v) { return !v.isZero(0.0); });
  acts |= std::any_of(m.rigid_bodies.begin(), m.rigid_bodies.end(), [](const RigidBody<Dim>& b) {
    return b.motion != RigidBody<Dim>::Motion::fixed;
  });
  if (team_.any(acts)) return;
  in_.warning(root_, "nothing acts on the material: it stays as it is",
              "give \"external_loading_conditions\": {\"gravity\": [...]}, a load, or an initial "
              "'velocity'");
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
