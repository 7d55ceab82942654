#include "io/frames/cbgeo_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <string_view>

#include "io/base/atomic_file.h"
#include "io/base/hdf_handle.h"
#include "io/base/problems.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

/// One field of the table, or several that are alike, one after the other.
struct Group {
  enum class Type { real, integer, natural, flag } type;
  std::size_t offset;
  std::vector<std::string> names;
  bool required = false;
};

std::vector<std::string> state_names() {
  std::vector<std::string> names;
  for (int k = 0; k < CbgeoParticle::max_states; ++k) names.push_back(fmt::format("svars_{}", k));
  return names;
}

/// The fields in the order of the reference.
const std::vector<Group>& groups() {
  using T = Group::Type;
  using P = CbgeoParticle;
  static const std::vector<Group> all{
      {T::integer, offsetof(P, id), {"id"}, true},
      {T::real, offsetof(P, mass), {"mass"}, true},
      {T::real, offsetof(P, volume), {"volume"}, true},
      {T::real, offsetof(P, pressure), {"pressure"}},
      {T::real, offsetof(P, coord), {"coord_x", "coord_y", "coord_z"}, true},
      {T::real, offsetof(P, displacement), {"displacement_x", "displacement_y", "displacement_z"}},
      {T::real, offsetof(P, nsize), {"nsize_x", "nsize_y", "nsize_z"}},
      {T::real, offsetof(P, velocity), {"velocity_x", "velocity_y", "velocity_z"}, true},
      {T::real,
       offsetof(P, stress),
       {"stress_xx", "stress_yy", "stress_zz", "tau_xy", "tau_yz", "tau_xz"},
       true},
      {T::real,
       offsetof(P, strain),
       {"strain_xx", "strain_yy", "strain_zz", "gamma_xy", "gamma_yz", "gamma_xz"},
       true},
      {T::real, offsetof(P, epsilon_v), {"epsilon_v"}},
      {T::flag, offsetof(P, status), {"status"}},
      {T::integer, offsetof(P, cell_id), {"cell_id"}},
      {T::natural, offsetof(P, material_id), {"material_id"}, true},
      {T::natural, offsetof(P, nstate_vars), {"nstate_vars"}},
      {T::real, offsetof(P, svars), state_names()},
  };
  return all;
}

hid_t native_type(Group::Type type) {
  switch (type) {
    case Group::Type::integer:
      return H5T_NATIVE_INT64;
    case Group::Type::natural:
      return H5T_NATIVE_UINT32;
    case Group::Type::flag:
      return H5T_NATIVE_UINT8;
    default:
      return H5T_NATIVE_DOUBLE;
  }
}

/// The table's type in memory: of all fields, or of those that `present` says.
HdfHandle row_type(const HdfSession& hdf, auto&& present) {
  HdfHandle type = hdf.own(H5Tcreate(H5T_COMPOUND, sizeof(CbgeoParticle)), H5Tclose);
  for (const Group& group : groups())
    for (std::size_t k = 0; k < group.names.size(); ++k) {
      if (!present(group.names[k])) continue;
      const hid_t field = native_type(group.type);
      hdf.check(
          H5Tinsert(type, group.names[k].c_str(), group.offset + k * H5Tget_size(field), field));
    }
  return type;
}

[[noreturn]] void refuse(const fs::path& file, const std::string& what, std::string hint = "") {
  throw InputError({Problem{.file = file.string(), .message = what, .hint = std::move(hint)}});
}

/// An open table.
class Table {
 public:
  explicit Table(const fs::path& path) : hdf_(path, "read") {
    std::error_code error;
    if (!fs::exists(path, error)) refuse(path, "the particle file does not exist");
    if (!fs::is_regular_file(path, error)) refuse(path, "the particle file is not a regular file");
    if (H5Fis_hdf5(path.c_str()) <= 0) refuse(path, "this is not an HDF5 file");
    file_ = open_file(hdf_, path);
    if (H5Lexists(file_, "table", H5P_DEFAULT) <= 0)
      refuse(path, "there is no 'table' in the file", "CB-Geo MPM writes its particles as one");
    data_ = open_data(hdf_, file_, "table");
    const HdfHandle type = hdf_.own(H5Dget_type(data_), H5Tclose);
    const HdfHandle space = hdf_.own(H5Dget_space(data_), H5Sclose);
    if (H5Tget_class(type) != H5T_COMPOUND || H5Sget_simple_extent_ndims(space) != 1)
      refuse(path, "'table' is not a list of particles", "CB-Geo MPM writes a compound table");
    hsize_t n = 0;
    hdf_.check(H5Sget_simple_extent_dims(space, &n, nullptr));
    size_ = static_cast<Index>(n);
    find_fields(type, path);
  }

  Index size() const { return size_; }

  std::vector<CbgeoParticle> read(Index first, Index n) const {
    std::vector<CbgeoParticle> rows(static_cast<std::size_t>(n));
    if (n == 0) return rows;
    const HdfHandle type =
        row_type(hdf_, [&](const std::string& name) { return fields_.count(name) > 0; });
    const hsize_t begin = static_cast<hsize_t>(first), count = static_cast<hsize_t>(n);
    const HdfHandle here = hdf_.own(H5Screate_simple(1, &count, nullptr), H5Sclose);
    const HdfHandle there = hdf_.own(H5Dget_space(data_), H5Sclose);
    hdf_.check(H5Sselect_hyperslab(there, H5S_SELECT_SET, &begin, nullptr, &count, nullptr));
    hdf_.check(H5Dread(data_, type, here, there, H5P_DEFAULT, rows.data()));
    return rows;
  }

 private:
  /// Numbers with the names that are known; all that are required must be there.
  void find_fields(hid_t type, const fs::path& path) {
    const int n = hdf_.check(H5Tget_nmembers(type));
    for (int k = 0; k < n; ++k) {
      char* name = H5Tget_member_name(type, static_cast<unsigned>(k));
      const H5T_class_t kind = H5Tget_member_class(type, static_cast<unsigned>(k));
      // (A status that h5py wrote is an enumeration; like CB-Geo MPM we go on with all particles.)
      if (name && (kind == H5T_INTEGER || kind == H5T_FLOAT)) fields_.insert(name);
      H5free_memory(name);
    }
    std::vector<std::string> missing;
    for (const Group& group : groups())
      for (const std::string& name : group.names)
        if (group.required && fields_.count(name) == 0) missing.push_back(name);
    if (!missing.empty())
      refuse(path, fmt::format("'table' has no numbers {}", join(missing)),
             "files of versions of CB-Geo MPM that did not write them cannot be resumed");
  }

  HdfSession hdf_;
  HdfHandle file_, data_;
  Index size_ = 0;
  std::set<std::string> fields_;
};

void write_text(const HdfSession& hdf, hid_t object, const std::string& name,
                const std::string& text) {
  const HdfHandle type = hdf.own(H5Tcopy(H5T_C_S1), H5Tclose);
  hdf.check(H5Tset_size(type, text.size() + 1));
  const HdfHandle space = hdf.own(H5Screate(H5S_SCALAR), H5Sclose);
  const HdfHandle attribute =
      hdf.own(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  hdf.check(H5Awrite(attribute, type, text.c_str()));
}

constexpr Index block_rows = 1 << 14;

/// The table without rows yet, with the attributes by which PyTables knows tables of HDF5's
/// high-level library, which CB-Geo MPM uses.
HdfHandle create_table(const HdfSession& hdf, hid_t file, hid_t type, Index n) {
  const HdfHandle plist = hdf.own(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  // A small table is no larger than its rows: HDF5 writes whole chunks.
  const auto rows = static_cast<hsize_t>(n),
             chunk = static_cast<hsize_t>(std::clamp<Index>(n, 1, block_rows));
  const hsize_t unlimited = H5S_UNLIMITED;
  hdf.check(H5Pset_obj_track_times(plist, false));
  hdf.check(H5Pset_chunk(plist, 1, &chunk));
  const HdfHandle space = hdf.own(H5Screate_simple(1, &rows, &unlimited), H5Sclose);
  HdfHandle data =
      hdf.own(H5Dcreate2(file, "table", type, space, H5P_DEFAULT, plist, H5P_DEFAULT), H5Dclose);
  write_text(hdf, data, "CLASS", "TABLE");
  write_text(hdf, data, "VERSION", "3.0");
  write_text(hdf, data, "TITLE", "particles");
  int k = 0;
  for (const Group& group : groups())
    for (const std::string& name : group.names)
      write_text(hdf, data, fmt::format("FIELD_{}_NAME", k++), name);
  return data;
}

/// The number at the end of a name, before .h5; -1 = none.
Index number_in(std::string_view digits) {
  Index number = -1;
  const auto end = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return end.ec == std::errc() && end.ptr == digits.data() + digits.size() && number >= 0 ? number
                                                                                          : -1;
}

/// What a file name says; step -1: it is not one of particles. One rank: size 0.
struct NameParts {
  Index step = -1, rank = 0, size = 0;
};

NameParts parts_of(const fs::path& file) {
  std::string name = file.filename().string();
  std::string_view rest = name;
  if (!rest.starts_with("particles") || !rest.ends_with(".h5")) return {};
  rest.remove_prefix(9);
  rest.remove_suffix(3);
  if (!rest.starts_with('-')) return {number_in(rest)};
  const auto low = rest.find('_'), dash = rest.find('-', 1);
  if (low == rest.npos || dash == rest.npos || low > dash) return {};
  const NameParts parts{number_in(rest.substr(dash + 1)), number_in(rest.substr(1, low - 1)),
                        number_in(rest.substr(low + 1, dash - low - 1))};
  return parts.rank >= 0 && parts.size > 0 ? parts : NameParts{};
}

void for_each_file(const fs::path& folder, auto&& body) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const NameParts parts = parts_of(entry.path()); parts.step >= 0) body(entry.path(), parts);
}

}  // namespace

Index count_cbgeo_rows(const fs::path& file) {
  return Table(file).size();
}

std::vector<CbgeoParticle> read_cbgeo_rows(const fs::path& file, Index first, Index n) {
  return Table(file).read(first, n);
}

void write_cbgeo_table(
    const fs::path& file, Index n,
    const std::function<std::vector<CbgeoParticle>(Index first, Index n)>& rows) {
  AtomicFile atomic(file);
  {
    const HdfSession hdf(file, "write");
    const HdfHandle out = hdf.own(
        H5Fcreate(atomic.temporary().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    const HdfHandle type = row_type(hdf, [](const std::string&) { return true; });
    HdfHandle data = create_table(hdf, out, type, n);
    for (Index first = 0; first < n; first += block_rows) {
      const std::vector<CbgeoParticle> block = rows(first, std::min(block_rows, n - first));
      const hsize_t begin = static_cast<hsize_t>(first), count = block.size();
      const HdfHandle here = hdf.own(H5Screate_simple(1, &count, nullptr), H5Sclose);
      const HdfHandle there = hdf.own(H5Dget_space(data), H5Sclose);
      hdf.check(H5Sselect_hyperslab(there, H5S_SELECT_SET, &begin, nullptr, &count, nullptr));
      hdf.check(H5Dwrite(data, type, here, there, H5P_DEFAULT, block.data()));
    }
    hdf.check(H5Dclose(data.release()));
    hdf.check(H5Fflush(out, H5F_SCOPE_LOCAL));
  }
  atomic.commit();
}

std::string cbgeo_file_name(Index step, Index nsteps) {
  const int digits = nsteps > 0 ? static_cast<int>(std::log10(static_cast<double>(nsteps)) + 1) : 1;
  return fmt::format("particles{:0{}}.h5", step, digits);
}

std::vector<fs::path> find_cbgeo_files(const fs::path& folder, Index step) {
  std::vector<fs::path> whole;
  std::map<Index, std::map<Index, fs::path>> of_ranks;  // by size, by rank
  for_each_file(folder, [&](const fs::path& file, const NameParts& parts) {
    if (parts.step != step) return;
    if (parts.size == 0)
      whole.push_back(file);
    else
      of_ranks[parts.size][parts.rank] = file;
  });
  std::sort(whole.begin(), whole.end());
  if (!whole.empty()) return {whole.front()};
  for (const auto& [size, files] : of_ranks) {
    if (static_cast<Index>(files.size()) != size) continue;
    std::vector<fs::path> all;
    for (const auto& [rank, file] : files) all.push_back(file);
    return all;
  }
  return {};
}

std::vector<Index> cbgeo_steps(const fs::path& folder) {
  std::set<Index> steps;
  for_each_file(folder, [&](const fs::path&, const NameParts& parts) { steps.insert(parts.step); });
  return {steps.begin(), steps.end()};
}

}  // namespace lahar
