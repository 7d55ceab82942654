#include "runtime/picture/frame_field.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "io/base/text.h"
#include "physics/base/error.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

namespace {

using Names = std::vector<std::string>;

const DerivedField* derived_named(std::string_view name) {
  const auto* found = std::find_if(derived_fields.begin(), derived_fields.end(),
                                   [&](const DerivedField& f) { return f.name == name; });
  return found == derived_fields.end() ? nullptr : &*found;
}

Names columns_of(const DerivedField& derived) {
  Names columns;
  std::istringstream words{std::string(derived.columns)};
  for (std::string word; words >> word;) columns.push_back(word);
  return columns;
}

bool has(const FrameHeader& header, const std::string& name) {
  return std::any_of(header.columns.begin(), header.columns.end(),
                     [&](const FrameColumn& c) { return c.name == name; });
}

bool follows(const DerivedField& derived, const FrameHeader& header) {
  const Names columns = columns_of(derived);
  return derived.components == 1 && !columns.empty() &&
         std::all_of(columns.begin(), columns.end(),
                     [&](const std::string& column) { return has(header, column); });
}

/// A component of a column: which one.
struct Part {
  const FrameColumn* column = nullptr;
  int component = -1;  ///< -1: the scalar, or the magnitude of a vector
};

Part part_named(const std::vector<FrameColumn>& columns, std::string_view name) {
  for (const FrameColumn& column : columns) {
    if (column.name == name && column.components < 6) return {&column, -1};
    const auto suffixes = component_names(column.components);
    for (std::size_t k = 0; k < suffixes.size(); ++k)
      if (name == column.name + "_" + suffixes[k]) return {&column, static_cast<int>(k)};
  }
  return {};
}

[[noreturn]] void refuse(const FrameHeader& header, const std::string& name) {
  throw InputError(
      {Problem{.message = fmt::format("this frame has no field '{}'", name),
               .hint = fmt::format("it has {}", fmt::join(field_names(header), ", "))}});
}

/// Throws where there is none of this name that follows from the columns.
const DerivedField& derived_for(const FrameHeader& header, const std::string& name) {
  const DerivedField* derived = derived_named(name);
  if (!derived || !follows(*derived, header)) refuse(header, name);
  return *derived;
}

FrameField part_of(const Part& part, std::size_t n) {
  const FrameColumn& column = *part.column;
  const auto components = static_cast<std::size_t>(column.components);
  FrameField field{
      .label = readable(column.name), .unit = column.unit, .values = std::vector<double>(n)};
  if (part.component >= 0) {
    field.label += fmt::format(
        " {}", component_names(column.components)[static_cast<std::size_t>(part.component)]);
    for (std::size_t p = 0; p < n; ++p)
      field.values[p] = column.values[components * p + static_cast<std::size_t>(part.component)];
  } else if (components == 1) {
    field.values = column.values;
  } else {
    for (std::size_t p = 0; p < n; ++p) {
      double sum = 0;
      for (std::size_t k = 0; k < components; ++k)
        sum += column.values[components * p + k] * column.values[components * p + k];
      field.values[p] = std::sqrt(sum);
    }
  }
  return field;
}

FrameField derived_of(const Frame& frame, const DerivedField& derived) {
  const auto n = static_cast<std::size_t>(frame.size());
  FrameField field{.label = readable(derived.name),
                   .unit = std::string(derived.unit),
                   .values = std::vector<double>(n)};
  const FrameColumn *mass = frame.find("mass"), *volume = frame.find("volume"),
                    *velocity = frame.find("velocity"), *stress = frame.find("stress"),
                    *strain = frame.find("strain"), *pore = frame.find("pore_pressure");
  const auto fill = [](const FrameColumn* column, std::size_t p, auto& to) {
    if (!column) return;
    const auto components = static_cast<std::size_t>(column->components);
    for (std::size_t k = 0; k < components; ++k) to[k] = column->values[components * p + k];
  };
  for (std::size_t p = 0; p < n; ++p) {
    ParticleValues values;
    if (mass) values.mass = mass->values[p];
    if (volume) values.volume = volume->values[p];
    if (pore) values.pore_pressure = pore->values[p];
    fill(velocity, p, values.v);
    fill(stress, p, values.stress);
    fill(strain, p, values.strain);
    derived.value(values, &field.values[p]);
  }
  return field;
}

}  // namespace

std::vector<std::string> field_names(const FrameHeader& header) {
  Names names;
  for (const FrameColumn& column : header.columns) {
    if (column.components < 6) names.push_back(column.name);
    for (const char* suffix : component_names(column.components))
      names.push_back(column.name + "_" + suffix);
  }
  for (const DerivedField& derived : derived_fields)
    if (follows(derived, header) && !has(header, std::string(derived.name)))
      names.emplace_back(derived.name);
  return names;
}

std::vector<std::string> columns_of_field(const FrameHeader& header, const std::string& name) {
  if (const Part part = part_named(header.columns, name); part.column) return {part.column->name};
  return columns_of(derived_for(header, name));
}

FrameField field_of(const Frame& frame, const std::string& name) {
  if (const Part part = part_named(frame.columns, name); part.column)
    return part_of(part, static_cast<std::size_t>(frame.size()));
  return derived_of(frame, derived_for(header_of(frame), name));
}

}  // namespace lahar
