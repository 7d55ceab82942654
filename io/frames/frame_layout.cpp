#include "io/frames/frame_layout.h"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "io/base/hdf_handle.h"
#include "physics/materials/materials.h"
#include "physics/particles/columns.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

namespace {

constexpr int lahar_format = 1;  // version of /lahar and of the attributes of PointData

void write_attribute(const HdfSession& hdf, hid_t object, const char* name,
                     std::span<const std::int64_t> values) {
  const hsize_t count = values.size();
  const HdfHandle space = hdf.own(H5Screate_simple(1, &count, nullptr), H5Sclose);
  const HdfHandle attribute =
      hdf.own(H5Acreate2(object, name, H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  hdf.check(H5Awrite(attribute, H5T_NATIVE_INT64, values.data()));
}

void write_attribute(const HdfSession& hdf, hid_t object, const char* name, std::int64_t value) {
  write_attribute(hdf, object, name, std::span(&value, 1));
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

class LayoutWriter {
 public:
  LayoutWriter(const HdfSession& hdf, const std::filesystem::path& file, bool single)
      : hdf_(hdf), number_(single ? H5T_NATIVE_FLOAT : H5T_NATIVE_DOUBLE) {
    // The same state gives the same bytes: no time stamps.
    group_plist_ = hdf.own(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
    hdf.check(H5Pset_obj_track_times(group_plist_, false));
    // Contiguous, with a place from the beginning that HDF5 itself never fills.
    data_plist_ = hdf.own(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    hdf.check(H5Pset_obj_track_times(data_plist_, false));
    hdf.check(H5Pset_layout(data_plist_, H5D_CONTIGUOUS));
    hdf.check(H5Pset_alloc_time(data_plist_, H5D_ALLOC_TIME_EARLY));
    hdf.check(H5Pset_fill_time(data_plist_, H5D_FILL_TIME_NEVER));
    file_ = hdf.own(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  }

  hid_t file() const { return file_; }

  HdfHandle group(hid_t parent, const char* name) const {
    return hdf_.own(H5Gcreate2(parent, name, H5P_DEFAULT, group_plist_, H5P_DEFAULT), H5Gclose);
  }

  /// With `rows` rows; one-dimensional if `columns` is 0.
  HdfHandle dataset(hid_t parent, const std::string& name, hid_t type, Index rows,
                    int columns = 0) const {
    const hsize_t size[2] = {static_cast<hsize_t>(rows), static_cast<hsize_t>(columns)};
    const HdfHandle space =
        hdf_.own(H5Screate_simple(columns > 0 ? 2 : 1, size, nullptr), H5Sclose);
    return hdf_.own(
        H5Dcreate2(parent, name.c_str(), type, space, H5P_DEFAULT, data_plist_, H5P_DEFAULT),
        H5Dclose);
  }

  /// Floating-point data of `components` per particle.
  HdfHandle values(hid_t parent, const std::string& name, Index rows, int components) const {
    const int stored = components == 2 ? 3 : components;
    return dataset(parent, name, number_, rows, stored > 1 ? stored : 0);
  }

  void scalar(hid_t parent, const char* name, hid_t type, const void* value) const {
    hdf_.write(dataset(parent, name, type, 1), type, value);
  }

  /// Where in the file a dataset begins [bytes]; 0 where it is empty and has no place.
  Index place(const HdfHandle& data, Index rows) const {
    if (rows == 0) return 0;
    const haddr_t place = H5Dget_offset(data);
    if (place == HADDR_UNDEF) hdf_.fail();
    return static_cast<Index>(place);
  }

  /// Close; the last data may meet a full disk only here.
  void close() { hdf_.check(H5Fclose(file_.release())); }

 private:
  const HdfSession& hdf_;
  hid_t number_;  ///< type of coordinates and columns
  HdfHandle group_plist_, data_plist_, file_;
};

/// Vertex cells: cell i is point i.
void lay_out_topology(const HdfSession& hdf, const LayoutWriter& out, hid_t root,
                      FrameLayout& layout) {
  const Index n = layout.total;
  for (const char* name : {"NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"})
    out.scalar(root, name, H5T_NATIVE_INT64, &n);
  layout.connectivity = out.place(out.dataset(root, "Connectivity", H5T_NATIVE_INT64, n), n);
  layout.types = out.place(out.dataset(root, "Types", H5T_NATIVE_UINT8, n), n);

  // Cell i ends where the next begins; the end of the last one belongs to no particle.
  HdfHandle offsets = out.dataset(root, "Offsets", H5T_NATIVE_INT64, n + 1);
  layout.offsets = out.place(offsets, n + 1);
  const hsize_t one = 1, last = static_cast<hsize_t>(n);
  const HdfHandle memory = hdf.own(H5Screate_simple(1, &one, nullptr), H5Sclose);
  const HdfHandle space = hdf.own(H5Dget_space(offsets), H5Sclose);
  hdf.check(H5Sselect_hyperslab(space, H5S_SELECT_SET, &last, nullptr, &one, nullptr));
  hdf.write(std::move(offsets), H5T_NATIVE_INT64, &n, memory, space);
}

void lay_out_point_data(const HdfSession& hdf, const LayoutWriter& out, hid_t root,
                        const FrameHeader& header, FrameLayout& layout) {
  const Index n = layout.total;
  const HdfHandle group = out.group(root, "PointData");
  layout.id = out.place(out.dataset(group, "id", H5T_NATIVE_INT64, n), n);
  if (header.material)
    layout.material = out.place(out.dataset(group, "material", H5T_NATIVE_INT32, n), n);
  for (const FrameColumn& column : header.columns) {
    const HdfHandle data = out.values(group, column.name, n, column.components);
    write_attribute(hdf, data, "unit", column.unit);
    write_attribute(hdf, data, "components", column.components);
    write_attribute(hdf, data, "order", layout.n_columns);
    layout.columns[static_cast<std::size_t>(layout.n_columns++)] = out.place(data, n);
  }
}

}  // namespace

template <class T>
inline constexpr std::size_t all_states_of = 0;
template <class... Laws>
inline constexpr std::size_t all_states_of<std::variant<Laws...>> = (Laws::state.size() + ...);
static_assert(n_columns + derived_fields.size() + all_states_of<Law> <= FrameLayout::max_columns,
              "frames of models with all laws need more columns: raise max_columns");

FrameLayout lay_out_frame(const FrameHeader& header, Index total, const std::filesystem::path& file,
                          const std::filesystem::path& shown) {
  if (header.columns.size() > FrameLayout::max_columns)
    throw std::logic_error("frame: more columns than FrameLayout::max_columns");
  FrameLayout layout{.total = total, .dim = header.dim};
  if (header.single) layout.number_bytes = sizeof(float);
  const HdfSession hdf(shown, "write");
  LayoutWriter out(hdf, file, header.single);
  {
    const HdfHandle root = out.group(out.file(), "VTKHDF");
    write_attribute(hdf, root, "Version", std::vector<std::int64_t>{1, 0});
    write_attribute(hdf, root, "Type", std::string("UnstructuredGrid"));
    lay_out_topology(hdf, out, root, layout);
    layout.points = out.place(out.values(root, "Points", total, header.dim), total);
    lay_out_point_data(hdf, out, root, header, layout);
    const HdfHandle fields = out.group(root, "FieldData");
    out.scalar(fields, "step", H5T_NATIVE_INT64, &header.step);
    out.scalar(fields, "time", H5T_NATIVE_DOUBLE, &header.time);
    const HdfHandle own = out.group(out.file(), "lahar");
    write_attribute(hdf, own, "format", lahar_format);
    write_attribute(hdf, own, "dim", header.dim);
  }
  out.close();
  return layout;
}

}  // namespace lahar
