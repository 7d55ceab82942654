#include "io/frames/frame_slabs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <memory>
#include <numeric>
#include <stdexcept>

namespace lahar {

// Values are written as they are in memory, and lay_out_frame() declares native types.
static_assert(std::endian::native == std::endian::little);

namespace {

constexpr std::uint8_t vtk_vertex = 1;
/// Bytes per system call: enough that calls do not count, and the copy stays in cache.
constexpr std::size_t buffer_bytes = std::size_t{1} << 20;
constexpr Index block = 1 << 10;  // values that are made at a time

/// Collects bytes that follow each other in a file.
class SequentialWriter {
 public:
  explicit SequentialWriter(const ByteSink& sink) : sink_(sink) {}

  /// Go on at byte `place`.
  void begin(Index place) {
    flush();
    place_ = place;
  }
  template <class T>
  void append(std::span<const T> values) {
    auto bytes = std::as_bytes(values);
    while (!bytes.empty()) {
      const std::size_t n = std::min(bytes.size(), buffer_bytes - used_);
      std::memcpy(buffer_.get() + used_, bytes.data(), n);
      used_ += n;
      bytes = bytes.subspan(n);
      if (used_ == buffer_bytes) flush();
    }
  }
  void flush() {
    if (used_ > 0) sink_(place_, {buffer_.get(), used_});
    place_ += static_cast<Index>(used_);
    used_ = 0;
  }

 private:
  const ByteSink& sink_;
  std::unique_ptr<std::byte[]> buffer_ = std::make_unique_for_overwrite<std::byte[]>(buffer_bytes);
  std::size_t used_ = 0;
  Index place_ = 0;
};

/// Vectors of 2 get a third component, 0.
template <class Number>
void append_padded(SequentialWriter& out, std::span<const double> values) {
  std::array<Number, 3 * block> padded{};
  while (!values.empty()) {
    const std::size_t n = std::min<std::size_t>(values.size() / 2, block);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < 2; ++k)
        padded[3 * i + k] = static_cast<Number>(values[2 * i + k]);
    out.append(std::span<const Number>(padded).first(3 * n));
    values = values.subspan(2 * n);
  }
}

void append_single(SequentialWriter& out, std::span<const double> values) {
  std::array<float, block> rounded;
  while (!values.empty()) {
    const std::size_t n = std::min<std::size_t>(values.size(), block);
    std::transform(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n), rounded.begin(),
                   [](double value) { return static_cast<float>(value); });
    out.append(std::span<const float>(rounded).first(n));
    values = values.subspan(n);
  }
}

void append_values(SequentialWriter& out, std::span<const double> values, int components,
                   bool single) {
  if (components == 2)
    single ? append_padded<float>(out, values) : append_padded<double>(out, values);
  else if (single)
    append_single(out, values);
  else
    out.append(values);
}

/// first, first + 1, ...
void append_counting(SequentialWriter& out, Index first, Index count) {
  std::array<Index, block> numbers;
  for (Index at = 0; at < count; at += block) {
    std::iota(numbers.begin(), numbers.end(), first + at);
    out.append(std::span<const Index>(numbers).first(
        static_cast<std::size_t>(std::min(block, count - at))));
  }
}

/// Cell i is the vertex i.
void write_topology(SequentialWriter& out, const FrameLayout& layout, Index first, Index count) {
  for (const Index place : {layout.connectivity, layout.offsets}) {
    out.begin(place + first * static_cast<Index>(sizeof(Index)));
    append_counting(out, first, count);
  }
  out.begin(layout.types + first);
  const std::vector<std::uint8_t> types(static_cast<std::size_t>(std::min(count, block)),
                                        vtk_vertex);
  for (Index at = 0; at < count; at += block)
    out.append(std::span(types).first(static_cast<std::size_t>(std::min(block, count - at))));
}

void check_piece(const FrameLayout& layout, const Frame& piece) {
  check_consistent(piece);
  const bool material = !piece.material.empty() || piece.id.empty();
  if (piece.dim != layout.dim ||
      piece.columns.size() != static_cast<std::size_t>(layout.n_columns) ||
      (layout.material >= 0 && !material))
    throw std::logic_error("frame: a piece has other columns than the frame");
}

}  // namespace

void write_slab(const FrameLayout& layout, Index first, std::span<const Frame> pieces,
                const ByteSink& sink) {
  Index count = 0;
  for (const Frame& piece : pieces) {
    check_piece(layout, piece);
    count += piece.size();
  }
  if (first < 0 || first + count > layout.total)
    throw std::logic_error(
        fmt::format("frame: particles {} to {} of {}", first, first + count, layout.total));
  if (count == 0) return;
  SequentialWriter out(sink);
  const auto begin = [&](Index place, std::size_t bytes_per_particle) {
    out.begin(place + first * static_cast<Index>(bytes_per_particle));
  };
  const bool single = layout.number_bytes == sizeof(float);
  const auto stored = [&](int components) {
    return static_cast<std::size_t>(layout.number_bytes * (components == 2 ? 3 : components));
  };
  write_topology(out, layout, first, count);
  begin(layout.points, stored(layout.dim));
  for (const Frame& piece : pieces) append_values(out, piece.coordinates, layout.dim, single);
  begin(layout.id, sizeof(Index));
  for (const Frame& piece : pieces) out.append(std::span(piece.id));
  if (layout.material >= 0) begin(layout.material, sizeof(std::int32_t));
  for (const Frame& piece : pieces)
    if (layout.material >= 0) out.append(std::span(piece.material));
  for (int k = 0; k < layout.n_columns; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const int components = pieces.front().columns[at].components;
    begin(layout.columns[at], stored(components));
    for (const Frame& piece : pieces)
      append_values(out, piece.columns[at].values, components, single);
  }
  out.flush();
}

void SlabFile::write(const FrameLayout& layout, Index first, std::span<const Frame> pieces) const {
  write_slab(layout, first, pieces,
             [this](Index place, std::span<const std::byte> bytes) { file_.write(place, bytes); });
}

}  // namespace lahar
