/// \file Frames as VTK XML UnstructuredGrid files.
#pragma once

#include <filesystem>

#include "io/frames/frame.h"

namespace lahar {

/// Write one frame atomically: vertex cells, appended raw binary data, FieldData TimeValue and
/// step. Vectors are padded to 3 components; tensors are xx yy zz xy yz xz. Throws IoError.
void write_vtu(const Frame& frame, const std::filesystem::path& file);

}  // namespace lahar
