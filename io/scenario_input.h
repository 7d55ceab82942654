/// \file What the parts of the scenario reader share: the document, its folder, its problems.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "io/json_source.h"
#include "io/side_files.h"
#include "io/values.h"

namespace lahar {

/// A scenario that is being read.
struct ScenarioInput {
  std::string file;  ///< as the user wrote it
  JsonDocument document;
  ProblemList problems;
  std::filesystem::path folder;
  std::string stem;  ///< of the scenario's file name, for the run folder
  bool as_cbgeo = false;
  std::vector<std::filesystem::path> side_files = {};  ///< opened so far

  void error(const JsonValue& at, std::string message, std::string hint = "") {
    problems.error(document.at(at, std::move(message), std::move(hint)));
  }
  void warning(const JsonValue& at, std::string message, std::string hint = "") {
    problems.warning(document.at(at, std::move(message), std::move(hint)));
  }
  /// The side file under `key` of `object`; nothing if there is no key, or no such file (reported).
  std::optional<SideFile> open(const JsonValue& object, std::string_view key);
  /// The value under the first of two keys of the same meaning; both at once are an error.
  const JsonValue* either(const JsonValue& object, std::string_view key, std::string_view alias);
};

/// The sets of one kind (nodes, cells or particles), by id and by name.
struct EntitySets {
  std::string kind;  ///< "node", "cell", "particle"
  std::unordered_map<Index, std::vector<Index>> by_id;
  std::map<std::string, std::vector<Index>> by_name;
  bool all_known = true;  ///< false: some could not be read, so a missing one is no error

  /// The set that `value` (an id or a name) means; null if there is none (reported).
  const std::vector<Index>* find(const JsonValue& value, ScenarioInput& in) const;
};

/// Sets of entity_sets.json.
struct EntityFile {
  EntitySets nodes{"node", {}, {}}, cells{"cell", {}, {}}, particles{"particle", {}, {}};
};

/// Read mesh.entity_sets; ids of nodes and cells are checked against their numbers (-1: unknown).
EntityFile read_entity_sets(const JsonValue& mesh, Index n_nodes, Index n_cells, ScenarioInput& in);

/// "0, 1, 2, ... (12)" for messages.
std::string list_some(const std::vector<std::string>& names);

}  // namespace lahar
