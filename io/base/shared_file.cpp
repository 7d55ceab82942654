#include "io/base/shared_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "io/base/atomic_file.h"

namespace lahar {

SharedFile::SharedFile(const std::filesystem::path& file, std::filesystem::path shown)
    : shown_(std::move(shown)), descriptor_(::open(file.c_str(), O_WRONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) throw_io_error("write", shown_, errno);
}

SharedFile::~SharedFile() {
  ::close(descriptor_);
}

void SharedFile::write(Index offset, std::span<const std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(descriptor_, bytes.data(), bytes.size(), offset);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw_io_error("write", shown_, n < 0 ? errno : ENOSPC);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += n;
  }
}

void SharedFile::sync() const {
  // Some file systems cannot sync; that is no failure of ours.
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP)
    throw_io_error("write", shown_, errno);
}

}  // namespace lahar
