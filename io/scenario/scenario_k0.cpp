// Initial stresses of ground at rest: the weight of what lies above, and K0 times it across.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>

#include "io/scenario/column_balance.h"
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
  const double surcharge = get_number(*given, "surcharge").value_or(0);
  std::vector<double> vertical(p.x.size()), weight(p.x.size());
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    vertical[i] = above.at(p.x[i]) + surcharge;
    weight[i] = pieces[i].weight;
  }
  if (lattice.aligned && needs_balance(model_.analysis.functions)) {
    const std::vector<double> change = balance_of_columns(up, vertical, weight);
    for (std::size_t i = 0; i < p.x.size(); ++i) vertical[i] += change[i];
  }
  p.stress.resize(p.x.size());
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    const double pressure = p.pore_pressure.empty() ? 0.0 : p.pore_pressure[i];
    const double effective = std::max(0.0, vertical[i] - pressure);
    Voigt& stress = p.stress[i];
    stress = {};
    const int directions = model_.analysis.plane == Plane::stress ? 2 : 3;  // none across a sheet
    for (int d = 0; d < directions; ++d)
      stress[static_cast<std::size_t>(d)] = -(d == up ? 1.0 : ratios[p.material[i]]) * effective;
  }
}

namespace {

/// A particle in its column of a grid, told to the member that looks after the column.
struct ColumnEntry {
  Index column;
  ColumnRow row;
  std::array<double, 2> off;  ///< in plan, from the middle of the column [cells]
  Index particle;             ///< of the member that told it
};

/// Rows of level ground lie around the middle of their column. Under a slope, where the upper ones
/// do not, a column is not in balance by itself.
constexpr double most_off = 1e-3;  // [cells]

/// Changes of particles of one column, in the order of its entries. Particles that are a millionth
/// of a cell apart are at the same height.
std::vector<double> balance_entries(std::span<const ColumnEntry> entries, double cell, int cells,
                                    ShapeFunctions functions) {
  std::vector<ColumnRow> rows;
  std::vector<std::array<double, 2>> moments;
  std::vector<std::size_t> row_of;
  for (const ColumnEntry& entry : entries) {
    if (rows.empty() || entry.row.height - rows.back().height > 1e-6) {
      rows.push_back(entry.row);
      rows.back().stress *= entry.row.volume;
      moments.push_back({});
    } else {
      rows.back().volume += entry.row.volume;
      rows.back().weight += entry.row.weight;
      rows.back().stress += entry.row.volume * entry.row.stress;
    }
    for (std::size_t d = 0; d < 2; ++d) moments.back()[d] += entry.row.volume * entry.off[d];
    row_of.push_back(rows.size() - 1);
  }
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (std::hypot(moments[k][0], moments[k][1]) > most_off * rows[k].volume)
      return std::vector<double>(entries.size(), 0.0);
  for (ColumnRow& row : rows) row.stress /= row.volume;
  const std::vector<double> change = balance_column(rows, cell, cells, functions);
  std::vector<double> all;
  for (const std::size_t k : row_of) all.push_back(change[k]);
  return all;
}

}  // namespace

template <int Dim>
std::vector<double> ScenarioBuilder<Dim>::balance_of_columns(
    int up, const std::vector<double>& vertical, const std::vector<double>& weight) const {
  const ParticleTable<Dim>& p = model_.particles;
  const auto [low, high] = mesh_->bounds();
  const Vec<Dim> cell = outer_cell();
  const bool upwards = model_.gravity[up] < 0;
  std::vector<std::vector<ColumnEntry>> to(static_cast<std::size_t>(team_.size()));
  for (std::size_t i = 0; i < p.x.size(); ++i) {
    Index column = 0;
    std::array<double, 2> off{};
    for (int d = 0, k = 0; d < Dim; ++d) {
      if (d == up) continue;
      const double at = (p.x[i][d] - low[d]) / cell[d];
      column = column * 2'000'003 + static_cast<Index>(at);
      off[static_cast<std::size_t>(k++)] = at - std::floor(at) - 0.5;
    }
    const double volume = p.volume[i] / depth_at(model_.analysis, p.x[i][0]);
    const double part = std::pow(volume / cell.prod(), 1.0 / Dim);
    const double height = (upwards ? p.x[i][up] - low[up] : high[up] - p.x[i][up]) / cell[up];
    to[static_cast<std::size_t>(column) % to.size()].push_back({column,
                                                                {.height = height,
                                                                 .half = 0.5 * part,
                                                                 .volume = volume,
                                                                 .weight = weight[i],
                                                                 .stress = vertical[i]},
                                                                off,
                                                                static_cast<Index>(i)});
  }
  struct Told {
    ColumnEntry entry;
    std::size_t member, place;
  };
  std::vector<Told> told;
  const auto from = team_.exchange(std::move(to));
  std::vector<std::vector<double>> answers(from.size());
  for (std::size_t m = 0; m < from.size(); ++m) {
    answers[m].resize(from[m].size());
    for (std::size_t k = 0; k < from[m].size(); ++k) told.push_back({from[m][k], m, k});
  }
  std::sort(told.begin(), told.end(), [](const Told& a, const Told& b) {
    const auto key = [](const ColumnEntry& e) {
      return std::tuple(e.column, e.row.height, e.row.weight, e.row.stress);
    };
    return key(a.entry) < key(b.entry);
  });
  const int cells = static_cast<int>(std::lround((high[up] - low[up]) / cell[up]));
  for (auto begin = told.begin(); begin != told.end();) {
    const auto end = std::find_if(begin, told.end(), [&](const Told& one) {
      return one.entry.column != begin->entry.column;
    });
    std::vector<ColumnEntry> entries;
    for (auto at = begin; at != end; ++at) entries.push_back(at->entry);
    const auto change = balance_entries(entries, cell[up], cells, model_.analysis.functions);
    for (auto at = begin; at != end; ++at)
      answers[at->member][at->place] = change[static_cast<std::size_t>(at - begin)];
    begin = end;
  }
  // Answers come in the order in which this member told its particles.
  std::vector<double> all(p.x.size());
  std::vector<std::vector<Index>> asked(answers.size());
  for (std::size_t m = 0; m < from.size(); ++m)
    for (const ColumnEntry& entry : from[m]) asked[m].push_back(entry.particle);
  const auto particles = team_.exchange(std::move(asked));
  const auto changes = team_.exchange(std::move(answers));
  for (std::size_t m = 0; m < particles.size(); ++m)
    for (std::size_t k = 0; k < particles[m].size(); ++k)
      all[static_cast<std::size_t>(particles[m][k])] = changes[m][k];
  return all;
}

}  // namespace lahar

#include "io/scenario/scenario_builder_instances.h"
