#include "io/frames/frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "physics/particles/columns.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

const FrameColumn* Frame::find(std::string_view name) const {
  const auto it = std::find_if(columns.begin(), columns.end(),
                               [&](const FrameColumn& column) { return column.name == name; });
  return it == columns.end() ? nullptr : &*it;
}

FrameHeader header_of(const Frame& frame) {
  FrameHeader header;
  header.step = frame.step;
  header.time = frame.time;
  header.dim = frame.dim;
  header.material = !frame.material.empty() || frame.id.empty();
  for (const FrameColumn& column : frame.columns)
    header.columns.push_back({column.name, column.unit, column.components, {}});
  return header;
}

Frame SparePieces::take(std::size_t i) {
  Frame piece;
  {
    const std::lock_guard lock(mutex_);
    if (i >= pieces_.size() || pieces_[i].empty()) return piece;
    piece = std::move(pieces_[i].back());
    pieces_[i].pop_back();
  }
  piece.id.clear();
  piece.coordinates.clear();
  piece.material.clear();
  for (FrameColumn& column : piece.columns) column.values.clear();
  return piece;
}

void SparePieces::give(std::vector<Frame>&& pieces) {
  const std::lock_guard lock(mutex_);
  pieces_.resize(pieces.size());  // patches were made or have moved: memory of others is freed
  for (std::size_t i = 0; i < pieces.size(); ++i) pieces_[i].push_back(std::move(pieces[i]));
  pieces.clear();
}

void FramePieces::release() {
  if (spare) spare->give(std::move(pieces));
  pieces.clear();
}

Index FramePieces::size() const {
  Index n = 0;
  for (const Frame& piece : pieces) n += piece.size();
  return n;
}

Index FrameSource::size() const {
  return std::accumulate(sizes.begin(), sizes.end(), Index{0});
}

namespace {

void append(auto& to, const auto& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

Frame join(const FramePieces& frame) {
  const FrameHeader& header = frame.header;
  Frame all;
  all.step = header.step;
  all.time = header.time;
  all.dim = header.dim;
  all.columns = header.columns;
  for (const Frame& piece : frame.pieces) {
    append(all.id, piece.id);
    append(all.material, piece.material);
    append(all.coordinates, piece.coordinates);
    for (std::size_t k = 0; k < all.columns.size(); ++k)
      append(all.columns[k].values, piece.columns.at(k).values);
  }
  check_consistent(all);
  sort_by_id(all);
  return all;
}

Frame join(const FrameSource& frame) {
  FramePieces copies{frame.header, {}};
  for (std::size_t i = 0; i < frame.sizes.size(); ++i) copies.pieces.push_back(frame.piece(i));
  return join(copies);
}

void sort_by_id(Frame& frame) {
  if (std::is_sorted(frame.id.begin(), frame.id.end())) return;
  std::vector<std::pair<Index, std::size_t>> order;  // id, and where the particle is
  order.reserve(frame.id.size());
  for (const Index id : frame.id) order.emplace_back(id, order.size());
  std::sort(order.begin(), order.end());
  const auto rearrange = [&order](auto& values, int components) {
    if (values.empty()) return;
    auto sorted = values;
    auto to = sorted.begin();
    for (const auto& [id, at] : order)
      to = std::copy_n(values.begin() + static_cast<Index>(at) * components, components, to);
    values.swap(sorted);
  };
  rearrange(frame.id, 1);
  rearrange(frame.material, 1);
  rearrange(frame.coordinates, frame.dim);
  for (FrameColumn& column : frame.columns) rearrange(column.values, column.components);
}

std::span<const char* const> component_names(int components) {
  static constexpr const char* vector[] = {"x", "y", "z"};
  static constexpr const char* tensor[] = {"xx", "yy", "zz", "xy", "yz", "xz"};
  if (components == 6) return tensor;
  if (components == 2 || components == 3) return std::span(vector).first(components);
  return {};
}

bool is_state_variable(const FrameColumn& column) {
  const auto named = [&](const auto& known) { return known.name == column.name; };
  if (column.components != 1 || std::any_of(column_table.begin(), column_table.end(), named) ||
      std::any_of(derived_fields.begin(), derived_fields.end(), named))
    return false;
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
