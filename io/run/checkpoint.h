/// \file Checkpoint files: RUN/checkpoints/checkpoint_STEP.h5, plain HDF5.
///
///     /header   text: JSON with the format, the program, the numbers of the run (RunState), the
///               scenario with every default, and hashes of its side files
///     /patches  (patches, 4) int64: id, offset in /data, bytes, CRC-32; ascending ids
///     /data     the states of the patches, one after the other, contiguous
///     attributes header_checksum, patches_checksum: CRC-32 of the two
///
/// Nothing in a file depends on ranks, threads or time: equal states give equal files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "io/run/checkpoint_header.h"

namespace lahar {

/// Where the state of a patch is in a checkpoint.
struct CheckpointPatch {
  Index id = 0;
  Index offset = 0;  ///< from the beginning of /data
  Index bytes = 0;
  Index checksum = 0;  ///< CRC-32
};

/// CRC-32 (as in zlib and PNG).
Index checksum(std::span<const std::byte> bytes);

/// Give the patches, ascending ids, their places. Returns the size of all.
Index lay_out(std::vector<CheckpointPatch>& patches);

/// Create `file` with everything but the patches' states, for which there is room. Returns where
/// /data begins. Throws IoError naming `shown`, the name that the user knows.
Index create_checkpoint(const std::filesystem::path& file, const std::filesystem::path& shown,
                        const CheckpointHeader& header, std::span<const CheckpointPatch> patches);

/// Reads a checkpoint. Every member throws IoError where the file is not a whole checkpoint.
class CheckpointReader {
 public:
  explicit CheckpointReader(std::filesystem::path file);
  CheckpointReader(const CheckpointReader&) = delete;
  CheckpointReader& operator=(const CheckpointReader&) = delete;
  ~CheckpointReader();

  const std::filesystem::path& file() const { return file_; }
  const CheckpointHeader& header() const { return header_; }
  const std::vector<CheckpointPatch>& patches() const { return patches_; }
  /// State of patches()[i], verified. Any thread.
  std::vector<std::byte> patch(std::size_t i) const;
  /// Verify the states of patches first, first + stride, ...
  void verify(std::size_t first = 0, std::size_t stride = 1) const;

 private:
  [[noreturn]] void damaged(const std::string& why) const;
  void read_tables();

  std::filesystem::path file_;
  CheckpointHeader header_;
  std::vector<CheckpointPatch> patches_;
  Index data_ = 0;  ///< where /data begins
  int descriptor_ = -1;
};

struct CheckpointFile {
  Index step;
  std::filesystem::path file;
};

/// Folder of a run's checkpoints.
std::filesystem::path checkpoint_folder(const std::filesystem::path& run);

/// Checkpoints in a folder by their names, ascending steps; none if there is no such folder.
std::vector<CheckpointFile> checkpoints_in(const std::filesystem::path& folder);

/// File name of a checkpoint: checkpoint_0000001000.h5.
std::string checkpoint_name(Index step);

/// Remove all checkpoints but the `kept` latest. Throws IoError.
void prune_checkpoints(const std::filesystem::path& folder, Index kept);

/// Remove checkpoints later than `step`. Throws IoError.
void remove_checkpoints_after(const std::filesystem::path& folder, Index step);

}  // namespace lahar
