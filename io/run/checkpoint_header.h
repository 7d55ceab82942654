/// \file What a checkpoint says about the run that it belongs to.
#pragma once

#include <array>
#include <filesystem>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "physics/base/types.h"
#include "physics/particles/patch.h"

namespace lahar {

/// What the watchdog found wrong (runtime/step/watchdog.h).
struct WatchdogAlarm {
  enum class Kind { energy, speed, time_step, volume } kind = Kind::energy;
  Index step = -1;        ///< steps done when it was found
  double time = 0;        ///< [s] then
  double value = 0;       ///< what the key of the kind bounds; of volumes none
  std::string text = {};  ///< what is wrong, a sentence
};

/// What the watchdog remembers of a run.
struct WatchdogState {
  double stored = 0;      ///< [J] most elastic energy that stresses held at the start
  double put_in = 0;      ///< [J] most energy that had come from there and from outside
  double speed = 0;       ///< [m/s] of the fastest particle at the start
  double first_step = 0;  ///< [s] as it was or would have been without output; adaptive runs
  Index end_step = -1;    ///< at which `alarm` ends the run; -1 = there is none
  WatchdogAlarm alarm = {};
};

/// A rigid body between two steps. Arrays have three components in two dimensions, too.
struct RigidBodyState {
  std::string name;
  std::array<double, 3> origin{}, velocity{}, spin{};  ///< as in Placement
  std::array<double, 9> axes{};                        ///< row by row
  std::array<double, 3> force{}, torque{};             ///< of particles, in the step that comes
  std::array<double, 3> moved{};                       ///< as in RigidBody
  std::array<double, 9> turned{1, 0, 0, 0, 1, 0, 0, 0, 1};
};

/// What gauges and maps remember of a run (runtime/step/gauges.h).
struct GaugeState {
  double time = 0;                  ///< [s] of the last row
  std::vector<double> beyond = {};  ///< [kg] by plane: beyond it at the start; passed at last row
  std::vector<Index> removed = {};  ///< [kg] by plane: beyond it and left the mesh; an exact sum
  std::vector<double> maps = {};    ///< all rasters, one after the other
};

/// How near a run is to equilibrium (runtime/step/equilibrium.h).
struct RestState {
  bool reached = false;   ///< the run has ended because of it
  double imbalance = -1;  ///< [-] unbalanced forces over loads; -1 = not known yet
  double kinetic = -1;    ///< [-] kinetic energy over that of stresses; -1 = not asked for
};

/// The numbers of a simulation between two steps: what goes on with the patches' states.
struct RunState {
  int dim = 0;
  Index step = 0;   ///< steps done
  double time = 0;  ///< [s]
  double dt = 0;    ///< [s] of the last step
  /// [s] least of all particles in the last step, from which an adaptive run takes its next one. Of
  /// implicit steps the length of the next one, where output does not shorten it.
  double dt_limit = std::numeric_limits<double>::infinity();
  Index particles = 0, removed = 0;
  Index next_id = 0;                    ///< of a particle that is injected next
  Index history_steps = 0;              ///< steps between rows of history.csv
  PatchWork work = {};                  ///< since the start, up to the last of these rows
  double kinetic_at_start = 0;          ///< [J]
  Index cells_per_patch = 0;            ///< that the cut of the mesh aims at
  double least_mass = 0;                ///< Patch::least_mass [kg]
  std::string columns;                  ///< of a particle, and their components
  std::vector<PatchSplit> splits = {};  ///< of patches, since the start, in order
  /// Steps after which patches are to be split, as was decided before; -1 = none.
  Index split_step = -1;
  WatchdogState watchdog = {};
  std::vector<RigidBodyState> rigid_bodies = {};  ///< all of them
  RestState rest = {};
  GaugeState gauges = {};
};

/// A file that the scenario refers to.
struct SideFileHash {
  std::string file;
  std::string sha256;
  bool operator==(const SideFileHash&) const = default;
};

struct CheckpointHeader {
  std::string version, commit, compiler;  ///< of the program
  RunState run;
  std::string scenario;  ///< JSON with every default filled in
  std::vector<SideFileHash> side_files;
};

/// Version of the file's layout; other versions are refused.
inline constexpr int checkpoint_format = 4;

std::string header_text(const CheckpointHeader& header);
/// Throws IoError without a file name: what is wrong with the text.
CheckpointHeader read_header(const std::string& text);

/// Hashes of files, in order. Throws IoError.
std::vector<SideFileHash> hashes_of(const std::vector<std::filesystem::path>& files);

}  // namespace lahar
