/// \file HDF5 with owners and errors: every handle closes itself, every failure is an IoError with
/// the system's reason. For io/ only; HDF5 must be called by one thread at a time (HdfSession).
#pragma once

#include <hdf5.h>

#include <filesystem>
#include <mutex>
#include <string>
#include <utility>

namespace lahar {

/// Owner of an HDF5 identifier.
class HdfHandle {
 public:
  using Close = herr_t (*)(hid_t);
  HdfHandle() = default;
  HdfHandle(hid_t id, Close close) : id_(id), close_(close) {}
  HdfHandle(HdfHandle&& other) noexcept { swap(other); }
  HdfHandle& operator=(HdfHandle&& other) noexcept {
    swap(other);
    return *this;
  }
  ~HdfHandle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }
  /// Give up ownership, for a close whose result matters.
  hid_t release() { return std::exchange(id_, -1); }

 private:
  void swap(HdfHandle& other) {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
  }
  hid_t id_ = -1;
  Close close_ = nullptr;
};

/// While it lives, this thread alone may call HDF5, which prints nothing. It knows which file the
/// calls are about, and whether they read or write it.
class HdfSession {
 public:
  HdfSession(std::filesystem::path file, const char* action);

  /// Throw IoError "cannot read FILE: reason" if `result` of an HDF5 call is negative.
  template <class T>
  T check(T result) const {
    if (result < 0) fail();
    return result;
  }
  HdfHandle own(hid_t id, HdfHandle::Close close) const { return {check(id), close}; }
  /// Write all of a dataset, or what `space` of it selects, and close it: what it buffers may meet
  /// a full disk only then.
  void write(HdfHandle data, hid_t type, const void* values, hid_t memory = H5S_ALL,
             hid_t space = H5S_ALL) const;
  [[noreturn]] void fail() const;  ///< with the reason of the last HDF5 error
  [[noreturn]] void fail(const std::string& why) const;

 private:
  std::unique_lock<std::mutex> lock_;
  std::filesystem::path file_;
  const char* action_;
};

/// Open a file for reading that may be of anyone. Throws IoError where it is not a regular file.
HdfHandle open_file(const HdfSession& hdf, const std::filesystem::path& file);

/// Open a dataset of such a file. Throws IoError for what would have HDF5 read other files, or take
/// memory that the file's size does not explain: soft and external links on the way, data in other
/// files, virtual datasets, values of variable length, more values than the file can hold; and for
/// types whose parts lie beyond them, which HDF5 1.10 converts all the same.
HdfHandle open_data(const HdfSession& hdf, hid_t file, const std::string& path);

}  // namespace lahar
