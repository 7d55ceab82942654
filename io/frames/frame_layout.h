/// \file Where the values of a frame lie in its file, so that many can write them at a time.
#pragma once

#include <array>
#include <filesystem>

#include "io/frames/frame.h"

namespace lahar {

/// Bytes from the beginning of a file to the first value of each dataset. Values of a dataset lie
/// one after the other, little-endian; vectors have 3 components in 2D too. A plain block of
/// memory, which can be sent as it is.
struct FrameLayout {
  /// More than all columns of particles, derived fields and state variables of all laws together.
  static constexpr std::size_t max_columns = 128;

  Index total = 0;  ///< particles in the file
  int dim = 3;
  int n_columns = 0;
  int number_bytes = sizeof(double);  ///< of coordinates and columns: 8 or 4
  Index points = 0, connectivity = 0, offsets = 0, types = 0, id = 0;
  Index material = -1;  ///< -1 = the file has none
  std::array<Index, max_columns> columns{};
};

/// Make a frame of `total` particles (io/frames/vtkhdf.h) in which everything is written but their
/// values, which write_slab() adds. Errors name `shown`. Throws IoError.
FrameLayout lay_out_frame(const FrameHeader& header, Index total, const std::filesystem::path& file,
                          const std::filesystem::path& shown);

}  // namespace lahar
