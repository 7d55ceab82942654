#include "io/base/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "physics/base/error.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t buffer_bytes = 1 << 20;  // large enough that system calls do not count

constexpr std::string_view part_suffix = ".part";

/// Bring a file or folder to the disk.
void sync_path(const fs::path& path, const fs::path& shown, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  if (descriptor < 0) throw_io_error("write", shown, errno);
  const int status = ::fsync(descriptor);
  const int error = errno;
  ::close(descriptor);
  // Some file systems cannot sync folders or special files; that is no failure of ours.
  if (status != 0 && error != EINVAL && error != ENOTSUP) throw_io_error("write", shown, error);
}

}  // namespace

void throw_io_error(const char* action, const fs::path& file, int error) {
  throw IoError(fmt::format("cannot {} {}: {}", action, file.string(),
                            std::generic_category().message(error)));
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder)) error.assign(ENOTDIR, std::generic_category());
  if (error) throw_io_error("make folder", folder, error.value());
}

void make_folder_in_place(const fs::path& folder) {
  std::error_code error;
  fs::create_directory(folder, error);
  if (error == std::errc::file_exists) error.assign(ENOTDIR, std::generic_category());
  if (error) throw_io_error("make folder", folder, error.value());
}

bool may_be_endless(const fs::file_status& status) {
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status) &&
         !fs::is_fifo(status);
}

std::string read_text_file(const fs::path& file) {
  std::error_code unknown;
  if (may_be_endless(fs::status(file, unknown)))
    throw IoError(fmt::format("cannot read {}: it is not a regular file", file.string()));
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw_io_error("read", file, errno);
  struct stat status {};
  std::string text;
  if (::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode))
    text.reserve(static_cast<std::size_t>(status.st_size) + 1);
  ssize_t count = 0;
  do {
    const std::size_t used = text.size();
    text.resize(std::max(text.capacity(), used + buffer_bytes / 16));
    count = ::read(descriptor, text.data() + used, text.size() - used);
    text.resize(used + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  } while (count > 0 || (count < 0 && errno == EINTR));
  const int error = errno;
  ::close(descriptor);
  if (count < 0) throw_io_error("read", file, error);
  return text;
}

OutputFile::OutputFile(const fs::path& file, Mode mode, fs::path shown)
    : shown_(shown.empty() ? file : std::move(shown)) {
  const int flags = mode == Mode::append ? O_APPEND : O_TRUNC;
  descriptor_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, 0666);
  if (descriptor_ < 0) throw_io_error("write", shown_, errno);
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : shown_(std::move(other.shown_)),
      buffer_(std::move(other.buffer_)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void OutputFile::write(std::string_view text) {
  if (buffer_.size() + text.size() > buffer_bytes) flush();
  if (text.size() >= buffer_bytes)
    write_all(text.data(), text.size());
  else
    buffer_ += text;
}

void OutputFile::write_bytes(std::span<const std::byte> bytes) {
  write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void OutputFile::write_all(const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t count = ::write(descriptor_, data, size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw_io_error("write", shown_, errno);
    data += count;
    size -= static_cast<std::size_t>(count);
  }
}

void OutputFile::flush() {
  const off_t before = ::lseek(descriptor_, 0, SEEK_END);
  try {
    write_all(buffer_.data(), buffer_.size());
  } catch (...) {
    // Half a row is worse than none; where this fails too, nothing better can be done.
    if (before >= 0 && ::ftruncate(descriptor_, before) != 0) errno = 0;
    throw;
  }
  buffer_.clear();
}

void OutputFile::sync() {
  flush();
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP)
    throw_io_error("write", shown_, errno);
}

void OutputFile::close() {
  flush();
  // Network file systems report a full disk only here.
  if (::close(std::exchange(descriptor_, -1)) != 0) throw_io_error("write", shown_, errno);
}

void OutputFile::truncate() {
  buffer_.clear();
  if (::ftruncate(descriptor_, 0) != 0) throw_io_error("write", shown_, errno);
}

fs::path part_file(const fs::path& target, Index pid) {
  return target.parent_path() /
         fmt::format(".{}.{}{}", target.filename().string(), pid, part_suffix);
}

AtomicFile::AtomicFile(fs::path target)
    : target_(std::move(target)), temporary_(part_file(target_, ::getpid())) {
  // A device would become a file: /dev/null for instance, of a user who may do that.
  std::error_code error;
  const fs::file_status status = fs::status(target_, error);
  if (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status))
    throw IoError(fmt::format("cannot write {}: it is not a regular file", target_.string()));
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  // Emptied first: a library may still hold it open, and on a full disk the space is needed.
  if (::truncate(temporary_.c_str(), 0) != 0 && errno == ENOENT) return;
  ::unlink(temporary_.c_str());
}

void AtomicFile::commit(const std::function<void()>& check) {
  try {
    sync_path(temporary_, target_, O_RDONLY);
    if (check) check();
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) throw_io_error("write", target_, errno);
  } catch (const IoError&) {
    if (check) check();  // it may know why
    throw;
  }
  committed_ = true;
  const fs::path folder = target_.parent_path();
  sync_path(folder.empty() ? fs::path(".") : folder, target_, O_RDONLY | O_DIRECTORY);
}

bool is_part(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.starts_with('.') && name.ends_with(part_suffix);
}

void remove_abandoned_parts(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (is_part(entry.path())) fs::remove(entry.path(), error);
}

void write_text_file(const fs::path& file, std::string_view text) {
  AtomicFile atomic(file);
  OutputFile out(atomic.temporary(), OutputFile::Mode::truncate, file);
  out.write(text);
  out.close();
  atomic.commit();
}

}  // namespace lahar
