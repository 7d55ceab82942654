// Parameters of materials that differ from place to place (material_fields.h).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>

#include "io/scenario/law_reader.h"
#include "io/scenario/scenario_builder.h"
#include "io/schema/keys.h"
#include "physics/geometry/random_field.h"

namespace lahar {

namespace {

/// Standard deviations beyond which values of random fields are cut off.
constexpr double most_deviations = 4;
constexpr double most_classes_of_all = 20000;

/// The k-th of n equal parts of [low, high], its middle.
double middle_of(int k, int n, double low, double high) {
  return low + (k + 0.5) / n * (high - low);
}

int part_of(double value, int n, double low, double high) {
  if (!(high > low)) return 0;
  return static_cast<int>(std::clamp(std::floor((value - low) / (high - low) * n), 0.0, n - 1.0));
}

/// Linear between points of ascending first components, constant outside.
double interpolated(const std::vector<std::array<double, 2>>& points, double at) {
  const auto after = std::upper_bound(points.begin(), points.end(), at,
                                      [](double x, const auto& p) { return x < p[0]; });
  if (after == points.begin()) return points.front()[1];
  if (after == points.end()) return points.back()[1];
  const auto& [x0, y0] = *(after - 1);
  return y0 + (at - x0) / ((*after)[0] - x0) * ((*after)[1] - y0);
}

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
    const bool random = member.value.find("mean") != nullptr;
    const bool by_depth = member.value.find("at_depth") != nullptr;
    if (random == by_depth) {
      in_.error(member.value, fmt::format("'{}' needs either 'mean' or 'at_depth'", member.key),
                "mean, cov, correlation_length and seed make a random field; at_depth and below a "
                "profile");
      plain.find(member.key)->invalidate();
      continue;
    }
    auto field = random ? random_field(member.value) : profile(member.value);
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

template <int Dim>
std::optional<MaterialField<Dim>> ScenarioBuilder<Dim>::random_field(const JsonValue& given) {
  using Correlation = typename RandomField<Dim>::Correlation;
  const auto mean = get_number(given, "mean"), cov = get_number(given, "cov");
  const JsonValue* length = given.find("correlation_length");
  for (const char* key : {"cov", "correlation_length"})
    if (!written(given, key))
      in_.error(given, fmt::format("'{}' is missing in a random field", key));
  if (!mean || !cov || !length) return std::nullopt;
  const Vec<Dim> lengths = length->is_number() ? Vec<Dim>(Vec<Dim>::Constant(length->number()))
                                               : *get_vector<Dim>(given, "correlation_length");
  const bool lognormal = get_text(given, "distribution") != "normal";
  if (lognormal && !(*mean > 0)) {
    in_.error(*given.find("mean"),
              fmt::format("the mean of a log-normal field must be greater "
                          "than 0, found {:g}",
                          *mean),
              "\"distribution\": \"normal\" has values of both signs");
    return std::nullopt;
  }
  const int n = static_cast<int>(get_integer(given, "classes").value_or(64));
  const double least = get_number(given, "min").value_or(-std::numeric_limits<double>::infinity()),
               most = get_number(given, "max").value_or(std::numeric_limits<double>::infinity());
  const double s = std::sqrt(std::log1p(*cov * *cov));
  MaterialField<Dim> field{.key = "", .mean = *mean, .values = {}, .class_of = {}};
  for (int k = 0; k < n; ++k) {
    const double xi = middle_of(k, n, -most_deviations, most_deviations);
    const double value =
        lognormal ? *mean * std::exp(s * xi - 0.5 * s * s) : *mean + std::abs(*mean) * *cov * xi;
    field.values.push_back(std::clamp(value, least, std::max(least, most)));
  }
  const auto correlation = get_text(given, "correlation") == "exponential"
                               ? Correlation::exponential
                               : Correlation::gaussian;
  const auto seed = static_cast<std::uint64_t>(get_integer(given, "seed").value_or(0));
  const auto xi = std::make_shared<const RandomField<Dim>>(seed, lengths, correlation);
  field.class_of = [xi, n](const Vec<Dim>& x) {
    return part_of((*xi)(x), n, -most_deviations, most_deviations);
  };
  return field;
}

// Where a surface has no height, its depth is that of the first row.
template <int Dim>
std::optional<std::function<double(const Vec<Dim>&)>> ScenarioBuilder<Dim>::level_of(
    const JsonValue& given) {
  using Level = std::function<double(const Vec<Dim>&)>;
  if (const auto level = get_number(given, "below"))
    return Level([top = *level](const Vec<Dim>&) { return top; });
  const auto name = get_text(given, "below");
  if (!name) return std::nullopt;
  const auto found = geometry_.find(*name);
  if (found == geometry_.end() || (found->second.known() && !found->second.surface)) {
    in_.error(*given.find("below"),
              fmt::format("'below' must name a surface; '{}' is {}", *name,
                          found == geometry_.end() ? "not in geometry" : found->second.kind()),
              "geometry has surfaces from rasters, points and grids");
    return std::nullopt;
  }
  if (!found->second.surface) return std::nullopt;  // reported
  return Level([surface = found->second.surface](const Vec<Dim>& x) {
    const double height = surface->height(x);
    return std::isnan(height) ? -std::numeric_limits<double>::infinity() : height;
  });
}

template <int Dim>
std::optional<MaterialField<Dim>> ScenarioBuilder<Dim>::profile(const JsonValue& given) {
  const auto level = level_of(given);
  if (!written(given, "below"))
    in_.error(
        given, "'below' is missing beside 'at_depth'",
        "the level from which depths count, along the last axis [m], or a surface of geometry");
  const JsonValue* rows = given.find("at_depth");
  if (!level || !rows) return std::nullopt;
  std::vector<std::array<double, 2>> points;
  for (const JsonValue& row : rows->as<JsonValue::Array>()) {
    const auto& pair = row.as<JsonValue::Array>();
    points.push_back({pair[0].number(), pair[1].number()});
  }
  const auto ascending = [](const auto& a, const auto& b) { return a[0] >= b[0]; };
  if (points.empty() ||
      std::adjacent_find(points.begin(), points.end(), ascending) != points.end()) {
    in_.error(*rows, "depths of 'at_depth' must be ascending",
              "[[0, 1e7], [10, 5e7]]: rows of a depth [m] and the value there");
    return std::nullopt;
  }
  const auto by_value = [](const auto& a, const auto& b) { return a[1] < b[1]; };
  const auto [lowest, highest] = std::minmax_element(points.begin(), points.end(), by_value);
  const double low = (*lowest)[1], high = (*highest)[1];
  const int n = high > low ? static_cast<int>(get_integer(given, "classes").value_or(64)) : 1;
  MaterialField<Dim> field{.key = "", .mean = 0.5 * (low + high), .values = {}, .class_of = {}};
  for (int k = 0; k < n; ++k) field.values.push_back(middle_of(k, n, low, high));
  field.class_of = [=, top = *level](const Vec<Dim>& x) {
    return part_of(interpolated(points, top(x) - x[Dim - 1]), n, low, high);
  };
  return field;
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
    const JsonValue* resume = section("analysis").find("resume");
    if (resume && get_bool(*resume, "resume").value_or(false))
      refuse(m, "particles of an earlier run", "where they were at its beginning is not known");
  }
}

// Classes are numbered in the order of their material and their values, whoever has particles of
// them. The first class of a material takes its place.
template <int Dim>
void ScenarioBuilder<Dim>::split_fields() {
  if (std::all_of(fields_.begin(), fields_.end(), [](const auto& f) { return f.empty(); })) return;
  refuse_fields();
  if (!in_.problems.empty()) return;
  auto& particles = model_.particles;
  const std::size_t n = fields_.size();
  const auto fields_of = [&](std::size_t material) -> const auto& {
    return fields_[material % n];
  };
  std::vector<ClassOf> classes(particles.x.size());
  std::vector<ClassOf> used;
  for (std::size_t p = 0; p < particles.x.size(); ++p) {
    const std::size_t material = particles.material[p];
    if (fields_of(material).empty()) continue;
    Index number = 0;
    for (const auto& field : fields_of(material))
      number = number * static_cast<Index>(field.values.size()) + field.class_of(particles.x[p]);
    classes[p] = {static_cast<Index>(material), number};
    if (used.empty() || used.back() != classes[p]) used.push_back(classes[p]);
  }
  const auto sort_once = [](auto& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  sort_once(used);
  used = joined(team_.gather(used));
  sort_once(used);
  if (static_cast<double>(used.size() + model_.materials.size()) > most_classes_of_all)
    return in_.error(*root_.find("materials"),
                     fmt::format("fields of materials have {} different values together; at most "
                                 "{:g} are possible",
                                 used.size(), most_classes_of_all),
                     "give fields that belong together the same 'seed', or fewer 'classes'");
  std::map<ClassOf, std::uint16_t> place;
  Index last = -1;
  for (const auto& one : used) {
    const auto material = static_cast<std::size_t>(one.material);
    const Material made = material_of_class(material, one.number);
    if (!in_.problems.empty()) return;
    std::size_t at = material;
    if (one.material == last) {
      at = model_.materials.size();
      model_.materials.push_back(made);
    } else {
      model_.materials[at] = made;
    }
    last = one.material;
    place[one] = static_cast<std::uint16_t>(at);
  }
  std::uint64_t sum = 0;
  for (std::size_t p = 0; p < classes.size(); ++p) {
    if (classes[p].material < 0) continue;
    particles.material[p] = place.at(classes[p]);
    sum += hash_of(particles.id_of(p), particles.material[p]);
  }
  for (const Index share : team_.each(static_cast<Index>(sum)))
    in_.classes += static_cast<std::uint64_t>(share);
  in_.classes |= 1;  // there are some
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
