/// \file Frames as VTK XML UnstructuredGrid files (.vtu) and their time index (.pvd).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/frame.h"

namespace lahar {

/// Write one frame atomically, as appended raw binary data. Throws IoError.
void write_vtu(const Frame& frame, const std::filesystem::path& file);

struct TimedFile {
  double time;       ///< [s]
  std::string name;  ///< relative to the index
};

/// Write the index that ParaView opens as a time series. Throws IoError.
void write_pvd(const std::vector<TimedFile>& files, const std::filesystem::path& file);

}  // namespace lahar
