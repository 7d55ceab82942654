// Parameters of materials that differ from place to place (material_fields.h).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "io/base/text.h"
#include "io/scenario/law_reader.h"
#include "io/scenario/scenario_builder.h"
#include "io/schema/keys.h"

namespace lahar {

namespace {

constexpr double most_classes_of_all = 20000;

/// A class of a material with fields.
struct ClassOf {
  Index material = -1;  ///< index into Model::materials before the split; -1 = it has no fields
  Index number = -1;    ///< of values of all of its fields
  auto operator<=>(const ClassOf&) const = default;
};

std::uint64_t hash_of(Index particle, std::uint16_t material) {
  std::uint64_t bits = static_cast<std::uint64_t>(particle) << 16 | material;
  bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9ULL;
  bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBULL;
  return bits ^ (bits >> 31);
}

JsonValue with_number(JsonValue object, std::string_view key, double value) {
  for (auto& member : std::get<JsonValue::Object>(object.data))
    if (member.key == key) member.value.data = value;
  return object;
}

}  // namespace

template <int Dim>
std::optional<JsonValue> ScenarioBuilder<Dim>::take_fields(const JsonValue& material) {
  auto& fields = fields_.emplace_back();
  const auto& members = material.as<JsonValue::Object>();
  if (std::none_of(members.begin(), members.end(),
                   [](const auto& m) { return m.value.template is<JsonValue::Object>(); }))
    return std::nullopt;
  JsonValue plain = material;
  for (const auto& member : members) {
    if (!member.value.template is<JsonValue::Object>()) continue;
    auto field = field_of(member.key, member.value, material);
    if (!field) {  // reported
      plain.find(member.key)->invalidate();
      continue;
    }
    field->key = member.key;
    check_bounds_of(*field, material, member.value);
    plain = with_number(std::move(plain), member.key, field->mean);
    fields.push_back(std::move(*field));
  }
  return plain;
}

// The message names the particle without a value that has the least x.
template <int Dim>
void ScenarioBuilder<Dim>::check_fields_known() {
  const auto materials = get_list(root_, "materials");
  for (std::size_t m = 0; m < fields_.size() && m < materials.size(); ++m)
    for (const auto& field : fields_[m]) {
      std::vector<std::array<double, Dim>> places;
      for (std::size_t p = 0; p < model_.particles.x.size(); ++p) {
        const Vec<Dim>& x = model_.particles.x[p];
        if (model_.particles.material[p] % fields_.size() != m || field.class_of(x) >= 0) continue;
        places.emplace_back();
        std::copy_n(x.data(), Dim, places.back().begin());
      }
      const Index count = team_.sum(static_cast<Index>(places.size()));
      if (count == 0) continue;
      std::sort(places.begin(), places.end());
      places.resize(std::min<std::size_t>(places.size(), 1));
      places = joined(team_.gather(places));
      const auto& first = *std::min_element(places.begin(), places.end());
      in_.error(
          *materials[m]->find(field.key),
          fmt::format("the map of '{}' has no value at {} of the particles of '{}', the first "
                      "at x = {:.6g}, y = {:.6g}",
                      field.key, format_count(count), model_.materials[m].name, first[0], first[1]),
          "fill the nodata of the raster there (gdal_fillnodata.py), or give it the "
          "coordinates of the mesh with 'map_origin'");
    }
}

template <int Dim>
void ScenarioBuilder<Dim>::check_bounds_of(const MaterialField<Dim>& field,
                                           const JsonValue& material, const JsonValue& at) {
  const std::string type(without_dimension(get_text(material, "type").value_or("")));
  const KeySpec* spec = materials_section().find(field.key, type);
  for (const double value : field.values) {
    const bool low = spec->above_min ? !(value > spec->min) : !(value >= spec->min);
    const bool high = spec->below_max ? !(value < spec->max) : !(value <= spec->max);
    if (!low && !high) continue;
    return in_.error(at,
                     fmt::format("'{}' becomes {:.3g} in parts of this field; it must be {} {:g}",
                                 field.key, value,
                                 low ? (spec->above_min ? "greater than" : "at least")
                                     : (spec->below_max ? "less than" : "at most"),
                                 low ? spec->min : spec->max),
                     "'min' and 'max' bound the values; a log-normal field is positive");
  }
}

template <int Dim>
void ScenarioBuilder<Dim>::refuse_fields() {
  const auto materials = get_list(root_, "materials");
  const std::size_t n = materials.size();
  const auto refuse = [&](std::size_t m, const std::string& what, const std::string& hint) {
    in_.error(*materials[m],
              fmt::format("material '{}' has fields, which do not go together with {}",
                          model_.materials[m].name, what),
              hint);
  };
  for (std::size_t m = 0; m < fields_.size() && m < n; ++m) {
    if (fields_[m].empty()) continue;
    if (model_.analysis.mean_volume)
      refuse(m, "'b_bar'",
             "the particles of a cell have several materials then; leave out one of them");
    for (const Injection<Dim>& injection : model_.injections)
      if (injection.material % n == m)
        return refuse(m, "particles that come in during the run",
                      "values belong to places at the beginning; inject another material");
    const auto& given = model_.changes.given;
    if (std::count(given.begin(), given.end(), m) > 0)
      refuse(m, "'change_material'",
             "values belong to places at the beginning; change particles to another material");
    const JsonValue* resume = section("analysis").find("resume");
    if (resume && get_bool(*resume, "resume").value_or(false))
      refuse(m, "particles of an earlier run", "where they were at its beginning is not known");
  }
}

// Particles of the beginning are group 0. Each source of particles that stages place is a group.
template <int Dim>
std::size_t ScenarioBuilder<Dim>::group_of_row(Index row) const {
  if (row < placed_row_) return 0;
  std::size_t group = 0;
  for (const auto& source : generators_) {
    if (source.end <= placed_row_) continue;
    ++group;
    if (row < source.end) break;
  }
  return group;
}

// Classes are numbered by the first group that has them, then by material, then by values. Ranks do
// not matter. So classes keep their numbers when a stage places more particles. The first class of
// a material takes the place of the material.
template <int Dim>
void ScenarioBuilder<Dim>::split_fields() {
  in_.classes.assign(1 + group_of_row(rows_.total()), 0);
  if (std::all_of(fields_.begin(), fields_.end(), [](const auto& f) { return f.empty(); })) return;
  refuse_fields();
  check_fields_known();
  if (!in_.problems.empty()) return;
  auto& particles = model_.particles;
  const std::size_t n = fields_.size();
  const auto fields_of = [&](std::size_t material) -> const auto& {
    return fields_[material % n];
  };
  std::vector<ClassOf> classes(particles.x.size());
  struct Used {
    ClassOf which;
    std::size_t group = 0;
    auto operator<=>(const Used&) const = default;
  };
  std::vector<Used> used;
  for (std::size_t p = 0; p < particles.x.size(); ++p) {
    const std::size_t material = particles.material[p];
    if (fields_of(material).empty()) continue;
    Index number = 0;
    for (const auto& field : fields_of(material))
      number = number * static_cast<Index>(field.values.size()) + field.class_of(particles.x[p]);
    classes[p] = {static_cast<Index>(material), number};
    const Used now{classes[p], group_of_row(particles.id_of(p))};
    if (used.empty() || used.back() != now) used.push_back(now);
  }
  const auto sort_once = [](auto& list) {
    const auto same = [](const Used& a, const Used& b) { return a.which == b.which; };
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end(), same), list.end());
  };
  sort_once(used);
  used = joined(team_.gather(used));
  sort_once(used);
  std::stable_sort(used.begin(), used.end(),
                   [](const Used& a, const Used& b) { return a.group < b.group; });
  if (static_cast<double>(used.size() + model_.materials.size()) > most_classes_of_all)
    return in_.error(*root_.find("materials"),
                     fmt::format("fields of materials have {} different values together; at most "
                                 "{:g} are possible",
                                 used.size(), most_classes_of_all),
                     "give fields that belong together the same 'seed', or fewer 'classes'");
  std::map<ClassOf, std::uint16_t> place;
  std::vector<bool> taken(model_.materials.size(), false);  // the place of a material
  for (const auto& [one, group] : used) {
    const auto material = static_cast<std::size_t>(one.material);
    const Material made = material_of_class(material, one.number);
    if (!in_.problems.empty()) return;
    std::size_t at = material;
    if (taken[material]) {
      at = model_.materials.size();
      model_.materials.push_back(made);
    } else {
      model_.materials[at] = made;
    }
    taken[material] = true;
    place[one] = static_cast<std::uint16_t>(at);
  }
  for (std::size_t p = 0; p < classes.size(); ++p) {
    if (classes[p].material < 0) continue;
    particles.material[p] = place.at(classes[p]);
    const Index row = particles.id_of(p);
    in_.classes[group_of_row(row)] += hash_of(row, particles.material[p]);
  }
  for (std::uint64_t& sum : in_.classes) {
    std::uint64_t all = 0;
    for (const Index share : team_.each(static_cast<Index>(sum)))
      all += static_cast<std::uint64_t>(share);
    sum = all;
  }
}

template <int Dim>
Material ScenarioBuilder<Dim>::material_of_class(std::size_t material, Index number) {
  const std::size_t m = material % fields_.size();
  JsonValue values = *get_list(root_, "materials")[m];
  const auto& fields = fields_[m];
  for (std::size_t k = fields.size(); k-- > 0;) {
    const auto size = static_cast<Index>(fields[k].values.size());
    values = with_number(std::move(values), fields[k].key,
                         fields[k].values[static_cast<std::size_t>(number % size)]);
    number /= size;
  }
  Material made = model_.materials[material];
  made.law = read_law(values, in_);
  return made;
}

#define LAHAR_INSTANTIATE(Dim)                                                                    \
  template std::optional<JsonValue> ScenarioBuilder<Dim>::take_fields(const JsonValue& material); \
  template void ScenarioBuilder<Dim>::split_fields();
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
