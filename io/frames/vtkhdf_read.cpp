// Reading frames back: the inverse of frame_layout.cpp and frame_slabs.cpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>

#include "io/base/hdf_handle.h"
#include "io/frames/vtkhdf.h"
#include "physics/particles/columns.h"

namespace lahar {

namespace {

constexpr std::int64_t known_format = 1;
/// Rows read at a time where components are dropped (vectors in 2D).
constexpr Index block_rows = 1 << 15;

class FrameFileReader {
 public:
  FrameFileReader(const HdfSession& hdf, const std::filesystem::path& file) : hdf_(hdf) {
    file_ = open_file(hdf, file);
  }

  bool exists(const std::string& path) const {
    for (auto end = path.find('/', 1);; end = path.find('/', end + 1)) {
      if (H5Lexists(file_, path.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
      if (end == path.npos) return true;
    }
  }

  std::int64_t integer_attribute(const std::string& object, const char* name) const {
    const HdfHandle attribute =
        hdf_.own(H5Aopen_by_name(file_, object.c_str(), name, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    expect_values(H5Aget_space(attribute), object + '@' + name, 1);
    std::int64_t value = 0;
    hdf_.check(H5Aread(attribute, H5T_NATIVE_INT64, &value));
    return value;
  }

  std::string text_attribute(const std::string& object, const char* name) const {
    const HdfHandle attribute =
        hdf_.own(H5Aopen_by_name(file_, object.c_str(), name, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const HdfHandle type = hdf_.own(H5Aget_type(attribute), H5Tclose);
    expect_values(H5Aget_space(attribute), object + '@' + name, 1);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0)
      hdf_.fail(object + '@' + name + " is not a fixed-length text");
    std::string text(H5Tget_size(type), '\0');
    hdf_.check(H5Aread(attribute, type, text.data()));
    text.resize(std::min(text.size(), text.find('\0')));
    return text;
  }

  /// All values of an integer dataset.
  template <class T>
  std::vector<T> integers(const std::string& path, Index rows) const {
    const HdfHandle data = open(path);
    expect_values(H5Dget_space(data), path, rows);
    std::vector<T> values(static_cast<std::size_t>(rows));
    const hid_t type = sizeof(T) == 8 ? H5T_NATIVE_INT64 : H5T_NATIVE_INT32;
    hdf_.check(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
    return values;
  }

  /// Values of a floating-point dataset with `stored` components, of which the first `kept` are
  /// wanted.
  std::vector<double> values(const std::string& path, Index rows, int stored, int kept) const {
    const HdfHandle data = open(path);
    expect_values(H5Dget_space(data), path, rows * stored);
    std::vector<double> values(static_cast<std::size_t>(rows * kept));
    if (stored == kept) {
      hdf_.check(H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
      return values;
    }
    const HdfHandle space = hdf_.own(H5Dget_space(data), H5Sclose);
    std::vector<double> block(static_cast<std::size_t>(std::min(rows, block_rows) * stored));
    for (Index first = 0; first < rows; first += block_rows) {
      const hsize_t start[2] = {static_cast<hsize_t>(first), 0};
      const hsize_t count[2] = {static_cast<hsize_t>(std::min(block_rows, rows - first)),
                                static_cast<hsize_t>(stored)};
      hdf_.check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, count, nullptr));
      const HdfHandle memory = hdf_.own(H5Screate_simple(2, count, nullptr), H5Sclose);
      hdf_.check(H5Dread(data, H5T_NATIVE_DOUBLE, memory, space, H5P_DEFAULT, block.data()));
      for (hsize_t i = 0; i < count[0]; ++i)
        std::copy_n(&block[i * stored], kept, &values[(first + i) * kept]);
    }
    return values;
  }

  /// Names in a group, ascending.
  std::vector<std::string> names(const std::string& group) const {
    std::vector<std::string> result;
    const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* list) -> herr_t {
      static_cast<std::vector<std::string>*>(list)->push_back(name);
      return 0;
    };
    hdf_.check(H5Literate_by_name(file_, group.c_str(), H5_INDEX_NAME, H5_ITER_INC, nullptr,
                                  collect, &result, H5P_DEFAULT));
    return result;
  }

 private:
  HdfHandle open(const std::string& path) const { return open_data(hdf_, file_, path); }

  void expect_values(hid_t space_id, const std::string& what, Index expected) const {
    const HdfHandle space = hdf_.own(space_id, H5Sclose);
    const hssize_t found = H5Sget_simple_extent_npoints(space);
    if (found != expected)
      hdf_.fail(fmt::format("{} has {} values instead of {}", what, found, expected));
  }

  const HdfSession& hdf_;
  HdfHandle file_;
};

constexpr int most_components =
    std::ranges::max(column_table, {}, &ColumnInfo::components_3d).components_3d;

/// Columns as the file lists them, without values.
std::vector<FrameColumn> columns_in(const HdfSession& hdf, const FrameFileReader& in) {
  const std::string group = "/VTKHDF/PointData/";
  std::map<std::int64_t, FrameColumn> columns;  // by position in the frame
  for (const std::string& name : in.names(group)) {
    if (name == "id" || name == "material") continue;
    const std::int64_t components = in.integer_attribute(group + name, "components");
    if (components < 1 || components > most_components)
      hdf.fail(fmt::format("{} has {} components", name, components));
    FrameColumn& column = columns[in.integer_attribute(group + name, "order")];
    column.name = name;
    column.unit = in.text_attribute(group + name, "unit");
    column.components = static_cast<int>(components);
  }
  std::vector<FrameColumn> list;
  for (auto& [order, column] : columns) list.push_back(std::move(column));
  return list;
}

FrameHeader header_in(const HdfSession& hdf, const FrameFileReader& in) {
  if (!in.exists("/lahar") || !in.exists("/VTKHDF/PointData/id"))
    hdf.fail("it is an HDF5 file, but no frame of Lahar");
  if (const std::int64_t format = in.integer_attribute("/lahar", "format"); format != known_format)
    hdf.fail(fmt::format("its format is {}, this version of Lahar reads format {}", format,
                         known_format));
  FrameHeader header;
  header.dim = static_cast<int>(in.integer_attribute("/lahar", "dim"));
  if (header.dim != 2 && header.dim != 3) hdf.fail(fmt::format("it has {} dimensions", header.dim));
  header.step = in.integers<Index>("/VTKHDF/FieldData/step", 1)[0];
  header.time = in.values("/VTKHDF/FieldData/time", 1, 1, 1)[0];
  header.material = in.exists("/VTKHDF/PointData/material");
  header.columns = columns_in(hdf, in);
  return header;
}

/// All columns, or those that are named.
Frame read(const std::filesystem::path& file, const std::vector<std::string>* named) {
  const HdfSession hdf(file, "read");
  const FrameFileReader in(hdf, file);
  FrameHeader header = header_in(hdf, in);
  const Index n = in.integers<Index>("/VTKHDF/NumberOfPoints", 1)[0];
  Frame frame;
  frame.dim = header.dim, frame.step = header.step, frame.time = header.time;
  frame.id = in.integers<Index>("/VTKHDF/PointData/id", n);
  if (header.material) frame.material = in.integers<std::int32_t>("/VTKHDF/PointData/material", n);
  frame.coordinates = in.values("/VTKHDF/Points", n, 3, frame.dim);
  for (FrameColumn& column : header.columns) {
    if (named && std::find(named->begin(), named->end(), column.name) == named->end()) continue;
    const int stored = column.components == 2 ? 3 : column.components;
    column.values = in.values("/VTKHDF/PointData/" + column.name, n, stored, column.components);
    frame.columns.push_back(std::move(column));
  }
  sort_by_id(frame);
  return frame;
}

}  // namespace

Frame read_frame(const std::filesystem::path& file) {
  return read(file, nullptr);
}

Frame read_frame(const std::filesystem::path& file, const std::vector<std::string>& columns) {
  return read(file, &columns);
}

FrameHeader read_frame_header(const std::filesystem::path& file) {
  const HdfSession hdf(file, "read");
  return header_in(hdf, FrameFileReader(hdf, file));
}

}  // namespace lahar
