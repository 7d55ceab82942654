// Rigid bodies: their shapes, motion, and where they must not be.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

#include "io/base/text.h"
#include "io/scenario/scenario_builder.h"
#include "physics/geometry/solid_samples.h"
#include "physics/model/body_overlap.h"
#include "physics/model/contact_rows.h"
#include "physics/model/transfer_options.h"

namespace lahar {

namespace {

/// Boxes along the longest edge that give the mass of a free body.
constexpr int mass_cuts(int dim) {
  return dim == 2 ? 400 : 100;
}

/// The same for the centre of a body that no force moves: no motion depends on it.
constexpr int centre_cuts(int dim) {
  return dim == 2 ? 200 : 40;
}

template <int Dim>
bool has_end(const Solid<Dim>& solid) {
  const auto [low, high] = solid.bounds();
  return low.allFinite() && high.allFinite();
}

/// What no body has: a moment that is not above 0, or is above the sum of the other two. (They are
/// sums of squares of distances from axes.) Empty: nothing.
std::string fault_of(const Eigen::Matrix3d& inertia) {
  constexpr double rounding = 1e-6;
  const Eigen::Vector3d m = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia).eigenvalues();
  const std::string moments = fmt::format("{:.4g}, {:.4g} and {:.4g}", m[0], m[1], m[2]);
  if (!(m[0] > 0))
    return fmt::format("the principal moments of 'inertia', {}, must be above 0", moments);
  if (m[2] > (1 + rounding) * (m[0] + m[1]))
    return fmt::format(
        "no body has the principal moments {} of 'inertia': each is at most the sum of the others",
        moments);
  return "";
}

/// Moments about the centre, along the axes of the start.
void read_inertia(const JsonValue& entry, const JsonValue& given, ScenarioInput& in,
                  RigidBody<3>& body) {
  const std::vector<double> m = get_numbers(entry, "inertia");
  if (m.size() != 3 && m.size() != 6)
    return in.error(given,
                    fmt::format("'inertia' has 3 or 6 numbers in three dimensions, found {}",
                                given.is_number() ? 1 : m.size()),
                    "xx, yy, zz, or these and xy, yz, xz");
  Eigen::Matrix3d& I = body.inertia;
  I.setZero();
  I.diagonal() << m[0], m[1], m[2];
  if (m.size() == 6) {
    I(0, 1) = I(1, 0) = m[3];
    I(1, 2) = I(2, 1) = m[4];
    I(0, 2) = I(2, 0) = m[5];
  }
  if (const std::string fault = fault_of(I); !fault.empty())
    in.error(given, fault, "a component xy is minus the integral of density times x y");
}
void read_inertia(const JsonValue& entry, const JsonValue& given, ScenarioInput& in,
                  RigidBody<2>& body) {
  const auto moment = get_number(entry, "inertia");
  if (!moment) return in.error(given, "'inertia' is a number in two dimensions");
  if (!(*moment > 0))
    in.error(given, fmt::format("'inertia' must be above 0, found {:g}", *moment));
  body.inertia(2, 2) = *moment;
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::build_rigid_bodies() {
  for (const JsonValue* entry : get_list(root_, "rigid_bodies")) {
    RigidBody<Dim> body;
    body.name = get_text(*entry, "name").value_or(std::to_string(model_.rigid_bodies.size()));
    const auto is_same = [&](const RigidBody<Dim>& other) { return other.name == body.name; };
    if (std::ranges::any_of(model_.rigid_bodies, is_same)) {
      const JsonValue* name = entry->find("name");
      in_.error(name ? *name : *entry,
                fmt::format("two rigid bodies are named {}", json_quoted(body.name)),
                "a body without a name has its number");
    }
    const JsonValue* region = entry->find("region");
    if (region) {
      const Region<Dim> read = region_of(*region);
      body.solid = read.solid();
      if (!body.solid && read.known())
        in_.error(*region, "a rigid body needs a region that has a surface",
                  "\"all\" and a box without corners have none");
    }
    read_rubbing(*entry, body);
    read_motion(*entry, body);
    if (model_.analysis.plane == Plane::axisymmetric) turn_around_axis(*entry, body);
    if (!body.solid) continue;
    if (body.motion == RigidBody<Dim>::Motion::free)
      weigh(*entry, body);
    else if (!entry->find("centre") && has_end(*body.solid))
      body.centre = centre_of(moments_of(*body.solid, centre_cuts(Dim)));
    model_.rigid_bodies.push_back(std::move(body));
  }
  auto& a = model_.analysis;
  a.rigid_bodies = !model_.rigid_bodies.empty();
  a.free_bodies =
      std::any_of(model_.rigid_bodies.begin(), model_.rigid_bodies.end(),
                  [](const auto& b) { return b.motion == RigidBody<Dim>::Motion::free; });
}

template <int Dim>
void ScenarioBuilder<Dim>::read_rubbing(const JsonValue& entry, RigidBody<Dim>& body) {
  body.cohesion = get_number(entry, "cohesion").value_or(0);
  body.restitution = get_number(entry, "restitution").value_or(0);
  const JsonValue* friction = entry.find("friction");
  if (!friction) return;
  if (friction->is<std::string>()) {
    if (friction->as<std::string>() == "rough")
      body.friction = std::numeric_limits<double>::infinity();
    else
      in_.error(*friction, fmt::format("'friction' must be a coefficient or \"rough\", found {}",
                                       to_json(*friction)));
  } else if (body.friction = friction->number(); body.friction < 0) {
    in_.error(*friction,
              fmt::format("'friction' must be at least 0, found {}", to_json(*friction)));
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::read_motion(const JsonValue& entry, RigidBody<Dim>& body) {
  using Motion = typename RigidBody<Dim>::Motion;
  const JsonValue *velocity = entry.find("velocity"), *spin = entry.find("spin"),
                  *density = entry.find("density"), *mass = entry.find("mass");
  body.velocity = get_vector<Dim>(entry, "velocity").value_or(Vec<Dim>::Zero());
  body.centre = get_vector<Dim>(entry, "centre").value_or(Vec<Dim>::Zero());
  if (spin && spin->valid()) {
    if (spin->is_number() == (Dim == 2)) {
      if constexpr (Dim == 2)
        body.spin[2] = spin->number();
      else
        body.spin = get_vector<Dim>(entry, "spin").value_or(Vec<3>::Zero());
    } else {
      in_.error(*spin, Dim == 2 ? "'spin' is a number in two dimensions"
                                : "'spin' is a vector in three dimensions");
    }
  }
  if (density || mass)
    body.motion = Motion::free;
  else if (velocity || spin)
    body.motion = Motion::prescribed;
  if (density && mass)
    in_.error(*mass, "'mass' does not go together with 'density'", "give one of the two");
  if (body.motion == Motion::prescribed) {
    body.function = find_function(entry);
    if (spin && !entry.find("centre"))
      in_.error(*spin, "a prescribed 'spin' needs 'centre', the point about which the body turns");
  } else if (const JsonValue* function = entry.find("math_function_id")) {
    in_.error(*function, "'math_function_id' is of prescribed motion",
              "give 'velocity' or 'spin', and neither 'density' nor 'mass'");
  }
  if (const JsonValue* inertia = entry.find("inertia"); inertia && body.motion != Motion::free)
    in_.error(*inertia, "'inertia' is of free bodies", "they have 'density' or 'mass'");
  const JsonValue* fixed = entry.find("fixed");
  if (!fixed) return;
  if (body.motion != Motion::free)
    in_.error(*fixed, "'fixed' is of free bodies", "they have 'density' or 'mass'");
  for (const std::string& word : get_texts(entry, "fixed")) {
    const auto axis = std::string_view("xyz").substr(0, Dim).find(word);
    if (word == "spin")
      body.held_spin = Eigen::Vector3d::Ones();
    else if (word.size() == 1 && axis != std::string_view::npos)
      body.held[static_cast<int>(axis)] = 1;
    else
      in_.error(*fixed, fmt::format("'fixed' has axes and \"spin\", found \"{}\"", word));
  }
  for (int d = 0; d < Dim; ++d)
    if (body.held[d] != 0 && body.velocity[d] != 0)
      in_.error(*velocity,
                fmt::format("'velocity' along {} is {}, but 'fixed' holds the body there", "xyz"[d],
                            body.velocity[d]),
                "give 0, or take the axis out of 'fixed'");
  if (!body.held_spin.isZero() && !body.spin.isZero())
    in_.error(*spin, "'spin' is not 0, but 'fixed' holds it", "leave out one of them");
}

template <int Dim>
void ScenarioBuilder<Dim>::weigh(const JsonValue& entry, RigidBody<Dim>& body) {
  if (!has_end(*body.solid))
    return in_.error(*entry.find("region"), "a body without an end cannot move by forces",
                     "bound the region, or leave out 'density' and 'mass'");
  const bool around_axis = model_.analysis.plane == Plane::axisymmetric;
  const auto moments = moments_of(*body.solid, mass_cuts(Dim), around_axis);
  if (moments.volume == 0) return in_.error(*entry.find("region"), "the body has no volume");
  const double density =
      get_number(entry, "density").value_or(get_number(entry, "mass").value_or(0) / moments.volume);
  body.mass = density * moments.volume;
  body.inertia = density * moments.inertia;
  if (!entry.find("centre")) body.centre = centre_of(moments);
  if (const JsonValue* inertia = entry.find("inertia"); inertia && inertia->valid())
    read_inertia(entry, *inertia, in_, body);
}

template <int Dim>
Vec<Dim> ScenarioBuilder<Dim>::centre_of(const SolidMoments<Dim>& moments) const {
  Vec<Dim> centre = moments.centre;
  if (model_.analysis.plane == Plane::axisymmetric) centre[0] = 0;
  return centre;
}

/// A body of revolution moves along its axis; a prescribed velocity along x makes its circles grow.
template <int Dim>
void ScenarioBuilder<Dim>::turn_around_axis(const JsonValue& entry, RigidBody<Dim>& body) {
  if (const JsonValue* spin = entry.find("spin"))
    in_.error(*spin, "a body of revolution does not turn out of its axis", "leave out 'spin'");
  if (const JsonValue* inertia = entry.find("inertia"))
    in_.error(*inertia, "a body of revolution does not turn out of its axis",
              "leave out 'inertia'");
  if (body.motion != RigidBody<Dim>::Motion::free) return;
  if (body.velocity[0] != 0)
    in_.error(*entry.find("velocity"), "a free body of revolution moves along the axis, y, alone",
              "give 0 for x");
  body.held[0] = 1;
  body.held_spin.setOnes();
}

template <int Dim>
void ScenarioBuilder<Dim>::check_rigid_bodies() {
  const auto list = get_list(root_, "rigid_bodies");
  if (list.empty()) return;
  const auto refuse = [&](const std::string& what, const std::string& hint = "") {
    in_.error(*root_.find("rigid_bodies"),
              fmt::format("'rigid_bodies' do not go together with {}", what), hint);
  };
  const Analysis& a = model_.analysis;
  if (is_implicit(a) && a.free_bodies)
    refuse("implicit steps where forces move them",
           "take explicit steps, or give 'velocity' in place of 'density' and 'mass'");
  if (is_implicit(a) && a.as_cbgeo) refuse("implicit steps of the preset cbgeo");
  if (is_projection(a)) refuse("projections", "take walls of nodes, or explicit steps");
  if (a.plane == Plane::stress) refuse("plane stress");
  if (a.scheme == Scheme::usl)
    refuse(
        "\"mpm_scheme\": \"usl\", whose strains come from nodes with hardly any mass that "
        "contact accelerates",
        "take musl, the default, or usf");
  if (a.two_phase && a.free_bodies)
    refuse("a liquid in pores where forces move them",
           "give 'velocity' in place of 'density' and 'mass'");
  if (a.two_phase && !is_implicit(a) && !is_projection(a) && !has_nodal_porosity(a))
    refuse("a liquid in pores but with musl, the default, as the porosity of nodes is needed",
           "take musl without the preset cbgeo");
  if (model_.mesh && info(model_.mesh->element()).order > 1)
    refuse("elements of second order", "take linear elements, GIMP or splines");
  if (team_.any(!in_.problems.empty())) return;
  if (in_.stage.empty()) check_overlap_of_bodies();  // later ones begin with other particles
  find_reaches();
}

/// How deep [m] x is below the surface of what fills `solid`, and the normal there: the nearest, or
/// where a body bounds it along rows of particles, no more than `most` away.
template <int Dim>
std::pair<double, Vec<Dim>> ScenarioBuilder<Dim>::depth_below_surface(const Solid<Dim>& solid,
                                                                      const Vec<Dim>& x,
                                                                      double most) const {
  const auto near = solid.nearest(x);
  std::pair<double, Vec<Dim>> found(-near.distance, near.normal);
  if (found.first > most) return found;
  for (const RigidBody<Dim>& body : model_.rigid_bodies) {
    const bool is_there = body.stays() || in_.stage.empty();  // later stages may have moved it
    if (!is_there || body.solid->is_beyond(x, most)) continue;
    const auto at = body.solid->nearest(x);
    if (!is_along_axis<Dim>(at.normal) || !(at.distance > found.first)) continue;
    const Vec<Dim> there = x - at.distance * at.normal;
    if (solid.nearest(there).distance <= region_tolerance_) found = {at.distance, -at.normal};
  }
  return found;
}

/// Where a generator fills a region, its surface is known better than from the volumes of
/// particles: a disc then rolls as if it were round.
template <int Dim>
void ScenarioBuilder<Dim>::find_reaches() {
  struct Filled {
    SolidPtr<Dim> solid;  // null: no region
    bool has_slivers;     // where its surface cuts cells
  };
  std::vector<Filled> all;
  for (const GeneratorRows& rows : generators_) {
    all.push_back({nullptr, false});
    const JsonValue* shape = rows.generator->find("region");
    if (!shape) continue;
    ProblemList reported;  // they were, when the particles were made
    const Region<Dim> region(*shape, region_tolerance_, in_.document, reported, geometry_);
    all.back() = {region.solid(),
                  wants_exact_cuts(*rows.generator, region) && mesh_->is_multilinear()};
  }
  auto& p = model_.particles;
  p.reach.assign(p.x.size(), 0.0);
  p.extent.assign(p.x.size(), 0.0);
  for_own_particles([&](std::size_t g, std::size_t i) {
    const auto& [solid, has_slivers] = all[g];
    if (!solid) return;
    const double section = p.volume[i] / depth_at(model_.analysis, p.x[i][0]);
    const double half = 0.5 * std::pow(section, 1.0 / Dim);
    const auto [depth, normal] = depth_below_surface(*solid, p.x[i], 2 * half);
    const bool in_row = is_along_axis<Dim>(normal);
    // Further inside a particle is as large as its volume.
    p.reach[i] = depth > 2 * half ? half : std::max(depth, 1e-6 * half);
    // Parts of cells that count as a whole end where their volume does.
    p.extent[i] = in_row && !has_slivers ? half : p.reach[i];
  });
}

namespace {

/// How deep [m] one of the points is inside of a solid; negative: none is.
template <int Dim>
double deepest(const std::vector<Vec<Dim>>& points, const Solid<Dim>& solid) {
  double depth = -std::numeric_limits<double>::infinity();
  for (const Vec<Dim>& x : points) depth = std::max(depth, -solid.nearest(x).distance);
  return depth;
}

}  // namespace

/// No particle may begin inside of a body, and no free body inside of another one: the force that
/// pushed it out would be large.
template <int Dim>
void ScenarioBuilder<Dim>::check_overlap_of_bodies() {
  using Overlap = BodyOverlap<Dim>;
  constexpr double share_of_size = 0.05;  // of a free body: so deep it may be in another one
  const double least = Overlap::least_share * outer_cell().minCoeff();
  const auto entries = get_list(root_, "rigid_bodies");
  const std::size_t n = model_.rigid_bodies.size();
  std::vector<Overlap> own(n);  // of this member
  for (const Vec<Dim>& x : model_.particles.x)
    for (std::size_t k = 0; k < n; ++k) {
      const double depth = -model_.rigid_bodies[k].solid->nearest(x).distance;
      if (depth > least) own[k].add(x, depth);
    }
  std::vector<Overlap> of_all(n);
  for (const auto& part : team_.gather(own))
    for (std::size_t k = 0; k < n; ++k) of_all[k].add(part[k]);
  for (std::size_t k = 0; k < n; ++k) {
    const Overlap& all = of_all[k];
    if (all.count == 0) continue;
    in_.error(*entries[k]->find("region"),
              fmt::format("{} particles begin inside of the rigid body '{}', up to {:.3g} m deep "
                          "at ({:.6g})",
                          format_count(all.count), model_.rigid_bodies[k].name, all.depth,
                          fmt::join(all.x, ", ")),
              "take the body out of the region of the particles, for example with \"difference\"");
  }
  constexpr int cuts = 40;
  std::vector<std::vector<Vec<Dim>>> points(n);  // of free bodies
  const auto is_free = [&](std::size_t k) {
    return model_.rigid_bodies[k].motion == RigidBody<Dim>::Motion::free;
  };
  for (std::size_t k = 0; k < n; ++k)
    if (is_free(k))
      for (const auto& point : surface_points(*model_.rigid_bodies[k].solid, cuts))
        points[k].push_back(point.x);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t j = k + 1; j < n; ++j) {
      const std::size_t free = is_free(k) ? k : j;
      if (!is_free(free)) continue;
      const RigidBody<Dim>&one = model_.rigid_bodies[k], &other = model_.rigid_bodies[j];
      const auto [low, high] = model_.rigid_bodies[free].solid->bounds();
      const double depth =
          std::max(deepest(points[k], *other.solid), deepest(points[j], *one.solid));
      if (!(depth > share_of_size * (high - low).maxCoeff())) continue;
      in_.error(
          *entries[free]->find("region"),
          fmt::format("the rigid bodies '{}' and '{}' begin inside of each other, {:.3g} m deep",
                      one.name, other.name, depth),
          "a free body may touch others where it begins; contact pushes it out of them");
    }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
