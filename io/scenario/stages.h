/// \file Stages of a scenario: runs that follow each other, each of which begins with the state in
/// which the one before ended.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "io/scenario/scenario.h"
#include "io/scenario/scenario_input.h"

namespace lahar {

/// Bring the document into the form of one of its stages: all changes up to this one are merged
/// into it, and the list of stages is gone. Returns the names of all stages; none if the scenario
/// has no stages. What a stage must not change is reported.
std::vector<std::string> take_stage(ScenarioInput& in, std::size_t stage);

/// What of a model must be the same in all stages.
struct StageBody {
  bool two_phase = false, projection = false;
  ShapeFunctions functions = ShapeFunctions::element;
  int bodies = 1;
  Plane plane = Plane::strain;
  std::vector<std::uint64_t> classes = {};  ///< Scenario::classes
  /// Of rigid bodies that are there again, by name, what they are made of.
  std::map<std::string, std::string> rigid_bodies = {};
  /// Of free rigid bodies, by name, the motion with which they begin where they are new.
  std::map<std::string, std::string> starts = {};
  bool b_bar = false;  ///< may change, but not without a word
  /// Keys of conditions whose springs follow displacements of particles.
  std::vector<std::string> foundations = {};
};
StageBody body_of(const Scenario& scenario);

/// Throws InputError where a stage is not one of the body of the stage before it.
void check_body(const StageBody& before, const Scenario& stage);

/// Warnings where a stage takes another method than the one before, by default or as written, and
/// where it gives a motion to a free rigid body that keeps its own, and where springs begin that
/// know what moved before.
std::vector<Problem> changes_of_method(const StageBody& before, const Scenario& stage);

/// Whether a stage does to the particles what the one before did, at any time: scenarios with every
/// default (Scenario::full) that differ only in how long they run and in what they write.
bool goes_on_alike(const std::string& before, const std::string& stage);

}  // namespace lahar
