#include "io/results/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <fstream>
#include <limits>
#include <numeric>

#include "io/frames/csv.h"
#include "io/frames/vtkhdf.h"
#include "io/run/run_folder.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

constexpr std::size_t ids_shown = 5;

/// A field of one side.
struct Field {
  std::string name, unit;
  int components;
  const double* values;
  bool required;  ///< must exist on both sides
  double floor;   ///< below this all is noise, where the tolerances allow as much
  bool exact;
};

std::vector<Field> fields_of(const Frame& frame, const std::vector<double>& material) {
  static constexpr std::array required = {"mass",     "volume", "displacement",
                                          "velocity", "stress", "strain"};
  std::vector<Field> fields;
  if (!frame.coordinates.empty())
    fields.push_back({"coordinates", "m", frame.dim, frame.coordinates.data(), true, 0, false});
  const std::vector<std::string> state = state_variable_names(frame);
  for (std::size_t k = 0; k < frame.columns.size(); ++k) {
    const FrameColumn& column = frame.columns[k];
    const bool is_state = !state[k].empty();
    const bool named = std::find(required.begin(), required.end(), column.name) != required.end();
    const bool positive = column.name == "mass" || column.name == "volume";
    const double floor = positive                  ? 0
                         : column.name == "strain" ? strain_floor
                                                   : std::numeric_limits<double>::max();
    fields.push_back({is_state ? state[k] : column.name, column.unit, column.components,
                      column.values.data(), named || is_state, floor, false});
  }
  if (!frame.material.empty())
    fields.push_back({"material", "-", 1, material.data(), false, 0, true});
  return fields;
}

const Field* find_field(const std::vector<Field>& fields, const std::string& name) {
  for (const Field& field : fields)
    if (field.name == name) return &field;
  return nullptr;
}

/// Components that are columns of their own, as in tables, become the field that they are in the
/// other frame. Values of such fields are put into `kept`.
void join_components(std::vector<Field>& fields, const std::vector<Field>& other, std::size_t rows,
                     std::deque<std::vector<double>>& kept) {
  for (const Field& whole : other) {
    const auto components = static_cast<std::size_t>(whole.components);
    if (components == 1 || find_field(fields, whole.name)) continue;
    const auto suffixes = component_names(whole.components);
    std::vector<std::string> names;
    std::vector<const double*> columns;
    for (std::size_t k = 0; k < components; ++k) {
      names.push_back(whole.name + '_' + (suffixes.empty() ? std::to_string(k) : suffixes[k]));
      if (const Field* one = find_field(fields, names.back()); one && one->components == 1)
        columns.push_back(one->values);
    }
    if (columns.size() < components) continue;
    std::vector<double>& values = kept.emplace_back(rows * components);
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t k = 0; k < components; ++k) values[i * components + k] = columns[k][i];
    std::erase_if(fields, [&](const Field& field) {
      return std::find(names.begin(), names.end(), field.name) != names.end();
    });
    Field joined = whole;
    joined.values = values.data();
    fields.push_back(joined);
  }
}

/// Rows of the same particle on both sides.
struct Match {
  Index id;
  std::size_t a, b;
};

/// Rows in the order of their ids, each id once.
std::vector<std::size_t> rows_by_id(const Frame& frame, const std::string& name,
                                    Comparison& result) {
  std::vector<std::size_t> rows(frame.id.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  const auto less = [&](std::size_t a, std::size_t b) { return frame.id[a] < frame.id[b]; };
  if (!std::is_sorted(frame.id.begin(), frame.id.end()))
    std::stable_sort(rows.begin(), rows.end(), less);
  const auto same = [&](std::size_t a, std::size_t b) { return frame.id[a] == frame.id[b]; };
  if (const auto twice = std::adjacent_find(rows.begin(), rows.end(), same); twice != rows.end())
    result.problems.push_back(
        fmt::format("{} has particle {} more than once", name, frame.id[*twice]));
  rows.erase(std::unique(rows.begin(), rows.end(), same), rows.end());
  return rows;
}

void add_missing(MissingIds& missing, Index id) {
  if (missing.count++ < static_cast<Index>(ids_shown)) missing.first.push_back(id);
}

std::vector<Match> match(const Frame& a, const Frame& b, Comparison& result) {
  const std::vector<std::size_t> rows_a = rows_by_id(a, "A", result);
  const std::vector<std::size_t> rows_b = rows_by_id(b, "B", result);
  std::vector<Match> matches;
  matches.reserve(std::min(rows_a.size(), rows_b.size()));
  auto i = rows_a.begin(), j = rows_b.begin();
  while (i != rows_a.end() || j != rows_b.end()) {
    if (j == rows_b.end() || (i != rows_a.end() && a.id[*i] < b.id[*j])) {
      add_missing(result.only_in_a, a.id[*i++]);
    } else if (i == rows_a.end() || b.id[*j] < a.id[*i]) {
      add_missing(result.only_in_b, b.id[*j++]);
    } else {
      matches.push_back({a.id[*i], *i, *j});
      ++i, ++j;
    }
  }
  return matches;
}

void judge(FieldDifference& d, const Field& field, const Tolerances& tolerances) {
  using Verdict = FieldDifference::Verdict;
  const double floor = std::min(field.floor, tolerances.floor);
  d.floored = floor > 0 && d.scale <= floor;
  d.relative = d.absolute == 0 ? 0 : d.absolute / d.scale;
  const bool within = d.absolute <= tolerances.atol || d.absolute <= tolerances.rtol * d.scale ||
                      (d.floored && d.absolute <= floor);
  if (d.not_finite > 0)
    d.verdict = Verdict::differs;
  else if (d.absolute == 0)
    d.verdict = Verdict::same;
  else
    d.verdict = within && !field.exact ? Verdict::within : Verdict::differs;
}

FieldDifference difference(const Field& a, const Field& b, const std::vector<Match>& matches,
                           const Tolerances& tolerances) {
  FieldDifference d;
  d.name = b.name;
  d.unit = b.unit.empty() ? a.unit : b.unit;
  int component = -1;
  for (const Match& m : matches) {
    const double* va = a.values + m.a * static_cast<std::size_t>(a.components);
    const double* vb = b.values + m.b * static_cast<std::size_t>(b.components);
    for (int k = 0; k < a.components; ++k) {
      if (std::isfinite(vb[k])) d.scale = std::max(d.scale, std::abs(vb[k]));
      const bool finite = std::isfinite(va[k]) && std::isfinite(vb[k]);
      const double difference = finite ? std::abs(va[k] - vb[k]) : 0;
      // The first NaN is what a reader wants to see, else the largest difference.
      if (finite ? d.not_finite == 0 && difference > d.absolute : d.not_finite == 0) {
        d.at = m.id;
        component = k;
      }
      d.absolute = std::max(d.absolute, difference);
      if (!finite) ++d.not_finite;
    }
  }
  if (component >= 0 && !component_names(a.components).empty())
    d.component = component_names(a.components)[static_cast<std::size_t>(component)];
  judge(d, b, tolerances);
  return d;
}

FieldDifference missing_field(const Field& field) {
  FieldDifference d;
  d.name = field.name;
  d.unit = field.unit;
  d.verdict = FieldDifference::Verdict::missing;
  return d;
}

void compare_fields(const std::vector<Field>& a, const std::vector<Field>& b,
                    const std::vector<Match>& matches, Comparison& result) {
  const auto one_sided = [&](const Field& field, const char* side) {
    if (field.required) {
      result.fields.push_back(missing_field(field));
      result.problems.push_back(fmt::format("{} is only in {}", field.name, side));
    } else {
      result.notes.push_back(fmt::format("not compared: {} (only in {})", field.name, side));
    }
  };
  for (const Field& field : b) {
    const Field* other = find_field(a, field.name);
    if (!other) {
      one_sided(field, "B");
    } else if (other->components != field.components) {
      result.fields.push_back(missing_field(field));
      result.problems.push_back(fmt::format("{} has {} components in A and {} in B", field.name,
                                            other->components, field.components));
    } else {
      result.fields.push_back(difference(*other, field, matches, result.tolerances));
    }
  }
  for (const Field& field : a)
    if (!find_field(b, field.name)) one_sided(field, "A");
}

bool is_hdf5(const std::filesystem::path& file) {
  char bytes[4] = {};
  std::ifstream(file, std::ios::binary).read(bytes, sizeof bytes);
  return std::string_view(bytes, sizeof bytes) == "\x89HDF";
}

/// What a person calls this state.
std::string describe(const std::filesystem::path& source, const Frame& frame) {
  if (!std::filesystem::is_directory(source)) return source.string();
  return fmt::format("{}, step {}, t = {} s", source.string(), frame.step, frame.time);
}

}  // namespace

Comparison compare(const Frame& a, const Frame& b, const Tolerances& tolerances) {
  check_consistent(a);
  check_consistent(b);
  Comparison result;
  result.tolerances = tolerances;
  result.count_a = a.size();
  result.count_b = b.size();
  const std::vector<Match> matches = match(a, b, result);
  result.matched = static_cast<Index>(matches.size());
  const std::vector<double> material_a(a.material.begin(), a.material.end());
  const std::vector<double> material_b(b.material.begin(), b.material.end());
  std::vector<Field> fields_a = fields_of(a, material_a), fields_b = fields_of(b, material_b);
  std::deque<std::vector<double>> kept;
  join_components(fields_a, fields_b, a.id.size(), kept);
  join_components(fields_b, fields_a, b.id.size(), kept);
  compare_fields(fields_a, fields_b, matches, result);
  const bool fields_pass =
      std::all_of(result.fields.begin(), result.fields.end(), [](const FieldDifference& d) {
        return d.verdict == FieldDifference::Verdict::same ||
               d.verdict == FieldDifference::Verdict::within;
      });
  result.passed = fields_pass && result.problems.empty() && result.only_in_a.count == 0 &&
                  result.only_in_b.count == 0;
  return result;
}

Frame read_particles(const std::filesystem::path& source, std::optional<Index> step) {
  const FrameFile frame = find_frame(source, step);
  Frame particles = is_hdf5(frame.file) ? read_frame(frame.file) : read_csv(frame.file);
  if (particles.coordinates.empty() && particles.size() > 0)
    throw InputError({Problem{.file = frame.file.string(),
                              .line = 1,
                              .message = "there are no columns 'coord_x' and 'coord_y'",
                              .hint = "a table of particles has the columns that `lahar export "
                                      "--to csv` writes"}});
  return particles;
}

Comparison compare(const std::filesystem::path& a, const std::filesystem::path& b,
                   const Tolerances& tolerances, std::optional<Index> step) {
  const Frame frame_a = read_particles(a, step), frame_b = read_particles(b, step);
  Comparison result = compare(frame_a, frame_b, tolerances);
  result.name_a = describe(a, frame_a);
  result.name_b = describe(b, frame_b);
  return result;
}

}  // namespace lahar
