#include "io/vtkhdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <span>
#include <string>
#include <vector>

#include "io/atomic_file.h"
#include "io/hdf_handle.h"

namespace lahar {

namespace {

constexpr int lahar_format = 1;  // version of /lahar and of the attributes of PointData
constexpr std::uint8_t vtk_vertex = 1;
/// Particles per chunk and per HDF5 call: a tensor chunk is 1.5 MiB, within HDF5's default limits
/// and large enough that calls and chunk index cost nothing.
constexpr Index chunk_particles = 1 << 15;
constexpr int index_deflate = 1;  // index arrays shrink 30-fold at any level; 1 is the fastest

template <class T>
hid_t native_type();
template <>
hid_t native_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
hid_t native_type<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
hid_t native_type<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
hid_t native_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}

void write_attribute(const HdfSession& hdf, hid_t object, const char* name,
                     std::span<const std::int64_t> values) {
  const hsize_t count = values.size();
  const HdfHandle space = hdf.own(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const HdfHandle attribute =
      hdf.own(H5Acreate2(object, name, H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  hdf.check(H5Awrite(attribute, H5T_NATIVE_INT64, values.data()));
}

/// Fixed-length ASCII: VTK does not read variable-length strings.
void write_attribute(const HdfSession& hdf, hid_t object, const char* name,
                     const std::string& text) {
  const HdfHandle type = hdf.own(H5Tcopy(H5T_C_S1), H5Tclose);
  hdf.check(H5Tset_size(type, std::max<std::size_t>(text.size(), 1)));
  hdf.check(H5Tset_strpad(type, H5T_STR_NULLPAD));
  const HdfHandle space = hdf.own(H5Screate(H5S_SCALAR), H5Sclose);
  const HdfHandle attribute =
      hdf.own(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  hdf.check(H5Awrite(attribute, type, text.c_str()));
}

/// Shape and storage of a dataset of `rows` rows.
struct Layout {
  Index rows;
  int columns = 0;  ///< 0: one-dimensional
  int deflate = 0;  ///< 0: plain and contiguous
};

class FrameFileWriter {
 public:
  FrameFileWriter(const HdfSession& hdf, const std::filesystem::path& file) : hdf_(hdf) {
    // The same state gives the same bytes: no time stamps.
    group_plist_ = hdf.own(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
    hdf.check(H5Pset_obj_track_times(group_plist_, false));
    file_ = hdf.own(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  }

  HdfHandle group(hid_t parent, const char* name) const {
    return hdf_.own(H5Gcreate2(parent, name, H5P_DEFAULT, group_plist_, H5P_DEFAULT), H5Gclose);
  }
  hid_t file() const { return file_; }

  /// Create a dataset and fill it block by block with what `block(first, count)` points to.
  template <class T, class Block>
  HdfHandle dataset(hid_t parent, const std::string& name, const Layout& layout,
                    Block&& block) const {
    HdfHandle data = create(parent, name, native_type<T>(), layout);
    const HdfHandle space = hdf_.own(H5Dget_space(data), H5Sclose);
    for (Index first = 0; first < layout.rows; first += chunk_particles) {
      const Index rows = std::min(chunk_particles, layout.rows - first);
      const hsize_t start[2] = {static_cast<hsize_t>(first), 0};
      const hsize_t count[2] = {static_cast<hsize_t>(rows), static_cast<hsize_t>(layout.columns)};
      hdf_.check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, nullptr, count, nullptr));
      const HdfHandle memory =
          hdf_.own(H5Screate_simple(layout.columns > 0 ? 2 : 1, count, nullptr), H5Sclose);
      const T* values = block(first, rows);
      hdf_.check(H5Dwrite(data, native_type<T>(), memory, space, H5P_DEFAULT, values));
    }
    return data;
  }

  /// A dataset of one value.
  template <class T>
  void scalar(hid_t parent, const char* name, T value) const {
    dataset<T>(parent, name, {.rows = 1}, [&](Index, Index) { return &value; });
  }

  /// Close; the last data may meet a full disk only here.
  void close() { hdf_.check(H5Fclose(file_.release())); }

 private:
  HdfHandle create(hid_t parent, const std::string& name, hid_t type, const Layout& layout) const {
    const int rank = layout.columns > 0 ? 2 : 1;
    const hsize_t size[2] = {static_cast<hsize_t>(layout.rows),
                             static_cast<hsize_t>(layout.columns)};
    const HdfHandle space = hdf_.own(H5Screate_simple(rank, size, nullptr), H5Sclose);
    const HdfHandle plist = hdf_.own(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    hdf_.check(H5Pset_obj_track_times(plist, false));
    hdf_.check(H5Pset_fill_time(plist, H5D_FILL_TIME_NEVER));
    if (layout.deflate > 0 && layout.rows > 0) {
      const hsize_t chunk[2] = {std::min<hsize_t>(size[0], chunk_particles), size[1]};
      hdf_.check(H5Pset_chunk(plist, rank, chunk));
      hdf_.check(H5Pset_shuffle(plist));
      hdf_.check(H5Pset_deflate(plist, static_cast<unsigned>(layout.deflate)));
    }
    return hdf_.own(H5Dcreate2(parent, name.c_str(), type, space, H5P_DEFAULT, plist, H5P_DEFAULT),
                    H5Dclose);
  }

  const HdfSession& hdf_;
  HdfHandle group_plist_, file_;
};

/// What to write for `count` particles from `first` on.
using Values = std::function<const double*(Index first, Index count)>;

/// Floating-point data of `components` per particle; vectors of 2 are padded to 3 block by block,
/// everything else is written from where it is.
HdfHandle write_values(const FrameFileWriter& out, hid_t parent, const std::string& name,
                       const Values& values, int components, Index rows, int deflate) {
  if (components != 2) {
    const Layout layout{
        .rows = rows, .columns = components > 1 ? components : 0, .deflate = deflate};
    return out.dataset<double>(parent, name, layout, values);
  }
  std::vector<double> padded(static_cast<std::size_t>(std::min(rows, chunk_particles)) * 3);
  const Layout layout{.rows = rows, .columns = 3, .deflate = deflate};
  return out.dataset<double>(parent, name, layout, [&](Index first, Index count) {
    const double* from = values(first, count);
    for (Index i = 0; i < count; ++i)
      for (int k = 0; k < 2; ++k) padded[3 * i + k] = from[2 * i + k];
    return padded.data();
  });
}

/// Vertex cells: cell i is point i.
void write_topology(const FrameFileWriter& out, hid_t root, Index n) {
  for (const char* name : {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"})
    out.scalar<std::int64_t>(root, name, n);
  std::vector<std::int64_t> ids(static_cast<std::size_t>(std::min(n + 1, chunk_particles)));
  const auto counting = [&](Index first, Index count) {
    std::iota(ids.begin(), ids.begin() + count, first);
    return ids.data();
  };
  out.dataset<std::int64_t>(root, "Connectivity", {.rows = n, .deflate = index_deflate}, counting);
  out.dataset<std::int64_t>(root, "Offsets", {.rows = n + 1, .deflate = index_deflate}, counting);
  const std::vector<std::uint8_t> types(ids.size(), vtk_vertex);
  out.dataset<std::uint8_t>(root, "Types", {.rows = n, .deflate = index_deflate},
                            [&](Index, Index) { return types.data(); });
}

void write_point_data(const HdfSession& hdf, const FrameFileWriter& out, hid_t root,
                      const FrameStream& frame, int deflate) {
  const Index n = frame.size;
  const HdfHandle group = out.group(root, "PointData");
  out.dataset<std::int64_t>(group, "id", {.rows = n, .deflate = index_deflate}, frame.id);
  if (frame.material)
    out.dataset<std::int32_t>(group, "material", {.rows = n, .deflate = index_deflate},
                              frame.material);
  for (std::size_t k = 0; k < frame.header.columns.size(); ++k) {
    const FrameColumn& column = frame.header.columns[k];
    const auto values = [&](Index first, Index count) { return frame.values(k, first, count); };
    const HdfHandle data =
        write_values(out, group, column.name, values, column.components, n, deflate);
    write_attribute(hdf, data, "unit", column.unit);
    write_attribute(hdf, data, "components", std::vector<std::int64_t>{column.components});
    write_attribute(hdf, data, "order", std::vector<std::int64_t>{static_cast<std::int64_t>(k)});
  }
}

void write_contents(const HdfSession& hdf, const FrameFileWriter& out, const FrameStream& frame,
                    int deflate) {
  const Frame& header = frame.header;
  const HdfHandle root = out.group(out.file(), "VTKHDF");
  write_attribute(hdf, root, "Version", std::vector<std::int64_t>{1, 0});
  write_attribute(hdf, root, "Type", std::string("UnstructuredGrid"));
  write_topology(out, root, frame.size);
  write_values(out, root, "Points", frame.coordinates, header.dim, frame.size, deflate);
  write_point_data(hdf, out, root, frame, deflate);
  const HdfHandle fields = out.group(root, "FieldData");
  out.scalar<std::int64_t>(fields, "step", header.step);
  out.scalar<double>(fields, "time", header.time);
  const HdfHandle own = out.group(out.file(), "lahar");
  write_attribute(hdf, own, "format", std::vector<std::int64_t>{lahar_format});
  write_attribute(hdf, own, "dim", std::vector<std::int64_t>{header.dim});
}

}  // namespace

void write_frame(const Frame& frame, const std::filesystem::path& file,
                 const FrameFileOptions& options) {
  check_consistent(frame);
  write_frame(stream_of(frame), file, options);
}

void write_frame(const FrameStream& frame, const std::filesystem::path& file,
                 const FrameFileOptions& options) {
  AtomicFile atomic(file);
  {
    const HdfSession hdf(file, "write");
    FrameFileWriter out(hdf, atomic.temporary());
    write_contents(hdf, out, frame, options.value_deflate);
    out.close();
  }
  atomic.commit();
}

std::string hdf5_version() {
  // Not H5get_libversion(): it would initialise the library before hdf_handle.cpp can say how.
  return fmt::format("{}.{}.{}", H5_VERS_MAJOR, H5_VERS_MINOR, H5_VERS_RELEASE);
}

}  // namespace lahar
