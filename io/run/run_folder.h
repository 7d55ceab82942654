/// \file The output folder of a run.
///
///     manifest.json        written at the start (status "running"), completed at the end; a killed
///                          run stays "running"
///     scenario.json        the input as it was; scenario.full.json: with every default
///     log.txt              what the terminal showed
///     history.csv          conservation laws, one row per interval (io/run/history.h)
///     removed.csv          particles that left the mesh, where there are any (io/run/removed.h)
///     gauges/              a table for each gauge, where there are any (io/run/gauge_rows.h)
///     maps/                rasters of the whole run, where they are wanted (io/run/run_maps.h)
///     frames/              particles_STEP.hdf and particles.hdf.series, by FrameOutput; their
///                          format is in io/frames/vtkhdf.h; nodes_STEP.hdf and
///                          nodes.hdf.series, where the scenario wants nodes
///     checkpoints/         checkpoint_STEP.h5, from which the run can be continued
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/base/series.h"
#include "io/run/gauge_rows.h"
#include "io/run/history.h"
#include "io/run/manifest.h"
#include "io/run/removed.h"
#include "io/run/run_continuation.h"
#include "physics/base/types.h"

namespace lahar {

/// What a run puts into its folder at the start.
struct RunFolderContents {
  RunInfo info;
  std::string scenario;       ///< scenario.json
  std::string scenario_full;  ///< scenario.full.json
};

/// Output of one run, but for its frames. Member functions may be called from any thread. All throw
/// IoError.
class RunFolder {
 public:
  /// Make the folder. An existing one must be empty, or a run of Lahar and `overwrite` be true: its
  /// old results, or those of its stages, are then removed, and only those. `cleared`: they were,
  /// by remove_stages(), and what is left may stay. Throws InputError where it must not be touched,
  /// including a folder that another process is writing to.
  RunFolder(std::filesystem::path folder, const RunFolderContents& contents, bool overwrite = false,
            bool cleared = false);
  /// Go on with the run that is in the folder: what it wrote after that step is removed, its log
  /// goes on. Throws InputError where there is no run, or another process is writing to it.
  RunFolder(std::filesystem::path folder, const RunFolderContents& contents,
            const RunContinuation& from);
  /// Without finish(): completes the manifest as failed.
  ~RunFolder();

  void log(std::string_view line);  ///< a newline is added where there is none
  void history(const HistoryRow& row);
  void gauges(const GaugeRows& rows);
  void removed(std::span<const RemovedParticle> particles);
  /// Throws where the folder was removed, moved or replaced since it was claimed: what would be
  /// written is lost, or lands between the results of another run.
  void check_place() const;
  /// Bring the rows that were handed over to the disk; throws as check_place().
  void sync();
  /// Bring everything to the disk and complete the manifest. If that cannot be done, the manifest
  /// says failed and the error is thrown.
  void finish(const RunEnd& end);

  const std::filesystem::path& folder() const;
  /// Frames that a run that goes on has from before, for its index.
  KeptFrames kept_frames() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Throws InputError where RunFolder would not take a folder for a new run, and IoError where it
/// surely could not make it. Changes nothing.
void check_run_folder(const std::filesystem::path& folder, bool overwrite);
/// The same of a folder of a run with `stages`, each of which has a folder in it.
void check_run_folder(const std::filesystem::path& folder, const std::vector<std::string>& stages,
                      bool overwrite);

/// Whether an earlier run has results in a folder, or in folders of its stages there.
bool holds_run(const std::filesystem::path& folder);

/// Remove what an earlier run without stages wrote to a folder, but for files of the user.
void remove_unstaged_run(const std::filesystem::path& folder);
/// The same of stages in a folder. `goes` says which of them go, by name. Returns the names of the
/// folders that stay: the user has files there.
std::vector<std::string> remove_stages(const std::filesystem::path& folder,
                                       const std::function<bool(const std::string& name)>& goes);

/// Where the frames of a run belong.
std::filesystem::path frames_folder(const std::filesystem::path& run);

struct FrameFile {
  Index step;
  std::filesystem::path file;
};

/// Complete frames of a run, ascending steps. Throws IoError.
std::vector<FrameFile> frames_of_run(const std::filesystem::path& folder);

/// Position of the time that is nearest to `time`; of equally near ones the first. There is one.
std::size_t nearest_in(const std::vector<double>& times, double time);

/// The frame of `source` at `step` (the last one if none is given); a frame file stands for itself.
/// Throws InputError with the steps there are.
FrameFile find_frame(const std::filesystem::path& source, std::optional<Index> step = {});

/// File name of a frame: particles_0000001000.hdf.
std::string frame_name(Index step, std::string_view extension);
/// And of its nodes: nodes_0000001000.hdf.
std::string node_frame_name(Index step);

/// Files of nodes in the folder of frames, ascending steps. Throws IoError.
std::vector<FrameFile> node_frames_of_run(const std::filesystem::path& folder);

}  // namespace lahar
