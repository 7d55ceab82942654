// Warnings of what is valid but probably wrong: materials, boundaries and names of fields.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/scenario/scenario_builder.h"
#include "physics/materials/law.h"
#include "physics/particles/columns.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

namespace {

/// The stiffness by which gravity compresses a law, and the key that gives it.
struct Stiffness {
  std::string_view name;
  double value;  ///< [Pa]
};

Stiffness stiffness_of(const JsonValue& material, const Law& law) {
  for (const std::string_view key : {"youngs_modulus", "bulk_modulus"})
    if (const auto value = get_number(material, key)) return {key, *value};
  return {"stiffness of compression waves", wave_modulus(law)};
}

}  // namespace

template <int Dim>
void ScenarioBuilder<Dim>::warn_of_doubts() {
  if (!in_.problems.empty() || !mesh_) return;
  const std::vector<Box> boxes = generator_boxes();
  warn_of_weak_materials();
  warn_of_angles();
  warn_of_steep_friction();
  warn_of_walls();
  warn_of_thin_supports();
  warn_of_free_fall();
  warn_of_overlap(boxes);
  warn_of_smoothing();
  warn_of_locking();
  warn_of_bonds();
  warn_of_distance(boxes);
  warn_of_stillness();
  warn_of_no_pressure();
  warn_of_softening();
  warn_of_thin_layers();
  warn_of_stiffness_contrast();
  warn_of_units();
  warn_of_falling_bodies();
  warn_of_few_particles();
  warn_of_stiff_materials();
  warn_of_viscous_steps();
  warn_of_missing_loads();
  warn_of_stresses_beyond_strength();
  warn_of_gravity_upward();
  warn_of_small_strength();
  warn_of_distant_gauges();
  warn_of_small_gauges();
  warn_of_open_sides();
  warn_of_distant_bodies();
  warn_of_fast_bodies();
  warn_of_thin_bodies();
  warn_of_idle_gauges();
  warn_of_fine_maps();
  warn_of_distant_maps();
  warn_of_short_terrain();
  warn_of_holes();
  warn_of_cut_polygons();
  warn_of_thick_loads();
  warn_of_lost_loads();
  warn_of_forces_on_nothing();
  warn_of_pushing_nodes();
  warn_of_free_inflow();
  warn_of_large_volumes();
  warn_of_shallow_liquids();
  warn_of_lost_foundations();
  warn_of_rough_fields();
  warn_of_no_load();
  warn_of_fields();
}

// Settlement by gravity is about rho g H / (2 E) of the height.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_weak_materials() {
  constexpr double most = 0.1;  // rho g H / E [-]
  const auto materials = get_list(root_, "materials");
  // Soil on a slope lies on its bed, also where gravity is turned instead: the most of it counts.
  Eigen::Index along = 0;
  const double g = model_.gravity.cwiseAbs().maxCoeff(&along);
  if (g == 0 || materials.empty()) return;
  const std::size_t n = materials.size();
  std::vector<double> range(2 * n, -infinity);  // -lowest and highest along that axis, by material
  const auto& p = model_.particles;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const std::size_t m = p.material[i] % n;  // bodies in contact have copies
    const double at = p.x[i][along];
    range[2 * m] = std::max(range[2 * m], -at);
    range[2 * m + 1] = std::max(range[2 * m + 1], at);
  }
  range = team_.most(std::move(range));
  for (std::size_t m = 0; m < n; ++m) {
    const double height = range[2 * m] + range[2 * m + 1];
    if (!(height > 0)) continue;
    const Material& material = model_.materials[m];
    const auto [name, stiffness] = stiffness_of(*materials[m], material.law);
    const double weight = material.density * g * height;
    if (!(weight > most * stiffness)) continue;
    const JsonValue* key = materials[m]->find(name);
    in_.warning(key ? *key : *materials[m],
                fmt::format("material '{}' is soft for its weight: rho g H = {:.3g} Pa over a "
                            "height of {:.3g} m is {:.3g} times its {}, {:.3g} Pa",
                            material.name, weight, height, weight / stiffness, name, stiffness),
                fmt::format("at most {} is usual, else gravity alone compresses it by percents; is "
                            "the stiffness in kPa or MPa instead of Pa?",
                            most));
  }
}

// 0.1 to 1.1 rad are 6 to 63 degrees.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_angles() {
  constexpr double least = 0.1, most = 1.1, degree = 57.29577951308232;
  const auto check = [&](const JsonValue& material, const auto& law) {
    for (const auto& p : law.parameters) {
      if (!p.unit.starts_with("deg") || p.key.find("friction") == std::string_view::npos) continue;
      const JsonValue* value = material.find(p.key);
      if (!value || !value->is_number()) continue;
      const double angle = value->number();
      if (angle < least || angle > most) continue;
      in_.warning(
          *value, fmt::format("'{}' is {} degrees, which looks like radians", p.key, angle),
          fmt::format("angles are in degrees: {} rad are {:.1f} degrees", angle, angle * degree));
    }
  };
  const auto materials = get_list(root_, "materials");
  for (std::size_t m = 0; m < materials.size(); ++m)
    std::visit([&](const auto& law) { check(*materials[m], law); }, model_.materials[m].law);
}

template <int Dim>
void ScenarioBuilder<Dim>::warn_of_steep_friction() {
  constexpr double most = 2;  // [-] tan 63 degrees
  const auto warn = [&](const JsonValue& at, double mu, bool file) {
    in_.warning(at,
                file ? fmt::format("the file has friction coefficients up to {}, above {}, which "
                                   "look like angles",
                                   mu, most)
                     : fmt::format("friction coefficient {} is above {}, which looks like an angle",
                                   mu, most),
                fmt::format("a coefficient is the tangent of an angle: of {} degrees {:.3g}", mu,
                            std::tan(mu / 57.29577951308232)));
  };
  for (const FrictionEntry& e : friction_entries_) {
    double largest = 0;
    for (std::size_t i = e.first; i < e.end; ++i)
      if (std::isfinite(entries_of<NodeFriction>(model_)[i].friction))
        largest = std::max(largest, entries_of<NodeFriction>(model_)[i].friction);
    largest = team_.most({largest}).front();
    const JsonValue* value = e.entry->is<JsonValue::Object>() ? e.entry->find("friction") : nullptr;
    if (largest > most) warn(value ? *value : *e.entry, largest, !value);
  }
  for (const JsonValue* entry : get_list(root_, "rigid_bodies"))
    if (const JsonValue* value = entry->find("friction");
        value && value->is_number() && value->number() > most)
      warn(*value, value->number(), false);
  const JsonValue* contact = section("analysis").find("contact");
  if (model_.analysis.contact.friction > most && contact)
    warn(*contact->find("friction"), model_.analysis.contact.friction, false);
}

// What can hold particles against gravity, anywhere.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_free_fall() {
  constexpr double share = 0.5;  // of the largest component: directions that count as along gravity
  const double largest = model_.gravity.cwiseAbs().maxCoeff();
  if (largest == 0 || rows_.total() == 0) return;
  const auto along = [&](int dir) { return std::abs(model_.gravity[dir]) >= share * largest; };
  const auto any = [&](const auto& list, auto&& dir) {
    return std::any_of(list.begin(), list.end(), [&](const auto& c) { return along(dir(c)); });
  };
  const auto dir = [](const auto& c) { return c.dir; };
  const auto& m = model_;
  bool held = m.analysis.rigid_bodies || any(m.particle_velocities, dir) || any(m.tractions, dir) ||
              !m.node_frames.empty();
  for_each_condition([&]<class T>() {
    const std::vector<T>& list = entries_of<T>(m);
    held = held || (ActsOnNode<T> ? !list.empty()
                                  : any(list, [](const T& c) { return place_of(c).second; }));
  });
  if (team_.any(held)) return;
  const JsonValue* gravity = section("external_loading_conditions").find("gravity");
  in_.warning(
      gravity ? *gravity : root_,
      fmt::format(
          "nothing holds the material against gravity, which is largest along {}: no "
          "velocity constraint, wall or load acts in that direction",
          "xyz"[std::distance(m.gravity.data(),
                              std::find_if(m.gravity.data(), m.gravity.data() + Dim,
                                           [&](double g) { return std::abs(g) == largest; }))]),
      "add a wall or a velocity constraint in mesh.boundary_conditions; a body in free fall "
      "needs none");
}

// Means of the pressure are not those of the volume that particles have.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_smoothing() {
  if (in_.cbgeo_defaults || !model_.analysis.pressure_smoothing) return;
  in_.warning(
      *section("analysis").find("pressure_smoothing"),
      "with 'pressure_smoothing' a fluid forgets its volume: water that comes to rest gets "
      "up to twice as dense",
      "leave it out, and take means of the pressure over some cells: that of single particles "
      "scatters");
}

template <int Dim>
void ScenarioBuilder<Dim>::warn_of_fields() {
  const JsonValue* names = section("post_processing").find("vtk");
  if (!names || !names->is<JsonValue::Array>()) return;
  auto known = field_names();
  for (const char* of_cbgeo :
       {"displacements", "velocities", "normals", "stresses", "strains", "state"})
    known.emplace_back(of_cbgeo);
  for (const JsonValue& name : names->as<JsonValue::Array>())
    if (name.is<std::string>() &&
        std::find(known.begin(), known.end(), name.as<std::string>()) == known.end())
      in_.warning(name, fmt::format("particles have no field '{}'", name.as<std::string>()),
                  suggest(name.as<std::string>(), known, "fields"));
  const auto& wanted = model_.output.frame_fields;
  if (wanted.empty()) return;
  for (const JsonValue& name : names->as<JsonValue::Array>()) {
    const auto is_it = [&](const auto& field) {
      return name.is<std::string>() && field.name == name.as<std::string>();
    };
    if (std::any_of(derived_fields.begin(), derived_fields.end(), is_it) &&
        std::find(wanted.begin(), wanted.end(), name.as<std::string>()) == wanted.end())
      in_.warning(name,
                  fmt::format("frames will not have '{}': 'frame_fields' leaves only its own",
                              name.as<std::string>()),
                  fmt::format("add \"{}\" to frame_fields: no other field is needed for it",
                              name.as<std::string>()));
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
