/// \file What the parts of the scenario reader share: the document, its folder, its problems.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "io/base/memory_limit.h"
#include "io/base/side_files.h"
#include "io/base/team.h"
#include "io/geometry/map_files.h"
#include "io/json/json_source.h"
#include "io/json/values.h"
#include "io/scenario/model_marks.h"

namespace lahar {

/// A scenario that is being read.
struct ScenarioInput {
  std::string file;  ///< as the user wrote it
  JsonDocument document;
  ProblemList problems;
  std::filesystem::path folder;
  std::string stem;  ///< of the scenario's file name, for the run folder
  bool as_cbgeo = false;
  const Team* team = nullptr;                          ///< never null
  std::vector<std::filesystem::path> side_files = {};  ///< opened so far
  MemoryLimit memory = {};
  std::function<void(const std::string&)> phase = {};  ///< called with what is done next, if set
  bool cbgeo_defaults = false;  ///< keys that are not written mean what they do in CB-Geo MPM
  MapFrame map = {};
  std::vector<ModelMark>* marks = nullptr;  ///< to be filled, unless null
  std::vector<std::uint64_t> classes = {};  ///< Scenario::classes
  std::string stage = {};  ///< which one, in messages; empty = the first, or there are none
  std::vector<std::string> own_loads = {};  ///< keys of external_loading_conditions it writes
  /// Of this stage and those before: generators at the end of `particles`, and new materials.
  std::size_t placed = 0;
  std::vector<JsonValue> given_materials = {};
  bool assigns_later = false;  ///< stages after this one place particles, or change materials
  bool keeps_strains = false;  ///< StageChanges::keeps_strains
  std::function<void(const std::string& folder)> planned = {};  ///< called early, if set
  std::vector<std::string> loads = {};                          ///< Scenario::loads

  void error(const JsonValue& at, std::string message, std::string hint = "") {
    problems.error(document.at(at, std::move(message), std::move(hint)));
  }
  void warning(const JsonValue& at, std::string message, std::string hint = "") {
    problems.warning(document.at(at, std::move(message), std::move(hint)));
  }
  /// The side file under `key` of `object`; nothing if there is no key, or no such file (reported).
  /// Collective, if there is the key; all members get it, or none.
  std::optional<SideFile> open(const JsonValue& object, std::string_view key);
  /// The side file that a text names. `whole`: it will be in memory, so it must fit.
  std::optional<SideFile> open_named(const JsonValue& name, bool whole = true);
  /// The value under the first of two keys of the same meaning; both at once are an error.
  const JsonValue* either(const JsonValue& object, std::string_view key, std::string_view alias);
};

/// The sets of one kind (nodes, cells or particles), by id and by name.
struct EntitySets {
  std::string kind;  ///< "node", "cell", "particle"
  // What this member of the team has of them.
  std::unordered_map<Index, std::vector<Index>> by_id;
  std::map<std::string, std::vector<Index>> by_name;
  bool all_known = true;  ///< false: some could not be read, so a missing one is no error

  /// The set that `value` (an id or a name) means; null if there is none (reported).
  const std::vector<Index>* find(const JsonValue& value, ScenarioInput& in) const;
};

/// What is known of a set whose members are not kept.
struct SetOutline {
  Index first = -1;         ///< member
  Index count = 0;          ///< members
  bool consecutive = true;  ///< first, first + 1, ...
  void add(Index id);
};

/// Sets of entity_sets.json. Each member of the team has a part of their members: of a set of nodes
/// those of directory_rank(), of a set of cells an equal part of the list (Team::part()), of sets
/// of particles those that it holds, which it takes when the particles are there.
struct EntityFile {
  EntitySets nodes{"node", {}, {}}, cells{"cell", {}, {}}, particles{"particle", {}, {}};
  std::unordered_map<Index, SetOutline> outlines;  ///< of particle sets, whose `by_id` are empty
  // Where the members are: in a file, with its sets in order, or here.
  std::optional<SideFile> file;
  std::vector<Index> particle_sets;
  std::unordered_map<Index, std::vector<Index>> listed;
};

/// Read mesh.entity_sets; ids of nodes and cells are checked against their numbers (-1: unknown).
/// Collective.
EntityFile read_entity_sets(const JsonValue& mesh, Index n_nodes, Index n_cells, ScenarioInput& in);

/// The members of a file's particle sets: calls `visit(set, member)` in the order of the file.
void visit_particle_sets(const EntityFile& sets, const std::function<void(Index, Index)>& visit);

/// Read sets without keeping the file in memory. Only what is as it should be: nothing if there is
/// anything to complain about, for any member of the team.
std::optional<EntityFile> stream_entity_sets(const SideFile& file, Index n_nodes, Index n_cells,
                                             const Team& team);

/// "0, 1, 2, ... (12)" for messages.
std::string list_some(const std::vector<std::string>& names);

}  // namespace lahar
