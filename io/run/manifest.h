/// \file manifest.json of a run folder: who computed what, with what, and how it ended.
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/run/body_shapes.h"
#include "io/run/gauge_rows.h"
#include "physics/base/types.h"

namespace lahar {

/// Known when a run starts.
struct RunInfo {
  std::string title;
  Index stage = 0;  ///< 1 for the first stage of a scenario; 0 without stages
  std::string version, commit, compiler;
  std::vector<std::pair<std::string, std::string>> libraries;  ///< name, version
  std::vector<std::string> command;                            ///< program and arguments
  int ranks = 1, threads = 1;
  int dim = 0;
  std::string scheme;
  Index nodes = 0, cells = 0, particles = 0, materials = 0, patches = 0;
  Index patch_particles = 0;              ///< wanted in a patch
  Index split_steps = 0;                  ///< Analysis::split_steps
  Index steps = 0;                        ///< planned; 0 = until end_time
  double dt = 0;                          ///< [s] the first one
  double dt_limit = 0;                    ///< [s] CFL limit at the start
  std::array<double, 2> map_origin = {};  ///< [m] place on the map where the model has x = y = 0
  std::string map_reference;              ///< WKT of its coordinate reference system, if known
  std::vector<std::string> changes;       ///< by a stage to particles, when it began
  std::vector<GaugeTable> gauges;         ///< tables in gauges/
  std::vector<GaugeColumn> maps;          ///< rasters in maps/
  std::vector<BodyShape> bodies;          ///< surfaces in bodies/
  std::vector<std::filesystem::path> inputs;  ///< scenario and side files; their hashes are stored
};

/// A run that went on from a checkpoint.
struct RunRestart {
  Index step = 0;
  double time = 0;         ///< [s]
  std::string checkpoint;  ///< file
};

enum class RunStatus { running, finished, failed, stopped };
const char* name_of(RunStatus status);

/// The present time as files have it: 2026-01-31T08:15:00Z.
std::string utc_now();

/// Known when it ends.
struct RunEnd {
  RunStatus status = RunStatus::finished;
  std::string message;  ///< why it failed or stopped
  double wall_seconds = 0;
  Index steps = 0;                ///< updates done
  double time = 0;                ///< [s] simulated
  Index patches = 0, splits = 0;  ///< there are then; were made since the start of the run
  std::vector<std::string> warnings;
};

/// The manifest as JSON text. Hashes the inputs (unreadable ones are stored as null).
class Manifest {
 public:
  explicit Manifest(const RunInfo& info);  ///< status "running", start time, host, process
  /// The same for a run that goes on, from the manifest that it has: what the model was at the
  /// start stays, and the restart is added to the list of them.
  Manifest(const RunInfo& info, const std::string& earlier, const RunRestart& restart);
  std::string text() const { return with_end(nullptr); }
  std::string text(const RunEnd& end) const { return with_end(&end); }

 private:
  std::string with_end(const RunEnd* end) const;
  std::string start_;  // JSON
};

/// The manifest.json in `folder`, if Lahar wrote one there.
std::optional<nlohmann::json> read_manifest(const std::filesystem::path& folder);
/// True if there is one.
bool is_run_folder(const std::filesystem::path& folder);

struct FolderOfRun {
  std::filesystem::path folder;
  nlohmann::json manifest;
};

/// The runs whose folders lie in a folder: stages in their order, or members of a study.
std::vector<FolderOfRun> runs_in(const std::filesystem::path& folder);

/// Of them those of the stages of a scenario, in their order; none where the first is not there.
std::vector<FolderOfRun> stages_in(const std::filesystem::path& folder);

/// The folders with the results of a run: itself, or those of its stages in their order, of two
/// with one number the later one. Throws InputError where there are none.
std::vector<FolderOfRun> folders_of_run(const std::filesystem::path& run);

}  // namespace lahar
