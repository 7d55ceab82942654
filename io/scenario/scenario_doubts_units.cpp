// Warnings of values in other units than SI, of bodies that fall out of the mesh, of cells with too
// few particles, and of steps that one material makes short.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/scenario/scenario_builder.h"
#include "physics/base/sort_unique.h"
#include "physics/materials/tangent.h"

namespace lahar {

namespace {

constexpr double earth = 9.81;        // [m/s^2]
constexpr double about_earth = 0.05;  // of it

bool is_about(double value, double wanted) {
  return std::abs(value - wanted) <= about_earth * wanted;
}

double norm_of(const Voigt& stress) {
  double sum = 0;
  for (std::size_t k = 0; k < stress.size(); ++k)
    sum += (k < 3 ? 1.0 : 2.0) * stress[k] * stress[k];
  return std::sqrt(sum);
}

/// What an increment without strain makes of a stress, less that stress.
Voigt first_change(const Law& law, const Voigt& stress) {
  const Scalar no_strain[3][3] = {};
  Scalar at[6], state[most_state];
  double begin[most_state] = {};
  initial_state(law, stress, begin);
  const Failures failures = std::visit(
      [&](const auto& of) {
        return update_by<3>(prepare(of), no_strain, 1.0, {.linear_strain = true}, stress.data(),
                            begin, at, state);
      },
      law);
  Voigt change{};
  if (failures.failed == 0)
    for (std::size_t k = 0; k < 6; ++k) change[k] = at[k][0] - stress[k];
  return change;
}

/// Whether the ratios of stresses that a law bears do not depend on their size: K0 is looked at.
bool has_ratios(const Law& law) {
  const auto* soil = std::get_if<MohrCoulomb>(&law);
  return soil && soil->cohesion == 0;
}

/// What a law needs more of to bear a stress.
std::string what_grows(const Law& law) {
  if (std::holds_alternative<ModifiedCamClay>(law)) return "a larger 'pc0'";
  if (std::holds_alternative<NorSand>(law)) return "a larger 'p_image_initial'";
  return "more strength";
}

}  // namespace

// Whoever has the gravity of the earth in m/s^2 has SI units. Whoever has neither may have any.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_units() {
  constexpr double lightest = 30;    // [kg/m^3] of soils, rocks, metals, liquids; foams have more
  constexpr double heaviest = 3e4;   // [kg/m^3] osmium has 22600
  constexpr double stiffest = 2e12;  // [Pa] diamond has 1.2e12
  constexpr double lightest_grains = 2000;  // [kg/m^3] those of minerals have 2300 and more
  const double g = model_.gravity.norm();
  const JsonValue* gravity = section("external_loading_conditions").find("gravity");
  if (gravity && is_about(g, 1e3 * earth))
    in_.warning(*gravity, fmt::format("gravity is {:g}, which looks like mm/s^2", g),
                "all values are in SI units: m, kg, s, N, Pa. On the earth gravity is 9.81 m/s^2");
  if (!is_about(g, earth)) return;
  const auto materials = get_list(root_, "materials");
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const Material& material = model_.materials[m];
    const auto warn = [&](std::string_view key, double value, const std::string& hint) {
      const JsonValue* at = materials[m]->find(key);
      in_.warning(at ? *at : *materials[m],
                  fmt::format("material '{}' has '{}' {:g}, which no material has in SI units",
                              material.name, key, value),
                  hint);
    };
    if (material.density < lightest || material.density > heaviest)
      warn("density", material.density,
           "densities are in kg/m^3: water has 1000, soil about 1500 to 2700");
    const auto grains = get_number(*materials[m], "density");
    if (grains && material.liquid && *grains < lightest_grains)
      in_.warning(
          *materials[m]->find("density"),
          fmt::format("grains of the material '{}' have 'density' {:g}, less than minerals",
                      material.name, *grains),
          "with a liquid in the pores this is the density of the grains, about 2650 kg/m^3");
    for (const std::string_view key : {"youngs_modulus", "bulk_modulus"})
      if (const auto value = get_number(*materials[m], key); value && *value > stiffest)
        warn(key, *value, "moduli are in Pa: steel has 2.1e11, soil about 1e6 to 1e9");
  }
  for (const JsonValue* body : get_list(root_, "rigid_bodies"))
    if (const auto density = get_number(*body, "density");
        density && (*density < lightest || *density > heaviest))
      in_.warning(
          *body->find("density"),
          fmt::format("a rigid body has 'density' {:g}, which nothing has in SI units", *density),
          "densities are in kg/m^3: rock has about 2600, steel 7800");
}

// A body is a generator. What bounds it or lies below it is looked for in the box around it and
// below that, as far as the mesh goes.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_falling_bodies() {
  const double g = model_.gravity.norm();
  const Vec<Dim> along = model_.gravity.cwiseAbs();
  int axis = 0;
  along.maxCoeff(&axis);
  constexpr double upright = 0.99;  // cosine between gravity and an axis, at least
  if (g == 0 || !(along[axis] > upright * g) || team_.any(!model_.node_frames.empty())) return;
  if (generators_.empty() || !model_.injections.empty() || !model_.tractions.empty() ||
      model_.analysis.all_may_leave())
    return;
  std::vector<Index> nodes;
  for_each_condition([&]<class T>() {
    for (const T& entry : entries_of<T>(model_))
      if (ActsOnNode<T> || place_of(entry).second == axis) nodes.push_back(entry.node);
  });
  sort_unique(nodes);
  const std::vector<Box> boxes = boxes_of_generators();
  const Vec<Dim> cell = outer_cell();
  const double down = model_.gravity[axis] > 0 ? 1 : -1;
  const auto is_below = [&](const Vec<Dim>& low, const Vec<Dim>& high, const Box& box) {
    for (int d = 0; d < Dim; ++d)
      if (d != axis && (high[d] < box[0][d] - cell[d] || low[d] > box[1][d] + cell[d]))
        return false;
    // Not wholly above it.
    return down > 0 ? high[axis] > box[0][axis] - cell[axis]
                    : low[axis] < box[1][axis] + cell[axis];
  };
  std::vector<double> held(boxes.size(), 0.0);
  for (const Vec<Dim>& x : places_of(nodes))
    for (std::size_t b = 0; b < boxes.size(); ++b)
      if (held[b] == 0.0 && is_below(x, x, boxes[b])) held[b] = 1.0;
  held = team_.most(std::move(held));
  for (const RigidBody<Dim>& body : model_.rigid_bodies) {
    const auto [low, high] = body.solid->bounds();
    for (std::size_t b = 0; b < boxes.size(); ++b)
      if (is_below(low, high, boxes[b])) held[b] = 1.0;
  }
  if (!model_.analysis.rigid_bodies && std::find(held.begin(), held.end(), 1.0) == held.end())
    return;  // warn_of_free_fall()
  std::vector<double> driven(boxes.size(), 0.0);
  for (const ParticleVelocity& v : model_.particle_velocities)
    if (v.dir == axis) driven.assign(boxes.size(), 1.0);
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    bool other = held[b] > 0.0 || driven[b] > 0.0;
    for (std::size_t k = 0; k < boxes.size() && !other; ++k)
      other = k != b && is_below(boxes[k][0], boxes[k][1], boxes[b]);
    if (other) continue;
    in_.warning(*generators_[b].generator,
                fmt::format("this body falls out of the mesh: below it, along {}, there is neither "
                            "a wall, a node that is held, nor another body",
                            "xyz"[axis]),
                "add a floor (walls or velocity_constraints of a node set), or move the body");
  }
}

template <int Dim>
auto ScenarioBuilder<Dim>::boxes_of_generators() const -> std::vector<Box> {
  std::vector<Box> boxes = generator_boxes();
  if (!boxes.empty() || generators_.size() != 1) return boxes;
  std::vector<double> sides(2 * static_cast<std::size_t>(Dim), -infinity);  // -low, then high
  for (const Vec<Dim>& x : model_.particles.x)
    for (int d = 0; d < Dim; ++d) {
      double* side = &sides[2 * static_cast<std::size_t>(d)];
      side[0] = std::max(side[0], -x[d]);
      side[1] = std::max(side[1], x[d]);
    }
  sides = team_.most(std::move(sides));
  boxes.resize(1);
  for (int d = 0; d < Dim; ++d) {
    boxes[0][0][d] = -sides[2 * static_cast<std::size_t>(d)];
    boxes[0][1][d] = sides[2 * static_cast<std::size_t>(d) + 1];
  }
  return boxes;
}

// One particle in a cell: it takes stresses at one point, and gaps open where strains are large.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_few_particles() {
  if (in_.cbgeo_defaults || info(mesh_->element()).simplex) return;
  constexpr Index smallest = 50;  // particles; less are for trying something out
  for (const GeneratorRows& rows : generators_)
    for (const std::string_view key : {"per_cell", "nparticles_per_dir"}) {
      const JsonValue* value = rows.generator->find(key);
      if (!value || !value->is_number() || value->number() != 1 || rows.end - rows.first < smallest)
        continue;
      in_.warning(
          *value,
          "cells have one particle per direction: material opens gaps where it is stretched "
          "by half a cell, and patterns of no stiffness are not seen by it",
          "take 2, or 3 where strains are large");
    }
}

// Steps follow from the fastest waves. Bodies of steel in soil are slow to compute, and hardly
// deform.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_stiff_materials() {
  constexpr double most = 5;  // times as fast as waves in all other materials
  constexpr double most_particles = 0.5;
  const auto materials = get_list(root_, "materials");
  if (is_implicit(model_.analysis) || is_projection(model_.analysis) || materials.size() < 2)
    return;
  std::vector<Index> count(materials.size(), 0);
  for (const std::uint16_t m : model_.particles.material) ++count[m % materials.size()];
  for (Index& n : count) n = team_.sum(n);
  std::size_t fastest = 0;
  double first = 0, second = 0;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    if (count[m] == 0) continue;
    const double speed = wave_speed(model_.materials[m]);
    second = std::max(second, std::min(first, speed));
    if (speed > first) first = speed, fastest = m;
  }
  const double share = static_cast<double>(count[fastest]) / static_cast<double>(rows_.total());
  if (second == 0 || first < most * second || share > most_particles) return;
  in_.warning(
      *materials[fastest],
      fmt::format("material '{}' makes time steps {:.3g} times shorter than all other "
                  "materials need: its waves have {:.3g} m/s, those of the others at most "
                  "{:.3g} m/s",
                  model_.materials[fastest].name, first / second, first, second),
      "a body that hardly deforms may be softer, as long as it stays much stiffer than what "
      "it touches");
}

// Stresses and pressures at the beginning that only a load on the ground keeps.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_missing_loads() {
  if (prescribes_pressure()) return;  // of water that stands on the ground
  const auto& tractions = model_.tractions;
  const JsonValue* stresses = section("mesh").find("particles_stresses");
  const JsonValue* surcharge =
      stresses && stresses->is<JsonValue::Object>() ? stresses->find("surcharge") : nullptr;
  if (surcharge && surcharge->is_number() && surcharge->number() != 0 && tractions.empty())
    in_.warning(*surcharge, "nothing loads the ground: a surcharge is a stress alone",
                "give the load as particle_surface_traction, too");
  const JsonValue* pressures = section("mesh").find("particles_pore_pressures");
  if (!pressures || !pressures->is<JsonValue::Object>() ||
      get_text(*pressures, "type") != "water_table")
    return;
  double water = infinity;  // [kg/m^3]
  for (const Material& material : model_.materials)
    if (material.liquid) water = std::min(water, material.liquid->density);
  const bool loaded = std::any_of(tractions.begin(), tractions.end(),
                                  [](const ParticleTraction& t) { return t.on_liquid; });
  const double cell = water * model_.gravity.norm() * outer_cell().maxCoeff();  // [Pa]
  if (loaded || !(cell > 0) || std::isinf(cell)) return;
  const std::vector<double> ground = pressures_at_ground();
  const auto [least, most] = std::minmax_element(ground.begin(), ground.end());
  if (ground.empty() || !(*most > cell)) return;
  const auto ponded =
      std::count_if(ground.begin(), ground.end(), [&](double pressure) { return pressure > cell; });
  const double share = static_cast<double>(ponded) / static_cast<double>(ground.size());
  in_.warning(*pressures,
              share == 1
                  ? fmt::format("the water table is above the ground, where nothing loads it: all "
                                "pore pressures are {:.3g} Pa or more",
                                *least)
                  : fmt::format("the water table is above {:.0f} % of the ground, where nothing "
                                "loads it: pore pressures are up to {:.3g} Pa there",
                                std::max(1.0, 100 * share), *most),
              "give the pond's pressure p as two tractions: p on both phases, and p times the "
              "porosity on the liquid; or lower the table");
}

// Of columns as wide as a cell, along the axis of gravity: those of the uppermost particles.
template <int Dim>
std::vector<double> ScenarioBuilder<Dim>::pressures_at_ground() {
  constexpr double most_columns = 1e7;
  const auto& p = model_.particles;
  int axis = 0;
  model_.gravity.cwiseAbs().maxCoeff(&axis);
  const double up = model_.gravity[axis] > 0 ? -1 : 1;
  const auto [low, high] = mesh_->bounds();
  Vec<Dim> width = outer_cell();
  const auto columns = [&, low = low, high = high] {
    double n = 1;
    for (int d = 0; d < Dim; ++d) n *= d == axis ? 1 : std::ceil((high[d] - low[d]) / width[d]) + 1;
    return n;
  };
  while (columns() > most_columns) width *= 2;
  const auto column_of = [&, low = low, high = high](const Vec<Dim>& x) {
    std::size_t at = 0;
    for (int d = 0; d < Dim; ++d) {
      if (d == axis) continue;
      const double n = std::ceil((high[d] - low[d]) / width[d]) + 1;
      at = at * static_cast<std::size_t>(n) +
           static_cast<std::size_t>(std::clamp(std::floor((x[d] - low[d]) / width[d]), 0.0, n - 1));
    }
    return at;
  };
  std::vector<double> top(static_cast<std::size_t>(columns()), -infinity), least = top;
  for (const Vec<Dim>& x : p.x) top[column_of(x)] = std::max(top[column_of(x)], up * x[axis]);
  top = team_.most(std::move(top));
  for (std::size_t i = 0; i < p.x.size(); ++i) {  // of two that are as high, the lower one
    const std::size_t at = column_of(p.x[i]);
    const double pressure = p.pore_pressure.empty() ? 0.0 : p.pore_pressure[i];
    if (up * p.x[i][axis] == top[at]) least[at] = std::max(least[at], -pressure);
  }
  least = team_.most(std::move(least));
  std::vector<double> found;
  for (std::size_t at = 0; at < least.size(); ++at)
    if (top[at] > -infinity) found.push_back(-least[at]);
  return found;
}

// Stresses at the beginning that a law does not bear: without any strain it changes them. K0 has a
// warning of its own for sand without cohesion. Materials with fields have other laws at each
// place.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_stresses_beyond_strength() {
  constexpr Index most_looked_at = 100000;  // particles
  constexpr double rounding = 1e-6;         // of the stress
  const auto materials = get_list(root_, "materials");
  const auto& p = model_.particles;
  const JsonValue* given = section("mesh").find("particles_stresses");
  const bool k0 =
      given && given->is<JsonValue::Object>() && get_text(*given, "type").value_or("") == "k0";
  if (!in_.stage.empty() || team_.any(!p.state.empty()) || !team_.any(!p.stress.empty())) return;
  const auto has_fields = [&](std::size_t m) { return m < fields_.size() && !fields_[m].empty(); };
  const Index stride = 1 + rows_.total() / most_looked_at;
  std::vector<Index> looked(materials.size(), 0), beyond = looked;
  std::vector<double> worst(materials.size(), 0.0);
  for (std::size_t i = 0; i < p.stress.size(); ++i) {
    const std::size_t m = p.material[i] % materials.size();  // bodies in contact have copies
    const double size = norm_of(p.stress[i]);
    const Law& law = model_.materials[m].law;
    if (p.id_of(i) % stride != 0 || !(size > 0) || has_fields(m) || (k0 && has_ratios(law)))
      continue;
    ++looked[m];
    const double taken = norm_of(first_change(law, p.stress[i])) / size;
    if (!(taken > rounding)) continue;
    ++beyond[m];
    worst[m] = std::max(worst[m], taken);
  }
  worst = team_.most(std::move(worst));
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const Index all = team_.sum(looked[m]), some = team_.sum(beyond[m]);
    if (some == 0) continue;
    in_.warning(
        *materials[m],
        fmt::format("'{}' does not bear the stress at the beginning at {:.3g} % of its particles: "
                    "the first step takes up to {:.3g} % of it",
                    model_.materials[m].name,
                    100.0 * static_cast<double>(some) / static_cast<double>(all), 100.0 * worst[m]),
        fmt::format("give it {}, or a stress that it bears: 'lahar material' shows which",
                    what_grows(model_.materials[m].law)));
  }
}

// A yield stress makes a fluid very viscous where it hardly shears, and viscosity limits explicit
// steps.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_viscous_steps() {
  constexpr double most = 5;  // times as many steps as waves need
  if (is_implicit(model_.analysis) || is_projection(model_.analysis)) return;
  const auto materials = get_list(root_, "materials");
  const double h = smallest_cell(*mesh_, team_);
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const auto* law = std::get_if<Bingham>(&model_.materials[m].law);
    const JsonValue* rate = materials[m]->find("critical_shear_rate");
    if (!law || !rate) continue;
    const double density = model_.materials[m].density;
    // As in the limit of the step (kernels/locate.cpp).
    const double per_viscosity = 2.0 * Dim * 4.0 / 3.0 / (h * h * density);
    const double waves = std::max(wave_speed(model_.materials[m]) / h, per_viscosity * law->mu);
    const double longer = per_viscosity * law->viscosity() / waves;
    if (!(longer > most)) continue;
    in_.warning(
        *rate,
        fmt::format("below this shear rate '{}' has a viscosity of {:.3g} Pa s, which makes "
                    "time steps {:.3g} times shorter than its waves need",
                    model_.materials[m].name, law->viscosity(), longer),
        fmt::format("with {:.2g} 1/s they are {:.0f} times shorter; the rate should be "
                    "small beside the shear rates of the flow",
                    law->critical_shear_rate * longer / most, most));
  }
}

// Random fields that change within a particle are noise, which averages out.
template <int Dim>
void ScenarioBuilder<Dim>::warn_of_rough_fields() {
  const auto materials = get_list(root_, "materials");
  std::vector<double> largest(materials.size(), 0.0);  // [m^2; m^3] of particles, by material
  const auto& p = model_.particles;
  if (materials.empty()) return;
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    double& volume = largest[p.material[i] % materials.size()];
    volume = std::max(volume, p.volume[i] / depth_at(model_.analysis, p.x[i][0]));
  }
  largest = team_.most(std::move(largest));
  for (std::size_t m = 0; m < materials.size(); ++m) {
    if (!materials[m]->is<JsonValue::Object>()) continue;
    const double apart = std::pow(largest[m], 1.0 / Dim);
    for (const auto& member : materials[m]->as<JsonValue::Object>()) {
      const JsonValue* length =
          member.value.is<JsonValue::Object>() ? member.value.find("correlation_length") : nullptr;
      if (!length) continue;
      double least = infinity;
      if (length->is_number())
        least = length->number();
      else if (const auto lengths = get_vector<Dim>(member.value, "correlation_length"))
        least = lengths->minCoeff();
      if (!(least < apart)) continue;
      in_.warning(*length,
                  fmt::format("the correlation length {:.3g} m of '{}' is below the distance of "
                              "particles, {:.3g} m: neighbours have nothing in common, and "
                              "results depend on the mesh",
                              least, member.key, apart),
                  "take it at least twice as long as cells, or finer cells");
    }
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
