// The kinds of a field of a material: random fields, profiles over depth, and maps.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "io/scenario/interpolation.h"
#include "io/scenario/scenario_builder.h"
#include "io/schema/keys.h"
#include "physics/geometry/random_field.h"

namespace lahar {

namespace {

/// Standard deviations beyond which values of random fields are cut off.
constexpr double most_deviations = 4;

/// The k-th of n equal parts of [low, high], its middle.
double middle_of(int k, int n, double low, double high) {
  return low + (k + 0.5) / n * (high - low);
}

int part_of(double value, int n, double low, double high) {
  if (!(high > low)) return 0;
  return static_cast<int>(std::clamp(std::floor((value - low) / (high - low) * n), 0.0, n - 1.0));
}

/// The kinds of a field: the key that each needs, what it is, and the keys that it may have.
struct FieldKind {
  std::string_view key, what;
  std::vector<std::string> others;
};
const std::array<FieldKind, 3> field_kinds{{
    {"mean",
     "a random field",
     {"cov", "distribution", "correlation_length", "correlation", "seed", "min", "max", "classes"}},
    {"at_depth", "a profile", {"below", "classes"}},
    {"raster", "a map", {"min", "max", "classes"}},
}};

}  // namespace

/// The field under a key of a material; nothing if reported.
template <int Dim>
std::optional<MaterialField<Dim>> ScenarioBuilder<Dim>::field_of(const std::string& key,
                                                                 const JsonValue& given,
                                                                 const JsonValue& material) {
  const auto is_given = [&](const FieldKind& kind) { return written(given, kind.key); };
  const auto kind = std::find_if(field_kinds.begin(), field_kinds.end(), is_given);
  if (std::count_if(field_kinds.begin(), field_kinds.end(), is_given) != 1) {
    in_.error(given, fmt::format("'{}' needs one of 'mean', 'at_depth' and 'raster'", key),
              "mean, cov, correlation_length and seed make a random field; at_depth and below a "
              "profile; raster a map");
    return std::nullopt;
  }
  if (!given.find(kind->key)) return std::nullopt;  // a value of another kind, which is reported
  const std::string type(without_dimension(get_text(material, "type").value_or("")));
  const KeySpec& parameter = *materials_section().find(key, type);
  for (const auto& member : given.as<JsonValue::Object>()) {
    const auto& others = kind->others;
    const bool fits = member.key == kind->key ||
                      std::find(others.begin(), others.end(), member.key) != others.end();
    // Defaults of other kinds are there, too.
    if (fits || !member.value.valid() ||
        to_json(member.value) == parameter.section().find(member.key)->fallback)
      continue;
    in_.error(member.value, fmt::format("'{}' has no meaning in {}", member.key, kind->what),
              fmt::format("beside '{}' there may be {}", kind->key, join(others)));
    return std::nullopt;
  }
  if (kind->key == "mean") return random_field(given);
  if (kind->key == "at_depth") return profile(given);
  return mapped(given, parameter.unit);
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
  const auto surface = surface_under(given, "below");
  if (!surface) return std::nullopt;
  return Level([surface](const Vec<Dim>& x) {
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

// Both ends of the range are values of classes: where a map says 0, a parameter is 0.
template <int Dim>
std::optional<MaterialField<Dim>> ScenarioBuilder<Dim>::mapped(const JsonValue& given,
                                                               std::string_view unit) {
  const JsonValue& names = *given.find("raster");
  if (Dim == 2) {
    in_.error(names, "maps of parameters are for three dimensions",
              "in two dimensions divide the region, or take 'at_depth'");
    return std::nullopt;
  }
  const auto map = from_raster(names, unit).surface;
  if (!map) return std::nullopt;  // without a mesh, or after an error, which is reported
  const double least = get_number(given, "min").value_or(-std::numeric_limits<double>::infinity()),
               most = get_number(given, "max").value_or(std::numeric_limits<double>::infinity());
  const auto bounded = [=](double value) { return std::min(std::max(value, least), most); };
  double low = std::numeric_limits<double>::infinity(), high = -low, sum = 0;
  Index known = 0;
  for (const float value : map->heights()) {
    if (std::isnan(value)) continue;
    low = std::min(low, bounded(value)), high = std::max(high, bounded(value));
    sum += bounded(value), ++known;
  }
  const int n = high > low ? static_cast<int>(get_integer(given, "classes").value_or(64)) : 1;
  MaterialField<Dim> field{
      .key = "", .mean = sum / static_cast<double>(known), .values = {}, .class_of = {}};
  for (int k = 0; k < n; ++k) field.values.push_back(low + (high - low) * k / std::max(n - 1, 1));
  field.class_of = [=](const Vec<Dim>& x) {
    const double value = map->height(x);
    if (std::isnan(value)) return -1;
    if (n == 1) return 0;
    return static_cast<int>(std::lround((bounded(value) - low) / (high - low) * (n - 1)));
  };
  return field;
}

#define LAHAR_INSTANTIATE(Dim)                                               \
  template std::optional<MaterialField<Dim>> ScenarioBuilder<Dim>::field_of( \
      const std::string&, const JsonValue&, const JsonValue&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
