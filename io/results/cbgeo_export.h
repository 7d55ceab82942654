/// \file Frames as particle files of CB-Geo MPM, from which it and Lahar can go on
/// (analysis.resume).
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "io/frames/frame.h"

namespace lahar {

/// What the files need to know besides a frame.
struct CbgeoRun {
  Index nsteps = 0;  ///< of the run; 0 = unknown
  /// State variables of each material's law, in CB-Geo MPM's order, by material id.
  std::map<Index, std::vector<std::string>> states;
};

/// From scenario.full.json of the run that a frame or folder belongs to. Throws IoError where it
/// cannot be read.
CbgeoRun read_cbgeo_run(const std::filesystem::path& run);

/// Write a frame. Frames have no natural sizes (0 in the file), no cells (-1), and of the
/// volumetric strain the trace of the strain. Throws InputError for a frame before the first step,
/// which has no counterpart, for one with a liquid in pores, and where fields are missing; IoError.
void write_cbgeo(const Frame& frame, const CbgeoRun& run, const std::filesystem::path& file);

}  // namespace lahar
