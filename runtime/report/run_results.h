/// \file Everything that a run has left, as a report shows it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/run/run_folder.h"
#include "io/run/safety_record.h"
#include "io/run/table.h"
#include "runtime/picture/placed_bodies.h"

namespace lahar {

/// A row of the table of stages of the time step at the end of a log.
struct StageShare {
  std::string name;
  double seconds = 0, share = 0;  ///< [s] of all threads; 0 to 1 of their time
};

struct GaugeSeries {
  std::string name;
  Table table;
};

struct RunMap {
  std::string name, unit, meaning;
  std::filesystem::path file;  ///< ESRI ASCII
};

/// One run folder.
struct RunPart {
  std::string name;      ///< of the stage of a scenario; "" of a run without stages
  bool is_stage = true;  ///< else `name` is what the run is of a search for a factor of safety
  std::filesystem::path folder;
  nlohmann::json manifest;
  std::string scenario;  ///< the input as it was
  bool axisymmetric = false;
  Table history, bodies;
  PlacedBodies shapes;
  std::vector<GaugeSeries> gauges;
  std::vector<RunMap> maps;
  std::vector<StageShare> stages;
  std::vector<std::string> warnings;
  std::vector<FrameFile> frames;
  std::size_t removed = 0;  ///< particles that left the mesh
  double begin = 0;         ///< [s] of all stages before

  /// "stage rest", "mechanism".
  std::string heading() const { return (is_stage ? "stage " : "") + name; }
  std::string text(const char* key) const;
  double number(const char* key) const;  ///< 0 where it is missing
  double model(const char* key) const;   ///< likewise, of the manifest's "model"
  std::string status() const { return text("status"); }
  double end_time() const;  ///< [s] simulated, also of a run that goes on
  /// The step at which the last restart began; before it nothing was timed.
  double timed_from() const;
};

/// A run: its stages, or itself; or a search for a factor of safety with its runs.
struct RunResults {
  std::string label;  ///< in charts and above columns
  std::string title;
  std::vector<RunPart> parts;
  std::optional<SafetyResults> safety = {};

  const RunPart& last() const { return parts.back(); }
  double steps() const;
  double wall_seconds() const;  ///< since the last restart
  double end_time() const;      ///< of all stages
  /// Updates of particles in wall_seconds(); from the history where their number changes.
  double particle_steps() const;
};

/// Throws InputError where there is no run folder, IoError.
RunResults read_run(const std::filesystem::path& folder);

}  // namespace lahar
