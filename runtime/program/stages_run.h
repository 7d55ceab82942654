/// \file A run of a scenario with stages: one run folder for each, one after the other.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/program/case_run.h"

namespace lahar {

/// What a run says on this rank.
Console::Voice voice_of(const RunArguments& arguments);

/// Until there are steps, a signal ends the program at once: as one that was stopped where the run
/// goes on from a checkpoint, else by itself.
void end_before_steps(const RunArguments& arguments, bool goes_on);

/// Warnings of stages, each of which says again what those before it said.
class StageWarnings {
 public:
  void say(const std::vector<Problem>& warnings, Console& console);

 private:
  std::vector<Problem> said_;
};

/// "stage      2 of 3: failure".
std::string stage_line(const Scenario& scenario);

class StagesRun {
 public:
  using Read = std::function<Scenario(std::size_t stage)>;

  /// Reads all stages, the first of which has been read, before any begins. Throws InputError.
  StagesRun(const RunArguments& arguments, Read read, Scenario first, Console& console);
  /// Returns the exit status of the stage that ended the run.
  int execute();

 private:
  struct Begin {
    std::size_t stage = 0;
    std::string restart = {};  ///< as RunArguments::restart, of that stage
  };
  std::string folder(std::size_t stage) const;
  /// The stage that has not ended, or the one whose checkpoint is named.
  Begin begin() const;
  std::unique_ptr<CheckpointReader> end_of(std::size_t stage, Console& console) const;
  /// Throws where stages lie in the folder that the scenario does not have. Collective.
  void refuse_other_stages() const;
  /// Remove what lies in the folder and is not of this run, which begins with that stage. On the
  /// rank that makes folders, before it makes the first.
  void clear(std::size_t first);
  int run(std::size_t stage, const Begin& from, Console& console);

  const RunArguments& arguments_;
  Read read_;
  Console& console_;
  std::string folder_;
  std::vector<std::string> names_;
  std::vector<std::string> full_;  ///< Scenario::full of each
  std::vector<std::string> left_;  ///< stages whose folders clear() has left, with other files
  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
};

/// What is wrong with the output folder that a scenario names: it must lie in the scenario's own,
/// as the scenario may be of others. Symbolic links are those of the disk, and not looked at.
std::optional<Problem> distant_output(const RunArguments& arguments, const std::string& planned);

/// Throws where the run could not have its output folder, `planned` by the scenario, so that it
/// ends before the model is built. Collective.
void check_output(const RunArguments& arguments, const std::string& planned,
                  const std::vector<std::string>& stages);

/// The run of a scenario, or of its stages one after the other. Returns the exit status.
int run_scenario(const RunArguments& arguments, StagesRun::Read read, Scenario scenario,
                 Console& console);

}  // namespace lahar
