#include "io/run/checkpoint.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <optional>
#include <utility>

#include "io/base/atomic_file.h"
#include "io/base/hdf_handle.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view prefix = "checkpoint_", suffix = ".h5";
constexpr hsize_t table_columns = 4;
static_assert(sizeof(CheckpointPatch) == table_columns * sizeof(Index));

void write_attribute(const HdfSession& hdf, hid_t file, const char* name, Index value) {
  const HdfHandle space = hdf.own(H5Screate(H5S_SCALAR), H5Sclose);
  const HdfHandle attribute =
      hdf.own(H5Acreate2(file, name, H5T_STD_I64LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  hdf.check(H5Awrite(attribute, H5T_NATIVE_INT64, &value));
}

/// A dataset whose place in the file is known from the start.
HdfHandle create_dataset(const HdfSession& hdf, hid_t file, const char* name, hid_t type,
                         hid_t space) {
  const HdfHandle plist = hdf.own(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  hdf.check(H5Pset_obj_track_times(plist, false));
  hdf.check(H5Pset_layout(plist, H5D_CONTIGUOUS));
  hdf.check(H5Pset_alloc_time(plist, H5D_ALLOC_TIME_EARLY));
  hdf.check(H5Pset_fill_time(plist, H5D_FILL_TIME_NEVER));
  return hdf.own(H5Dcreate2(file, name, type, space, H5P_DEFAULT, plist, H5P_DEFAULT), H5Dclose);
}

void write_text(const HdfSession& hdf, hid_t file, const char* name, const std::string& text) {
  const HdfHandle type = hdf.own(H5Tcopy(H5T_C_S1), H5Tclose);
  hdf.check(H5Tset_size(type, text.size()));
  hdf.check(H5Tset_strpad(type, H5T_STR_NULLPAD));
  const HdfHandle space = hdf.own(H5Screate(H5S_SCALAR), H5Sclose);
  hdf.write(create_dataset(hdf, file, name, type, space), type, text.data());
}

void write_table(const HdfSession& hdf, hid_t file, std::span<const CheckpointPatch> patches) {
  const hsize_t size[2] = {patches.size(), table_columns};
  const HdfHandle space = hdf.own(H5Screate_simple(2, size, nullptr), H5Sclose);
  HdfHandle data = create_dataset(hdf, file, "patches", H5T_STD_I64LE, space);
  if (!patches.empty()) hdf.write(std::move(data), H5T_NATIVE_INT64, patches.data());
}

Index end_of(std::span<const CheckpointPatch> patches) {
  return patches.empty() ? 0 : patches.back().offset + patches.back().bytes;
}

/// Object headers with checksums of their own, which every HDF5 since 1.8 reads.
HdfHandle file_access(const HdfSession& hdf) {
  HdfHandle plist = hdf.own(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  hdf.check(H5Pset_libver_bounds(plist, H5F_LIBVER_V18, H5F_LIBVER_V18));
  return plist;
}

Index read_attribute(const HdfSession& hdf, hid_t file, const char* name) {
  const HdfHandle attribute = hdf.own(H5Aopen(file, name, H5P_DEFAULT), H5Aclose);
  const HdfHandle space = hdf.own(H5Aget_space(attribute), H5Sclose);
  if (H5Sget_simple_extent_npoints(space) != 1) hdf.fail(std::string(name) + " is not a number");
  Index value = 0;
  hdf.check(H5Aread(attribute, H5T_NATIVE_INT64, &value));
  return value;
}

std::string read_text(const HdfSession& hdf, hid_t file, const char* name) {
  const HdfHandle data = open_data(hdf, file, name);
  const HdfHandle type = hdf.own(H5Dget_type(data), H5Tclose);
  const HdfHandle space = hdf.own(H5Dget_space(data), H5Sclose);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0 ||
      H5Sget_simple_extent_npoints(space) != 1)
    hdf.fail(std::string(name) + " is not a text");
  std::string text(H5Tget_size(type), '\0');
  hdf.check(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()));
  return text;
}

std::vector<CheckpointPatch> read_table(const HdfSession& hdf, hid_t file) {
  const HdfHandle data = open_data(hdf, file, "patches");
  const HdfHandle space = hdf.own(H5Dget_space(data), H5Sclose);
  hsize_t size[2] = {0, 0};
  if (H5Sget_simple_extent_ndims(space) != 2 ||
      H5Sget_simple_extent_dims(space, size, nullptr) != 2 || size[1] != table_columns)
    hdf.fail("its table of patches has another shape");
  std::vector<CheckpointPatch> patches(size[0]);
  if (!patches.empty())
    hdf.check(H5Dread(data, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, patches.data()));
  return patches;
}

/// Whether it is as lay_out() makes it: a checksum says who wrote it as little as what is in it.
bool is_laid_out(std::span<const CheckpointPatch> patches, Index stored) {
  Index id = -1, offset = 0;
  for (const CheckpointPatch& patch : patches) {
    if (patch.id <= id || patch.offset != offset || patch.bytes < 0 ||
        patch.bytes > stored - offset)
      return false;
    id = patch.id;
    offset += patch.bytes;
  }
  return offset == stored;
}

std::optional<Index> step_of(const std::string& name) {
  if (!name.starts_with(prefix) || !name.ends_with(suffix)) return {};
  Index step = 0;
  const char* end = name.data() + name.size() - suffix.size();
  const auto result = std::from_chars(name.data() + prefix.size(), end, step);
  if (result.ec != std::errc{} || result.ptr != end) return {};
  return step;
}

void remove_file(const fs::path& file) {
  std::error_code error;
  fs::remove(file, error);
  if (error) throw_io_error("remove", file, error.value());
}

}  // namespace

Index checksum(std::span<const std::byte> bytes) {
  return static_cast<Index>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

Index lay_out(std::vector<CheckpointPatch>& patches) {
  std::sort(patches.begin(), patches.end(),
            [](const CheckpointPatch& a, const CheckpointPatch& b) { return a.id < b.id; });
  Index offset = 0;
  for (CheckpointPatch& patch : patches) {
    patch.offset = offset;
    offset += patch.bytes;
  }
  return offset;
}

Index create_checkpoint(const fs::path& file, const fs::path& shown, const CheckpointHeader& header,
                        std::span<const CheckpointPatch> patches) {
  const HdfSession hdf(shown, "write");
  const HdfHandle access = file_access(hdf), plist = hdf.own(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  hdf.check(H5Pset_obj_track_times(plist, false));
  HdfHandle out = hdf.own(H5Fcreate(file.c_str(), H5F_ACC_TRUNC, plist, access), H5Fclose);
  const std::string text = header_text(header);
  write_attribute(hdf, out, "header_checksum", checksum(std::as_bytes(std::span(text))));
  write_attribute(hdf, out, "patches_checksum", checksum(std::as_bytes(patches)));
  write_text(hdf, out, "header", text);
  write_table(hdf, out, patches);
  const auto bytes = static_cast<hsize_t>(end_of(patches));
  haddr_t begin = 0;
  {
    const HdfHandle space = hdf.own(H5Screate_simple(1, &bytes, nullptr), H5Sclose);
    const HdfHandle data = create_dataset(hdf, out, "data", H5T_STD_U8LE, space);
    if (bytes > 0) begin = H5Dget_offset(data);
  }
  if (begin == HADDR_UNDEF) hdf.fail("HDF5 does not say where the data begin");
  hdf.check(H5Fclose(out.release()));
  return static_cast<Index>(begin);
}

CheckpointReader::CheckpointReader(fs::path file) : file_(std::move(file)) {
  read_tables();
  descriptor_ = ::open(file_.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) throw_io_error("read", file_, errno);
}

CheckpointReader::~CheckpointReader() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void CheckpointReader::damaged(const std::string& why) const {
  throw IoError(fmt::format("cannot read {}: {}", file_.string(), why));
}

void CheckpointReader::read_tables() {
  std::string text;
  hsize_t stored = 0;
  {
    const HdfSession hdf(file_, "read");
    const HdfHandle in = open_file(hdf, file_);
    if (H5Aexists(in, "header_checksum") <= 0) hdf.fail("it is not a checkpoint of Lahar");
    text = read_text(hdf, in, "header");
    if (checksum(std::as_bytes(std::span(text))) != read_attribute(hdf, in, "header_checksum"))
      hdf.fail("its header does not match its checksum");
    patches_ = read_table(hdf, in);
    if (checksum(std::as_bytes(std::span(patches_))) != read_attribute(hdf, in, "patches_checksum"))
      hdf.fail("its table of patches does not match its checksum");
    const HdfHandle data = open_data(hdf, in, "data");
    const HdfHandle space = hdf.own(H5Dget_space(data), H5Sclose);
    stored = static_cast<hsize_t>(hdf.check(H5Sget_simple_extent_npoints(space)));
    const haddr_t begin = stored > 0 ? H5Dget_offset(data) : 0;
    if (begin == HADDR_UNDEF) hdf.fail("its data are not contiguous");
    data_ = static_cast<Index>(begin);
  }
  if (!is_laid_out(patches_, static_cast<Index>(stored)))
    damaged("its table of patches is not one of its data");
  try {
    header_ = read_header(text);
  } catch (const IoError& error) {
    damaged(error.what());
  }
}

std::vector<std::byte> CheckpointReader::patch(std::size_t i) const {
  const CheckpointPatch& entry = patches_[i];
  std::vector<std::byte> bytes(static_cast<std::size_t>(entry.bytes));
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t count = ::pread(descriptor_, bytes.data() + done, bytes.size() - done,
                                  data_ + entry.offset + static_cast<Index>(done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw_io_error("read", file_, errno);
    if (count == 0) damaged("the file is truncated");
    done += static_cast<std::size_t>(count);
  }
  if (checksum(bytes) != entry.checksum)
    damaged(fmt::format("the state of patch {} does not match its checksum", entry.id));
  return bytes;
}

void CheckpointReader::verify(std::size_t first, std::size_t stride) const {
  for (std::size_t i = first; i < patches_.size(); i += stride) patch(i);
}

fs::path checkpoint_folder(const fs::path& run) {
  return run / "checkpoints";
}

std::string checkpoint_name(Index step) {
  return fmt::format("{}{:010}{}", prefix, step, suffix);
}

std::vector<CheckpointFile> checkpoints_in(const fs::path& folder) {
  std::vector<CheckpointFile> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const auto step = step_of(entry.path().filename().string()))
      files.push_back({*step, entry.path()});
  if (error && error != std::errc::no_such_file_or_directory)
    throw_io_error("read", folder, error.value());
  std::sort(files.begin(), files.end(),
            [](const CheckpointFile& a, const CheckpointFile& b) { return a.step < b.step; });
  return files;
}

void prune_checkpoints(const fs::path& folder, Index kept) {
  const std::vector<CheckpointFile> files = checkpoints_in(folder);
  for (std::size_t i = 0; i + static_cast<std::size_t>(kept) < files.size(); ++i)
    remove_file(files[i].file);
}

void remove_checkpoints_after(const fs::path& folder, Index step) {
  for (const CheckpointFile& checkpoint : checkpoints_in(folder))
    if (checkpoint.step > step) remove_file(checkpoint.file);
}

}  // namespace lahar
