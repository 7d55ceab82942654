#include "io/base/hdf_handle.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "io/base/text.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

/// Two reasons an HDF5 error stack gives: the system's words, or the innermost frame's description.
struct Reasons {
  std::string system, innermost;
};

herr_t collect(unsigned position, const H5E_error2_t* frame, void* data) {
  auto& reasons = *static_cast<Reasons*>(data);
  const std::string_view text = frame->desc ? frame->desc : "";
  if (position == 0) reasons.innermost = text;
  // File drivers write: "... errno = 28, error message = 'No space left on device', ..."
  constexpr std::string_view key = "error message = '";
  if (const auto start = text.find(key); start != text.npos && reasons.system.empty()) {
    const auto from = start + key.size();
    reasons.system = text.substr(from, text.find('\'', from) - from);
  }
  return 0;
}

}  // namespace

HdfSession::HdfSession(std::filesystem::path file, const char* action)
    : file_(std::move(file)), action_(action) {
  // Debian's serial build has a lock of its own, the one for MPI has none.
  static std::mutex one_thread_at_a_time;
  lock_ = std::unique_lock(one_thread_at_a_time);
  // A file that a full disk kept from being closed stays in HDF5's tables, and cleaning them up at
  // exit crashes. All our files are closed explicitly, so there is nothing else to clean up.
  [[maybe_unused]] static const herr_t no_cleanup_at_exit = H5dont_atexit();
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

void HdfSession::write(HdfHandle data, hid_t type, const void* values, hid_t memory,
                       hid_t space) const {
  check(H5Dwrite(data, type, memory, space, H5P_DEFAULT, values));
  check(H5Dclose(data.release()));
}

void HdfSession::fail() const {
  Reasons reasons;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, collect, &reasons);
  if (!reasons.system.empty()) fail(reasons.system);
  if (reasons.innermost.starts_with("truncated file")) fail("the file is truncated");
  if (reasons.innermost == "file signature not found") fail("not an HDF5 file");
  fail(reasons.innermost.empty() ? "unknown HDF5 error" : reasons.innermost);
}

void HdfSession::fail(const std::string& why) const {
  throw IoError(fmt::format("cannot {} {}: {}", action_, file_.string(), why));
}

namespace {

/// How much deflate can shrink data (RFC 1951: 258 bytes in two bits, rounded up) [-].
constexpr double most_compression = 1040;

/// Bits of a number lie within it, members within the compound.
bool is_sound(const HdfSession& hdf, hid_t type);

bool is_sound_number(hid_t type) {
  constexpr std::size_t most_bytes = 16;
  const std::size_t size = H5Tget_size(type), bits = H5Tget_precision(type);
  const int offset = H5Tget_offset(type);
  if (size == 0 || size > most_bytes || bits == 0 || offset < 0 ||
      static_cast<std::size_t>(offset) + bits > 8 * size)
    return false;
  if (H5Tget_class(type) != H5T_FLOAT) return true;
  std::size_t sign = 0, exponent = 0, exponent_bits = 0, mantissa = 0, mantissa_bits = 0;
  if (H5Tget_fields(type, &sign, &exponent, &exponent_bits, &mantissa, &mantissa_bits) < 0)
    return false;
  // The differences of what is there: sums of wild values could overflow.
  return sign < bits && exponent_bits > 0 && exponent_bits <= bits && mantissa_bits > 0 &&
         mantissa_bits <= bits && exponent <= bits - exponent_bits &&
         mantissa <= bits - mantissa_bits;
}

bool is_sound_compound(const HdfSession& hdf, hid_t type) {
  const std::size_t size = H5Tget_size(type);
  const int n = hdf.check(H5Tget_nmembers(type));
  std::vector<std::pair<std::size_t, std::size_t>> places;
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<unsigned>(k);
    const HdfHandle member = hdf.own(H5Tget_member_type(type, i), H5Tclose);
    const std::size_t begin = H5Tget_member_offset(type, i), bytes = H5Tget_size(member);
    if (bytes == 0 || bytes > size || begin > size - bytes || !is_sound(hdf, member)) return false;
    places.emplace_back(begin, begin + bytes);
  }
  std::sort(places.begin(), places.end());
  for (std::size_t k = 1; k < places.size(); ++k)
    if (places[k].first < places[k - 1].second) return false;
  return n > 0;
}

bool is_sound(const HdfSession& hdf, hid_t type) {
  switch (H5Tget_class(type)) {
    case H5T_INTEGER:
    case H5T_FLOAT:
    case H5T_BITFIELD:
      return is_sound_number(type);
    case H5T_COMPOUND:
      return is_sound_compound(hdf, type);
    case H5T_ENUM:
    case H5T_ARRAY: {
      const HdfHandle base = hdf.own(H5Tget_super(type), H5Tclose);
      return H5Tget_size(base) > 0 && H5Tget_size(type) % H5Tget_size(base) == 0 &&
             is_sound(hdf, base);
    }
    case H5T_STRING:
      return H5Tget_size(type) > 0;
    default:
      return false;
  }
}

/// The type of the info has other names in later versions of HDF5.
template <class Info>
Info empty_info(herr_t (*)(hid_t, const char*, Info*, unsigned, hid_t)) {
  return {};
}

/// Messages that are kept elsewhere in a file: HDF5 1.10 crashes where it is damaged. Neither this
/// program nor CB-Geo MPM writes any.
void refuse_shared(const HdfSession& hdf, hid_t file, const std::string& path) {
  auto info = empty_info(&H5Oget_info_by_name2);
  hdf.check(H5Oget_info_by_name2(file, path.c_str(), &info, H5O_INFO_HDR, H5P_DEFAULT));
  if (info.hdr.mesg.shared != 0) hdf.fail("'" + path + "' is described in parts of others");
}

void refuse_links(const HdfSession& hdf, hid_t file, const std::string& path) {
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    const std::string name = path.substr(0, end);
    H5L_info_t link;
    hdf.check(H5Lget_info(file, name.c_str(), &link, H5P_DEFAULT));
    if (link.type != H5L_TYPE_HARD) hdf.fail("'" + name + "' is a link to somewhere else");
    refuse_shared(hdf, file, name);
    if (end == std::string::npos) return;
  }
}

}  // namespace

HdfHandle open_file(const HdfSession& hdf, const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_directory(status) &&
      !std::filesystem::is_regular_file(status))
    hdf.fail("it is not a regular file");
  return hdf.own(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
}

HdfHandle open_data(const HdfSession& hdf, hid_t file, const std::string& path) {
  refuse_links(hdf, file, path);
  HdfHandle data = hdf.own(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  const HdfHandle plan = hdf.own(H5Dget_create_plist(data), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(plan);
  if (layout == H5D_VIRTUAL || (layout == H5D_CONTIGUOUS && H5Pget_external_count(plan) > 0))
    hdf.fail("'" + path + "' has its data in other files");
  const HdfHandle type = hdf.own(H5Dget_type(data), H5Tclose);
  if (H5Tdetect_class(type, H5T_VLEN) > 0 || H5Tdetect_class(type, H5T_REFERENCE) > 0)
    hdf.fail("'" + path + "' has values of variable length");
  if (!is_sound(hdf, type)) hdf.fail("the type of '" + path + "' is damaged");
  const HdfHandle space = hdf.own(H5Dget_space(data), H5Sclose);
  const double bytes = static_cast<double>(hdf.check(H5Sget_simple_extent_npoints(space))) *
                       static_cast<double>(H5Tget_size(type));
  // HDF5 1.10 does not look whether values that are kept in the header are as many as they claim.
  if (layout == H5D_COMPACT && bytes > static_cast<double>(H5Dget_storage_size(data)))
    hdf.fail("'" + path + "' claims more values than there are");
  hsize_t size = 0;
  hdf.check(H5Fget_filesize(file, &size));
  if (bytes > most_compression * static_cast<double>(size))
    hdf.fail(fmt::format("'{}' claims {} of values, more than a file of {} can hold", path,
                         format_bytes(bytes), format_bytes(static_cast<double>(size))));
  return data;
}

}  // namespace lahar
