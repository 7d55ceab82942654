#include "io/hdf_handle.h"

#include <fmt/format.h>

#include <string>
#include <string_view>

#include "physics/error.h"

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

}  // namespace lahar
