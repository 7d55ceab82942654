/// \file `lahar export`: frames of a run in other formats.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/base/problems.h"
#include "io/run/run_folder.h"

namespace lahar {

enum class ExportFormat { csv, vtu, cbgeo, stl, vtp };

/// Throws InputError unless `name` is "csv", "vtu", "cbgeo", "stl" or "vtp".
ExportFormat export_format(const std::string& name);

/// Which frames of a run.
struct FrameChoice {
  enum class Kind { last, all, step } kind = Kind::last;
  Index step = 0;  ///< Kind::step only
};

/// "last", "all", or a number of a step.
FrameChoice frame_choice(const std::string& word);

/// The frames of a run that are chosen; a frame file stands for itself. Throws InputError, IoError.
std::vector<FrameFile> chosen_frames(const std::filesystem::path& source,
                                     const FrameChoice& choice);

/// Write frames of `source` (a run folder or one .hdf frame) in another format.
/// `output`: a folder, which receives particles_STEP.csv or .vtu, and particles.pvd for several
/// .vtu, or particlesSTEP.h5 as CB-Geo MPM counts and names them (io/frames/cbgeo_table.h), or
/// particles_STEP.stl or .vtp with the free surface; or, for a single frame, a file name with the
/// format's extension; empty = SOURCE/export (run), or beside the frame. `spacing` [m]: of the grid
/// for the surface (free_surface.h). Every file appears whole. Returns the files written; an index
/// comes last. Adds to `warnings`, if given. Throws InputError (nothing there, no such step, a file
/// that a run wrote would be replaced), IoError.
std::vector<std::filesystem::path> export_run(const std::filesystem::path& source,
                                              ExportFormat format, FrameChoice choice = {},
                                              std::filesystem::path output = {}, double spacing = 0,
                                              std::vector<Problem>* warnings = nullptr);

}  // namespace lahar
