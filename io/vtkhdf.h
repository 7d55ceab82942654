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
  /// Deflate level of floating-point data, 0 to 9. Particle states hardly shrink: 2D frames to 54 %
  /// and 3D ones to 82 %, at 30 times the time of writing them plainly, while all cores compute.
  int value_deflate = 0;
};

/// Write one frame atomically. Throws IoError.
void write_frame(const Frame& frame, const std::filesystem::path& file,
                 const FrameFileOptions& options = {});

/// Read a file of write_frame(); every number comes back bit by bit. Throws IoError, also for HDF5
/// files that are no frames of Lahar.
Frame read_frame(const std::filesystem::path& file);

/// Version of the HDF5 library in use, "1.10.8".
std::string hdf5_version();

}  // namespace lahar
