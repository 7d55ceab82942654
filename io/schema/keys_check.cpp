// Checking an object against its key table.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/schema/keys.h"

namespace lahar {

namespace {

using Array = JsonValue::Array;
using Object = JsonValue::Object;

bool integral(const JsonValue& v) {
  constexpr double most = 9.2e18;  // fits into 64 bits
  if (v.is<std::int64_t>()) return true;
  return v.is<double>() && std::floor(v.as<double>()) == v.as<double>() &&
         std::abs(v.as<double>()) < most;
}

template <class Test>
bool all_of(const JsonValue& v, Test test) {
  if (!v.is<Array>()) return false;
  const auto& items = v.as<Array>();
  return std::all_of(items.begin(), items.end(), test);
}

bool is_id(const JsonValue& v) {
  return integral(v) || v.is<std::string>();
}
bool is_number(const JsonValue& v) {
  return v.is_number();
}
bool is_text(const JsonValue& v) {
  return v.is<std::string>();
}
bool is_point(const JsonValue& v) {
  return all_of(v, is_number) && v.as<Array>().size() == 2;
}
bool is_direction(const JsonValue& v, int most = 2) {
  if (v.is<std::string>()) {
    const auto& s = v.as<std::string>();
    return s == "x" || s == "y" || s == "z";
  }
  return integral(v) && v.number() >= 0 && v.number() <= most;
}

std::size_t size_of(const JsonValue& v) {
  return v.is<Array>() ? v.as<Array>().size() : 0;
}

// The one kind of the key that this value has; 0 if none.
unsigned matching_kind(const KeySpec& spec, const JsonValue& v, int dim) {
  const auto length = static_cast<std::size_t>(dim);
  const auto fits = [&](unsigned kind) {
    switch (kind) {
      case boolean:
        return v.is<bool>();
      case integer:
        return integral(v);
      case number:
        return v.is_number();
      case text:
        return v.is<std::string>();
      case file:
        return v.is<std::string>();
      case vector:
        return all_of(v, is_number) && size_of(v) == length;
      case cell_counts:
        return all_of(v, integral) && size_of(v) == length;
      case numbers:
        return all_of(v, is_number);
      case texts:
        return all_of(v, is_text);
      case object:
        return v.is<Object>();
      case list:
        return all_of(v, [](const JsonValue& i) { return i.is<Object>(); });
      case map:
        return v.is<Object>();
      case id:
        return is_id(v);
      case ids:
        return all_of(v, is_id);
      case direction:
        return is_direction(v);
      case phase_direction:
        return is_direction(v, 5);
      case points:
        return all_of(v, is_point);
      case places:
        return all_of(
            v, [&](const JsonValue& i) { return all_of(i, is_number) && size_of(i) == length; });
      default:
        return false;
    }
  };
  for (unsigned kind = 1; kind < any; kind <<= 1)
    if ((spec.kinds & kind) && fits(kind)) return kind;
  return 0;
}

std::string quoted_list(const std::vector<std::string_view>& words) {
  std::vector<std::string> quoted;
  for (const auto w : words) quoted.push_back(json_quoted(w));
  return join(quoted);
}

std::vector<std::string> strings(const std::vector<std::string_view>& words) {
  return {words.begin(), words.end()};
}

bool one_of(std::string_view word, const std::vector<std::string_view>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// What is allowed; a very large upper bound only where it is what is exceeded.
std::string bounds(const KeySpec& spec, double found) {
  constexpr double very_large = 1e8;
  const bool low = std::isfinite(spec.min);
  const bool high = std::isfinite(spec.max) && (spec.max < very_large || found >= spec.max);
  std::string out;
  if (low) out += fmt::format("{} {}", spec.above_min ? "greater than" : "at least", spec.min);
  if (low && high) out += " and ";
  if (high) out += fmt::format("{} {}", spec.below_max ? "less than" : "at most", spec.max);
  return out;
}

class Checker {
 public:
  Checker(int dim, JsonDocument& document, ProblemList& problems)
      : dim_(dim), document_(document), problems_(problems) {}

  void section(const Section& section, JsonValue& value) {
    auto& members = std::get<Object>(value.data);
    const std::string variant = variant_of(section, value);
    std::vector<std::string> misspelt;
    for (auto& member : members) {
      const KeySpec* spec = section.find(member.key, variant);
      if (!spec)
        misspelt.push_back(unknown(section, variant, value, member));
      else if (!spec->applies(variant))
        misplaced(section, *spec, variant, value, member);
      else
        check(section, *spec, value, member);
    }
    // A misspelt key is there, if only to say that it is not missing as well.
    for (auto& key : misspelt)
      if (!key.empty()) members.push_back({std::move(key), value.offset, {}});
    for (const KeySpec& spec : section.keys)
      if (spec.applies(variant)) fill_in(section, spec, value);
  }

 private:
  // The discriminator's value without dimension; empty where it is missing or bad.
  std::string variant_of(const Section& section, const JsonValue& value) const {
    const JsonValue* type =
        section.discriminator.empty() ? nullptr : value.find(section.discriminator);
    if (!type || !type->is<std::string>()) return "";
    std::string_view name = type->as<std::string>();
    if (section.dimension_suffix) name = without_dimension(name);
    return std::string(name);
  }

  void error(const JsonValue& at, std::string message, std::string hint = "") {
    problems_.error(document_.at(at, std::move(message), std::move(hint)));
  }

  // Returns the key that was probably meant, or "".
  std::string unknown(const Section& section, const std::string& variant, const JsonValue& object,
                      JsonValue::Member& member) {
    std::vector<std::string> keys;
    for (const KeySpec& spec : section.keys)
      if (spec.applies(variant) && spec.support != Support::older) keys.emplace_back(spec.key);
    problems_.error(document_.at_key(
        object, member, fmt::format("unknown key '{}' in {}", member.key, section.name),
        suggest(member.key, keys, "known keys")));
    member.value.invalidate();
    return nearest(member.key, keys);
  }

  // A key of another variant; says nothing more where the variant itself is unknown.
  void misplaced(const Section& section, const KeySpec& spec, const std::string& variant,
                 const JsonValue& object, JsonValue::Member& member) {
    const KeySpec* type = section.find(section.discriminator);
    std::vector<std::string_view> owners;
    for (const KeySpec& other : section.keys)
      if (other.key == spec.key && other.support != Support::older)
        owners.insert(owners.end(), other.only.begin(), other.only.end());
    if (one_of(variant, type->allowed))
      problems_.error(document_.at_key(
          object, member,
          fmt::format("'{}' does not apply to {} of type \"{}\"", spec.key, section.name, variant),
          fmt::format("it belongs to {}", quoted_list(owners))));
    member.value.invalidate();
  }

  void check(const Section& section, const KeySpec& spec, const JsonValue& object,
             JsonValue::Member& member) {
    JsonValue& value = member.value;
    if (!value.valid()) return;
    if (spec.support == Support::ignored) {
      problems_.warning(document_.at_key(
          object, member, fmt::format("'{}' is ignored in {}", spec.key, section.name),
          "the reference code ignores it too"));
    } else if (spec.support == Support::planned) {
      problems_.error(
          document_.at_key(object, member, fmt::format("'{}' is not supported yet", spec.key)));
    } else if (spec.support == Support::older && !spec.instead.empty() &&
               object.find(spec.instead)) {
      problems_.warning(document_.at_key(
          object, member, fmt::format("'{}' is ignored: '{}' counts", spec.key, spec.instead)));
    } else if (spec.support == Support::older) {
      problems_.error(document_.at_key(
          object, member,
          fmt::format("'{}' in {} is of an older format, which CB-Geo MPM does not read any more",
                      spec.key, section.name),
          std::string(spec.help)));
    }
    if (spec.kinds == any) return value.invalidate();
    const unsigned kind = matching_kind(spec, value, dim_);
    if (kind == 0) return wrong_kind(spec, value);
    if (spec.planned_kinds & kind)
      error(value, fmt::format("'{}' as {} is not supported yet", spec.key,
                               kind == object_kind ? "an object" : "this kind of value"));
    check_value(section, spec, value, kind);
    if (spec.planned_kinds & kind) value.invalidate();
  }

  void wrong_kind(const KeySpec& spec, JsonValue& value) {
    error(value,
          fmt::format("'{}' must be {}, found {}", spec.key, allowed_kinds(spec, dim_),
                      describe(value)),
          hint_of_length(spec, value));
    value.invalidate();
  }

  // Vectors of the other dimension.
  std::string hint_of_length(const KeySpec& spec, const JsonValue& value) const {
    if (!(spec.kinds & (vector | cell_counts)) || !all_of(value, is_number)) return "";
    if (size_of(value) != 2 && size_of(value) != 3) return "";
    if (dim_ == 2)
      return spec.key == "gravity" ? "the case has two dimensions, y is up: [0, -9.81]"
                                   : "the case has two dimensions: [x, y]";
    return spec.key == "gravity" ? "the case has three dimensions: [0, 0, -9.81] if z is up"
                                 : "the case has three dimensions: [x, y, z]";
  }

  void check_value(const Section& section, const KeySpec& spec, JsonValue& value, unsigned kind) {
    switch (kind) {
      case integer:
      case id:
      case number:
        return check_bounds(spec, value);
      case vector:
      case cell_counts: {
        for (auto& item : std::get<Array>(value.data)) check_bounds(spec, item);
        return invalidate_with_items(value);
      }
      case boolean:
      case text:
        return check_text(section, spec, value);
      case object:
        return this->section(spec.section(), value);
      case list:
        for (auto& item : std::get<Array>(value.data)) this->section(spec.section(), item);
        return;
      case map:
        for (auto& m : std::get<Object>(value.data)) {
          if (m.value.is<Object>()) {
            this->section(spec.section(), m.value);
          } else {
            error(m.value,
                  fmt::format("'{}' must be an object, found {}", m.key, describe(m.value)));
            m.value.invalidate();
          }
        }
        return;
      default:
        return;
    }
  }

  static void invalidate_with_items(JsonValue& value) {
    if (!all_of(value, [](const JsonValue& i) { return i.valid(); })) value.invalidate();
  }

  void check_bounds(const KeySpec& spec, JsonValue& value) {
    if (!value.is_number()) return;  // a name
    const double x = value.number();
    const bool low = spec.above_min ? x <= spec.min : x < spec.min;
    const bool high = spec.below_max ? x >= spec.max : x > spec.max;
    if (!low && !high) return;
    error(value,
          fmt::format("'{}' must be {}{}, found {}", spec.key, bounds(spec, x),
                      spec.unit.empty() || spec.unit == "-" ? "" : fmt::format(" [{}]", spec.unit),
                      to_json(value)),
          spec.key == "poisson_ratio" && x == spec.max
              ? "no volume changes then, and the bulk modulus is infinite: take 0.49 and "
                "\"b_bar\": true in analysis"
              : "");
    value.invalidate();
  }

  void check_text(const Section& section, const KeySpec& spec, JsonValue& value) {
    if (spec.allowed.empty() && spec.planned.empty()) return;
    const bool flag = value.is<bool>();
    const std::string word = flag ? to_json(value) : value.as<std::string>();
    std::string_view name = word;
    const bool typed = section.dimension_suffix && spec.key == section.discriminator;
    if (typed) name = without_dimension(name);
    if (one_of(name, spec.planned)) {
      std::vector<std::string> now = strings(spec.allowed);
      error(value, fmt::format("'{}': {} is not supported yet", spec.key, to_json(value)),
            now.empty() ? "" : "supported: " + join(now));
      // A generator or material keeps its type, so that its other keys are checked as well.
      if (spec.key != section.discriminator) value.invalidate();
      return;
    }
    if (flag) return;
    if (one_of(name, spec.allowed)) return;
    auto candidates = strings(spec.allowed);
    for (const auto p : spec.planned) candidates.emplace_back(p);
    const std::string near = nearest(name, candidates);
    error(value,
          fmt::format("'{}' must be {}{}{}, found {}", spec.key,
                      (spec.kinds & number) ? "a number or " : "",
                      spec.allowed.size() > 1 ? "one of " : "", quoted_list(spec.allowed),
                      to_json(value)),
          near.empty() ? "" : fmt::format("did you mean \"{}\"?", near));
    value.invalidate();
  }

  void fill_in(const Section& section, const KeySpec& spec, JsonValue& value) {
    auto& members = std::get<Object>(value.data);
    if (std::any_of(members.begin(), members.end(),
                    [&](const auto& m) { return m.key == spec.key; }))
      return;
    if (spec.required) {
      std::string unit = spec.unit.empty() ? "" : fmt::format(" [{}]", spec.unit);
      error(value, fmt::format("'{}' is missing in {}", spec.key, section.name),
            fmt::format("{}{}: {}", spec.key, unit, spec.help));
      return;
    }
    if (spec.fallback.empty()) return;
    const bool other = dim_ == 3 && !spec.fallback_3d.empty();
    JsonValue fresh = parse_json_literal(other ? spec.fallback_3d : spec.fallback);
    fresh.source = value.source;
    fresh.offset = value.offset;
    fresh.defaulted = true;
    if (fresh.is<Object>()) this->section(spec.section(), fresh);
    members.push_back({std::string(spec.key), value.offset, std::move(fresh)});
  }

  static constexpr unsigned object_kind = object;
  int dim_;
  JsonDocument& document_;
  ProblemList& problems_;
};

}  // namespace

void check_section(const Section& section, JsonValue& object, int dim, JsonDocument& document,
                   ProblemList& problems) {
  Checker(dim, document, problems).section(section, object);
}

}  // namespace lahar
