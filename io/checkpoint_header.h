/// \file What a checkpoint says about the run that it belongs to.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "physics/patch.h"
#include "physics/types.h"

namespace lahar {

/// The numbers of a simulation between two steps: what goes on with the patches' states.
struct RunState {
  int dim = 0;
  Index step = 0;   ///< steps done
  double time = 0;  ///< [s]
  double dt = 0;    ///< [s] of the last step
  /// [s] least of all particles in the last step, from which an adaptive run takes its next one.
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
inline constexpr int checkpoint_format = 2;

std::string header_text(const CheckpointHeader& header);
/// Throws IoError without a file name: what is wrong with the text.
CheckpointHeader read_header(const std::string& text);

/// Hashes of files, in order. Throws IoError.
std::vector<SideFileHash> hashes_of(const std::vector<std::filesystem::path>& files);

}  // namespace lahar
