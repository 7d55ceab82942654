/// \file Reading and validating a scenario: from files to a Model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "io/base/memory_limit.h"
#include "io/base/problems.h"
#include "io/base/team.h"
#include "io/geometry/map_files.h"
#include "io/scenario/model_marks.h"
#include "physics/base/error.h"
#include "physics/model/model.h"

namespace lahar {

struct ScenarioOptions {
  std::vector<std::string> overrides;  ///< "--set" arguments: /json/pointer=value or a.b.c=value
  bool as_cbgeo = false;               ///< what CB-Geo would have run (ignores "stress_update")
  const Team* team = nullptr;          ///< who reads it together; null = this process alone
  std::filesystem::path folder = {};   ///< that file names are relative to; empty = the scenario's
  std::string text_name = "scenario";  ///< of read_scenario_text(): the file that it stands for
  bool printed = false;                ///< read_scenario_text(): problems name no lines
  MemoryLimit memory = {};             ///< the same on all members of a team
  std::size_t stage = 0;               ///< of a scenario with stages: the one that is read
  std::vector<ModelMark>* marks = nullptr;  ///< filled for a picture, unless null; of one process
  /// Called with what is being done next, where that may take long.
  std::function<void(const std::string&)> phase = {};
  /// Called with the output folder and the names of the stages before the model is built, if no
  /// mistake has been found so far. It may throw.
  std::function<void(const std::string& folder, const std::vector<std::string>& stages)> planned =
      {};
};

/// A scenario that has been read completely.
struct Scenario {
  AnyModel model;
  std::vector<Problem> warnings;  ///< keys that the reference ignores, unusual values
  std::string text;               ///< the file as it was
  std::string full;               ///< JSON with every default filled in, for scenario.full.json
  std::filesystem::path file;
  std::vector<std::filesystem::path> side_files;  ///< what it refers to, as read
  MapFrame map = {};                              ///< where it lies
  std::vector<std::string> stages = {};           ///< names of all; empty = it has no stages
  std::size_t stage = 0;                          ///< the one that this is
  /// Says which particles have which class of materials with fields (material_fields.h): those of
  /// the beginning, then those of each source that stages place. 0 = none has one.
  std::vector<std::uint64_t> classes = {};
  std::vector<std::string> loads = {};  ///< what tractions and forces at nodes are in all, in words
  /// Gives a problem that names a JSON pointer (Problem::where) its file, line, column and source:
  /// for what only the simulation finds out.
  std::function<Problem(Problem)> place;
};

/// Read `file` with its side files. Throws InputError with every problem found; a file that cannot
/// be read is one of them.
///
/// A team reads it together (collective): each member gets the same model but for the particles, of
/// which it has about an equal share, with their ids (ParticleTable::id) ascending; in the lists of
/// particles of loads and constraints are those of its own. All shares together are, bit for bit,
/// what one process alone gets, and so are problems and warnings, which every member has.
Scenario read_scenario(const std::filesystem::path& file, const ScenarioOptions& options = {});

/// The same from text; side files are looked up in `folder`.
Scenario read_scenario_text(const std::string& text, const std::filesystem::path& folder,
                            const ScenarioOptions& options = {});

}  // namespace lahar
