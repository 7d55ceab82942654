/// \file Indices of files over time, which ParaView opens as one time series.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lahar {

struct TimedFile {
  double time;       ///< [s]
  std::string name;  ///< relative to the index
};

/// NAME.series: JSON index of any kind of file. Written atomically. Throws IoError.
void write_series(const std::vector<TimedFile>& files, const std::filesystem::path& file);

/// NAME.pvd: XML index of VTK XML files. Written atomically. Throws IoError.
void write_pvd(const std::vector<TimedFile>& files, const std::filesystem::path& file);

}  // namespace lahar
