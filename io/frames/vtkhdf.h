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
///
/// All data is contiguous and plain, so that every rank and thread writes its own particles to
/// their places (frame_layout.h, frame_slabs.h). Particles are in the order in which the patches
/// hold them, and patches ascend (rank after rank, where patches were given to other ranks to
/// balance their work): `id` says who is who.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/frames/frame.h"

namespace lahar {

/// Write one frame atomically. Throws IoError.
void write_frame(const Frame& frame, const std::filesystem::path& file);

/// Read a frame file; every number comes back bit by bit, particles by ascending id. Throws
/// IoError, also for HDF5 files that are no frames of Lahar.
Frame read_frame(const std::filesystem::path& file);
/// The same with these columns only; those that the file does not have are left out.
Frame read_frame(const std::filesystem::path& file, const std::vector<std::string>& columns);

/// What a frame file says of itself. Throws likewise.
FrameHeader read_frame_header(const std::filesystem::path& file);

/// Version of the HDF5 library in use, "1.10.8".
std::string hdf5_version();

}  // namespace lahar
