/// \file Particles written to their places in a frame file, by many threads and processes at a
/// time.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <utility>

#include "io/base/shared_file.h"
#include "io/frames/frame_layout.h"

namespace lahar {

/// The bytes of the particles of `pieces`, one after the other, which are those from `first` on of
/// the file, in blocks of up to a MiB.
void write_slab(const FrameLayout& layout, Index first, std::span<const Frame> pieces,
                const ByteSink& sink);

/// A file that lay_out_frame() has made, open for writing. Errors name `shown`.
class SlabFile {
 public:
  /// Throws IoError.
  SlabFile(const std::filesystem::path& file, std::filesystem::path shown)
      : file_(file, std::move(shown)) {}

  /// The particles of `pieces`, one after the other, become those from `first` on of the file.
  /// Threads and processes may do so at the same time for different particles. Throws IoError.
  void write(const FrameLayout& layout, Index first, std::span<const Frame> pieces) const;
  /// Bring what this process wrote to the disk. Throws IoError.
  void sync() const { file_.sync(); }

 private:
  SharedFile file_;
};

}  // namespace lahar
