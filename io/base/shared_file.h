/// \file A file that several threads and processes write to, at places of their own.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>

#include "physics/base/types.h"

namespace lahar {

/// Takes bytes that belong at a place [bytes] in a file.
using ByteSink = std::function<void(Index place, std::span<const std::byte> bytes)>;

/// An existing file, open for writing. Errors name `shown`, the name that the user knows.
class SharedFile {
 public:
  /// Throws IoError.
  SharedFile(const std::filesystem::path& file, std::filesystem::path shown);
  SharedFile(const SharedFile&) = delete;
  SharedFile& operator=(const SharedFile&) = delete;
  ~SharedFile();

  /// Any thread. Throws IoError.
  void write(Index offset, std::span<const std::byte> bytes) const;
  /// Bring what this process wrote to the disk. Throws IoError.
  void sync() const;

 private:
  std::filesystem::path shown_;
  int descriptor_;
};

}  // namespace lahar
