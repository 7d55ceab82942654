// Initial stresses of ground at rest: the weight of what lies above, and K0 times it across.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/scenario/overburden.h"
#include "io/scenario/scenario_builder.h"
#include "physics/materials/law.h"

namespace lahar {

namespace {

/// sin(phi); nothing for laws without a friction angle.
std::optional<double> sine_of_friction(const Law& law) {
  double friction = -1;
  if (const auto* one = std::get_if<MohrCoulomb>(&law)) friction = one->friction;
  if (const auto* one = std::get_if<DruckerPrager>(&law)) friction = one->friction;
  if (friction < 0) return std::nullopt;
  return std::sin(friction * std::numbers::pi / 180.0);
}

/// 1 - sin(phi) (Jaky 1944).
std::optional<double> jaky(const Law& law) {
  const auto sine = sine_of_friction(law);
  return sine ? std::optional(1.0 - *sine) : std::nullopt;
}

/// The least and the largest ratio that soil bears (Rankine 1857); of soil without cohesion. Others
/// bear more, near to the ground.
std::pair<double, double> rankine(const Law& law) {
  constexpr double most_of_any = 5;
  const auto sine = sine_of_friction(law);
  const auto* soil = std::get_if<MohrCoulomb>(&law);
  if (!sine || !soil || soil->cohesion > 0 || *sine == 0) return {0, most_of_any};
  const double active = (1 - *sine) / (1 + *sine);
  return {active, 1 / active};
}

}  // namespace

// K0 of a material, as `given` says under k0; 1 where it is reported.
template <int Dim>
double ScenarioBuilder<Dim>::k0_of(const Material& material, const JsonValue& given) {
  if (shear_wave_modulus(material.law) == 0) return 1.0;  // a fluid
  if (const auto number = get_number(given, "k0")) {
    constexpr double room = 1.05;  // for ratios of two digits
    const auto [least, most] = rankine(material.law);
    if (*number < least / room || *number > most * room)
      in_.warning(*given.find("k0"),
                  fmt::format("'k0' is {:g}, which the material {} does not bear: {:.2g} to {:.2g}",
                              *number, material.name, least, most),
                  "K0 is horizontal over vertical effective stress, about 1 - sin(friction)");
    return *number;
  }
  if (get_text(given, "k0")) {
    if (const auto k0 = jaky(material.law)) return *k0;
    in_.error(*given.find("k0"),
              fmt::format("\"jaky\" needs a friction angle, which the material {} has not",
                          material.name),
              fmt::format("give this material a number of its own: \"materials\": "
                          "[{{\"material\": \"{}\", \"k0\": 0.5}}]",
                          material.name));
  } else if (!written(given, "k0")) {
    in_.error(given, fmt::format("'k0' is missing for the material {}", material.name),
              "\"k0\": a number or \"jaky\" for all, or \"materials\": [{\"material\": ..., "
              "\"k0\": ...}]");
  }
  return 1.0;
}

template <int Dim>
std::vector<double> ScenarioBuilder<Dim>::k0_of_materials(const JsonValue& given) {
  std::vector<Index> used(model_.materials.size(), 0);
  for (const auto m : model_.particles.material)
    if (m < used.size()) used[m] = 1;  // others are not known, which has been reported
  std::vector<const JsonValue*> says(used.size(), &given);
  for (const JsonValue* entry : get_list(given, "materials"))
    if (const int m = find_material(*entry, false); m >= 0)
      says[static_cast<std::size_t>(m)] = entry;
  std::vector<double> all(used.size(), 1.0);
  for (std::size_t m = 0; m < used.size(); ++m)
    if (team_.max(used[m]) > 0) all[m] = k0_of(model_.materials[m], *says[m]);
  return all;
}

// The axis along which gravity acts; -1 = reported.
template <int Dim>
int ScenarioBuilder<Dim>::vertical_of_k0(const JsonValue& given) {
  int up = -1, axes = 0;
  for (int d = 0; d < Dim; ++d)
    if (model_.gravity[d] != 0) up = d, ++axes;
  if (axes != 1) {
    in_.error(given, "\"k0\" needs gravity along an axis",
              "\"gravity\": [0, -9.81]; under other gravity bring the body to rest, see "
              "analysis.until");
    return -1;
  }
  if (model_.gravity_function >= 0) {
    in_.error(given, "\"k0\" is for gravity that acts from the beginning, here it grows",
              "leave out ramping_time or math_function_id of the gravity, or the stresses");
    return -1;
  }
  return up;
}

template <int Dim>
void ScenarioBuilder<Dim>::build_k0() {
  // In a later stage particles have stresses, and those that it places have their own.
  if (!in_.stage.empty()) return;
  const JsonValue* given = section("mesh").find("particles_stresses");
  if (!given || !given->is<JsonValue::Object>() || get_text(*given, "type") != "k0") return;
  const std::vector<double> ratios = k0_of_materials(*given);
  const int up = vertical_of_k0(*given);
  if (up < 0 || !mesh_ || !particles_complete_ || !in_.problems.empty()) return;
  ParticleTable<Dim>& p = model_.particles;
  const double g = std::abs(model_.gravity[up]);
  typename Overburden<Dim>::Lattice lattice{.up = up,
                                            .sense = model_.gravity[up] < 0 ? 1.0 : -1.0,
                                            .origin = mesh_->bounds().first,
                                            .width = outer_cell(),
                                            .aligned = is_grid()};
  std::vector<typename Overburden<Dim>::Piece> pieces(p.x.size());
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const Material& material = model_.materials[p.material[i]];
    const double volume = p.volume[i] / depth_at(model_.analysis, p.x[i][0]);
    double mass = volume * material.density;
    mass += liquid_mass_of(material.liquid, mass, volume);
    pieces[i] = {p.x[i], volume, g * mass};
  }
  const Overburden<Dim> above(lattice, pieces, team_);
  std::vector<double> vertical(p.x.size()), weight(p.x.size());
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    vertical[i] = above.at(p.x[i]);
    weight[i] = pieces[i].weight;
  }
  if (lattice.aligned && mesh_->is_multilinear()) {
    const std::vector<double> change = balance_of_columns(up, vertical, weight);
    for (std::size_t i = 0; i < p.x.size(); ++i) vertical[i] += change[i];
  }
  // Tractions balance it.
  const double surcharge = get_number(*given, "surcharge").value_or(0);
  p.stress.resize(p.x.size());
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const double pressure = p.pore_pressure.empty() ? 0.0 : p.pore_pressure[i];
    const double effective = std::max(0.0, vertical[i] + surcharge - pressure);
    Voigt& stress = p.stress[i];
    stress = {};
    const int directions = model_.analysis.plane == Plane::stress ? 2 : 3;  // none across a sheet
    for (int d = 0; d < directions; ++d)
      stress[static_cast<std::size_t>(d)] = -(d == up ? 1.0 : ratios[p.material[i]]) * effective;
  }
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
