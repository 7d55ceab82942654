/// \file Output files: every failure is an IoError with the system's reason, and files appear
/// whole.
#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "physics/base/types.h"

namespace lahar {

/// Throw IoError "cannot <action> <file>: <reason of error number>".
[[noreturn]] void throw_io_error(const char* action, const std::filesystem::path& file, int error);

/// Make a folder and its parents; an existing one is fine. Throws IoError.
void make_folder(const std::filesystem::path& folder);

/// The same in a folder that exists. Throws IoError where it does not.
void make_folder_in_place(const std::filesystem::path& folder);

/// Whether a file may never end, as a device. A pipe ends: a shell makes one of <(...).
bool may_be_endless(const std::filesystem::file_status& status);

/// Whole contents of a file or pipe. Throws IoError, also for devices.
std::string read_text_file(const std::filesystem::path& file);

/// A file being written, buffered. Errors name `shown`, the name the user knows.
class OutputFile {
 public:
  enum class Mode { truncate, append };
  OutputFile(const std::filesystem::path& file, Mode mode, std::filesystem::path shown = {});
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();  ///< closes; what was not flushed is lost

  void write(std::string_view text);
  void write_bytes(std::span<const std::byte> bytes);
  void flush();  ///< hand everything to the operating system
  void sync();   ///< and to the disk
  void close();
  void truncate();  ///< forget what the file contained
  int descriptor() const { return descriptor_; }

 private:
  void write_all(const char* data, std::size_t size);
  std::filesystem::path shown_;
  std::string buffer_;
  int descriptor_ = -1;
};

/// A file that appears whole or not at all: write to temporary(), then commit().
/// Without commit() the temporary file is removed and the target is untouched.
class AtomicFile {
 public:
  /// Throws IoError where the target is a device, a pipe or a socket.
  explicit AtomicFile(std::filesystem::path target);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// The part_file() of this process, hidden in the target's folder.
  const std::filesystem::path& temporary() const { return temporary_; }
  const std::filesystem::path& target() const { return target_; }
  /// Bring the temporary file to the disk and give it its name, replacing an older file; before the
  /// latter, and where this fails, call `check`, which may throw.
  void commit(const std::function<void()>& check = {});

 private:
  std::filesystem::path target_, temporary_;
  bool committed_ = false;
};

/// Where process `pid` of this machine or another writes what will become `target`: .NAME.PID.part
std::filesystem::path part_file(const std::filesystem::path& target, Index pid);

/// True if the name is one that part_file() gives.
bool is_part(const std::filesystem::path& file);

/// Remove temporary files of killed processes from a folder; errors are ignored.
void remove_abandoned_parts(const std::filesystem::path& folder);

/// Replace the contents of `file` by `text`, atomically.
void write_text_file(const std::filesystem::path& file, std::string_view text);

}  // namespace lahar
