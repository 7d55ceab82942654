/// \file What a run folder has to lose before a run goes on from a checkpoint in it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/base/series.h"
#include "io/run/gauge_rows.h"
#include "physics/base/types.h"

namespace lahar {

/// Where a run goes on.
struct RunContinuation {
  Index step = 0;
  double time = 0;            ///< [s]
  bool has_row = true;        ///< an undisturbed run has a row of history.csv at this step
  bool has_frame = true;      ///< and a frame
  std::string checkpoint;     ///< file that it goes on from
  bool has_gauge_row = true;  ///< an undisturbed run has rows of gauges at this step
};

/// Files that a run that goes on has from before, for their indices.
struct KeptFrames {
  std::vector<TimedFile> particles, nodes;
};

/// Remove rows of history.csv that an undisturbed run would not have written by then.
void rewind_history(const std::filesystem::path& run, const RunContinuation& from);
/// The same of rigid_bodies.csv, where there is one.
void rewind_rigid_bodies(const std::filesystem::path& run, const RunContinuation& from);

/// The same of the tables of gauges.
void rewind_gauges(const std::filesystem::path& run, const std::vector<GaugeTable>& tables,
                   const RunContinuation& from);

/// The same with removed.csv, which goes where no row is left.
void rewind_removed(const std::filesystem::path& run, const RunContinuation& from);

/// The same with frames and the nodes that come with them; returns those that are left, and lists
/// them in their series.
KeptFrames rewind_frames(const std::filesystem::path& run, const RunContinuation& from);

}  // namespace lahar
