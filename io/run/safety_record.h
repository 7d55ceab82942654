/// \file What a search for a factor of safety leaves in its folder.
///
///     safety.json   how the search stands: bracket, bounds, and the state that trials begin with
///     safety.csv    the trials in their order, written anew when one ends
///     log.txt       what the terminal showed, but for the runs
///     equilibrium/  the run with full strength
///     mechanism/    the trial that failed with the least factor, as a run
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/run/checkpoint_header.h"
#include "io/run/manifest.h"

namespace lahar {

/// What bounds the search.
struct SafetyBounds {
  double most = 16;         ///< larger factors are not looked for
  double tolerance = 0.01;  ///< of the bracket, as a share of the factor
};

/// A factor by which strength was divided, and what came of it.
struct SafetyTrial {
  enum class End {
    rest,      ///< the body has an equilibrium
    settles,   ///< still moves after FailureBounds::time, but as bodies do that settle
    moved,     ///< beyond FailureBounds::displacement
    restless,  ///< still moves after FailureBounds::time
    broke      ///< a step could not be taken
  };
  double factor;
  End end = End::rest;
  Index steps = 0;
  double displacement = 0;   ///< [m] largest of a particle, from full strength on
  std::string problem = {};  ///< why a step could not be taken; not in safety.csv
  bool stable() const { return end == End::rest || end == End::settles; }
};
const char* name_of(SafetyTrial::End end);

struct SafetyResult {
  double stable = 1;            ///< largest factor with an equilibrium
  std::optional<double> fails;  ///< least without one; nothing: none up to SafetyBounds::most
  std::vector<SafetyTrial> trials;
  /// Takes a trial for one of the search.
  void add(SafetyTrial trial);
  /// The middle of the bracket.
  double factor() const { return fails ? 0.5 * (stable + *fails) : stable; }
  /// That of the least factor that fails; null where there is none.
  const SafetyTrial* failure() const;
};

/// safety.json, but for the bracket.
struct SafetyRecord {
  std::string title, divided;  ///< divided: whose strength, in words
  std::string version, commit, compiler;
  std::vector<std::string> command;
  SafetyBounds bounds;
  SideFileHash equilibrium;         ///< checkpoint that trials begin with; "" = not there yet
  std::optional<double> mechanism;  ///< factor of the trial that mechanism/ has
  std::string started, ended;       ///< utc_now(); ended: "" = goes on, or was killed
  RunStatus status = RunStatus::running;
  std::string message;  ///< why it failed or stopped
};

/// What is in a folder of a search.
struct SafetyResults {
  SafetyRecord record;
  SafetyResult result;
};

std::filesystem::path safety_table(const std::filesystem::path& folder);  ///< safety.csv

/// The text of safety.csv.
std::string safety_table_text(const SafetyResult& result);
/// And back, as far as it has whole rows of trials.
SafetyResult safety_result_of(const std::string& table);

/// Throws IoError.
void write_safety_record(const std::filesystem::path& folder, const SafetyRecord& record,
                         const SafetyResult& result);
/// The search in a folder; nothing where there is none. Throws IoError.
std::optional<SafetyResults> read_safety(const std::filesystem::path& folder);
/// Removes safety.json and safety.csv.
void remove_safety(const std::filesystem::path& folder);

}  // namespace lahar
