#include "io/frames/vtu.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <functional>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "io/base/atomic_file.h"
#include "io/base/numbers.h"
#include "io/base/text.h"

namespace lahar {

namespace {

static_assert(std::endian::native == std::endian::little, "the files say LittleEndian");

constexpr Index block_rows = 1 << 15;  // particles converted at a time

/// One array of the file: its XML attributes and a function that writes its bytes.
struct Array {
  std::string attributes;
  std::uint64_t bytes;
  std::function<void(OutputFile&)> write;
};

template <class T>
void write_span(OutputFile& out, std::span<const T> values) {
  out.write_bytes(std::as_bytes(values));
}

/// An array that is in memory as it goes to the file.
template <class T>
Array plain(std::string attributes, std::span<const T> values) {
  return {std::move(attributes), values.size_bytes(),
          [values](OutputFile& out) { write_span(out, values); }};
}

/// n values first, first + 1, ...
Array counting(std::string attributes, Index first, Index n) {
  return {std::move(attributes), static_cast<std::uint64_t>(n) * sizeof(Index),
          [first, n](OutputFile& out) {
            std::vector<Index> block(static_cast<std::size_t>(std::min(n, block_rows)));
            for (Index start = 0; start < n; start += block_rows) {
              const auto count = static_cast<std::size_t>(std::min(block_rows, n - start));
              std::iota(block.begin(), block.end(), first + start);
              write_span<Index>(out, std::span(block).first(count));
            }
          }};
}

/// Vectors of 2 components become 3.
Array values_array(std::string attributes, const std::vector<double>& values, int components) {
  if (components != 2) return plain(std::move(attributes), std::span<const double>(values));
  return {std::move(attributes), values.size() / 2 * 3 * sizeof(double),
          [&values](OutputFile& out) {
            std::vector<double> block;
            for (std::size_t i = 0; i < values.size(); i += 2) {
              block.insert(block.end(), {values[i], values[i + 1], 0.0});
              if (block.size() < 3 * block_rows) continue;
              write_span<double>(out, block);
              block.clear();
            }
            write_span<double>(out, block);
          }};
}

std::string attributes_of(const char* type, const std::string& name, int components) {
  std::string text = fmt::format("type=\"{}\" Name=\"{}\"", type, xml_escaped(name));
  if (components == 1) return text;
  const int stored = components == 2 ? 3 : components;
  text += fmt::format(" NumberOfComponents=\"{}\"", stored);
  if (components == 6)
    for (int k = 0; k < 6; ++k)
      text += fmt::format(" ComponentName{}=\"{}\"", k, component_names(6)[k]);
  return text;
}

std::vector<Array> point_arrays(const Frame& frame) {
  std::vector<Array> arrays;
  arrays.push_back(plain<Index>(attributes_of("Int64", "id", 1), frame.id));
  if (!frame.material.empty())
    arrays.push_back(plain<std::int32_t>(attributes_of("Int32", "material", 1), frame.material));
  for (const FrameColumn& column : frame.columns)
    arrays.push_back(values_array(attributes_of("Float64", column.name, column.components),
                                  column.values, column.components));
  return arrays;
}

/// The XML part, whose arrays point into the appended data.
class Header {
 public:
  explicit Header(const Frame& frame) {
    text_ =
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
        "header_type=\"UInt64\">\n  <UnstructuredGrid>\n    <FieldData>\n"
        "      <DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
        "format=\"ascii\">";
    append_number(text_, frame.time);
    text_ += fmt::format(
        "</DataArray>\n"
        "      <DataArray type=\"Int64\" Name=\"step\" NumberOfTuples=\"1\" format=\"ascii\">{}"
        "</DataArray>\n    </FieldData>\n"
        "    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n",
        frame.step, frame.size(), frame.size());
  }

  void section(const char* name, const std::vector<Array>& arrays) {
    text_ += fmt::format("      <{}>\n", name);
    for (const Array& array : arrays) {
      text_ += fmt::format("        <DataArray {} format=\"appended\" offset=\"{}\"/>\n",
                           array.attributes, offset_);
      offset_ += sizeof(std::uint64_t) + array.bytes;
    }
    text_ += fmt::format("      </{}>\n", name);
  }

  /// Everything up to the first appended byte.
  std::string finish() {
    return text_ + "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_";
  }

 private:
  std::string text_;
  std::uint64_t offset_ = 0;
};

}  // namespace

void write_vtu(const Frame& frame, const std::filesystem::path& file) {
  check_consistent(frame);
  constexpr std::uint8_t vtk_vertex = 1;
  const Index n = frame.size();
  const std::vector<std::uint8_t> types(static_cast<std::size_t>(n), vtk_vertex);

  std::vector<Array> point_data = point_arrays(frame);
  std::vector<Array> points, cells;
  points.push_back(values_array(attributes_of("Float64", "Points", frame.dim == 2 ? 2 : 3),
                                frame.coordinates, frame.dim));
  cells.push_back(counting(attributes_of("Int64", "connectivity", 1), 0, n));
  cells.push_back(counting(attributes_of("Int64", "offsets", 1), 1, n));
  cells.push_back(plain<std::uint8_t>(attributes_of("UInt8", "types", 1), types));

  Header header(frame);
  header.section("PointData", point_data);
  header.section("Points", points);
  header.section("Cells", cells);

  AtomicFile atomic(file);
  OutputFile out(atomic.temporary(), OutputFile::Mode::truncate, file);
  out.write(header.finish());
  for (const std::vector<Array>* arrays : {&point_data, &points, &cells})
    for (const Array& array : *arrays) {
      write_span<std::uint64_t>(out, std::span(&array.bytes, 1));
      array.write(out);
    }
  out.write("\n  </AppendedData>\n</VTKFile>\n");
  out.close();
  atomic.commit();
}

}  // namespace lahar
