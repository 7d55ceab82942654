#include "io/frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace lahar {

const FrameColumn* Frame::find(std::string_view name) const {
  const auto it = std::find_if(columns.begin(), columns.end(),
                               [&](const FrameColumn& column) { return column.name == name; });
  return it == columns.end() ? nullptr : &*it;
}

FrameStream stream_of(const Frame& frame) {
  FrameStream stream;
  stream.header.step = frame.step;
  stream.header.time = frame.time;
  stream.header.dim = frame.dim;
  for (const FrameColumn& column : frame.columns)
    stream.header.columns.push_back({column.name, column.unit, column.components, {}});
  stream.size = frame.size();
  stream.id = [&frame](Index first, Index) { return frame.id.data() + first; };
  if (!frame.material.empty() || frame.id.empty())
    stream.material = [&frame](Index first, Index) { return frame.material.data() + first; };
  stream.coordinates = [&frame](Index first, Index) {
    return frame.coordinates.data() + first * frame.dim;
  };
  stream.values = [&frame](std::size_t k, Index first, Index) {
    return frame.columns[k].values.data() + first * frame.columns[k].components;
  };
  return stream;
}

std::span<const char* const> component_names(int components) {
  static constexpr const char* vector[] = {"x", "y", "z"};
  static constexpr const char* tensor[] = {"xx", "yy", "zz", "xy", "yz", "xz"};
  if (components == 6) return tensor;
  if (components == 2 || components == 3) return std::span(vector).first(components);
  return {};
}

bool is_state_variable(const FrameColumn& column) {
  if (column.components != 1 || column.name == "mass" || column.name == "volume") return false;
  return column.name.starts_with("svars_") || !column.unit.empty();
}

std::vector<std::string> state_variable_names(const Frame& frame) {
  std::vector<std::string> names;
  int next = 0;
  for (const FrameColumn& column : frame.columns) {
    if (!is_state_variable(column))
      names.emplace_back();
    else if (column.name.starts_with("svars_"))
      names.push_back(column.name);
    else
      names.push_back(fmt::format("svars_{}", next++));
  }
  return names;
}

void check_consistent(const Frame& frame) {
  const auto expect = [](const std::string& name, std::size_t found, std::size_t expected) {
    if (found != expected)
      throw std::logic_error(
          fmt::format("frame: {} has {} values instead of {}", name, found, expected));
  };
  const std::size_t n = frame.id.size();
  expect("coordinates", frame.coordinates.size(), n * frame.dim);
  if (!frame.material.empty()) expect("material", frame.material.size(), n);
  for (const FrameColumn& column : frame.columns)
    expect(column.name, column.values.size(), n * column.components);
}

}  // namespace lahar
