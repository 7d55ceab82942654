/// \file Frames as VTKHDF 1.0 files: one UnstructuredGrid of vertex cells per step, which ParaView,
/// VTK and h5py open. Layout (n particles):
///
///     /VTKHDF                  Version {1, 0}, Type "UnstructuredGrid"
///       NumberOfPoints, NumberOfCells, NumberOfConnectivityIds    {n}
///       Points (n, 3), Connectivity (n), Offsets (n + 1), Types (n)
///       PointData/id, material, and each column of the frame; vectors are padded to 3 components,
///         tensors are xx yy zz xy yz xz; attributes `unit` and `components` (before padding)
///       FieldData/step, time [s]
///     /lahar                   format (1), dim
#pragma once

#include <filesystem>
#include <string>

#include "io/frame.h"

namespace lahar {

struct FrameFileOptions {
  /// Deflate level (after shuffling) of floating-point data, 0 to 9; 0: plain and contiguous.
  /// Measured on published states, one core, 1 million particles: plain 190 MB in 0.2 s; level 1
  /// 85 MB in 2.2 s (plate with a hole) and 31 MB in 1.4 s (dam break, early); level 4 gains 5 to
  /// 15 % more. All cores compute while frames are written, and level 1 costs as much as 100 to 200
  /// steps of the particle: plain is the default, for disks that are short level 1 is the choice.
  int value_deflate = 0;
};

/// Write one frame atomically. Throws IoError.
void write_frame(const Frame& frame, const std::filesystem::path& file,
                 const FrameFileOptions& options = {});
void write_frame(const FrameStream& frame, const std::filesystem::path& file,
                 const FrameFileOptions& options = {});

/// Read a file of write_frame(); every number comes back bit by bit. Throws IoError, also for HDF5
/// files that are no frames of Lahar.
Frame read_frame(const std::filesystem::path& file);

/// Version of the HDF5 library in use, "1.10.8".
std::string hdf5_version();

}  // namespace lahar
