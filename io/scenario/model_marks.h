/// \file What a scenario does to its model at which places, for pictures of it: constraints, walls,
/// loads and water tables, with the names of their sets.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "io/json/json_source.h"
#include "physics/base/types.h"

namespace lahar {

/// What an entry acts on, by its set: "floor", "set 3", "all"; "of a file" without one.
std::string name_of_set(const JsonValue* set);

/// One of them. All entries of one kind for one set are one mark.
struct ModelMark {
  enum class Kind { held, moved, wall, soft, load, water } kind = Kind::held;
  std::string label;                     ///< "floor: held in x, y"
  bool everywhere = false;               ///< on all nodes or particles; the lists are empty
  std::vector<Index> nodes, particles;   ///< ids
  std::array<double, 3> direction = {};  ///< of loads and motions; its signs count
  /// Points of a water table, ascending: {position [m] along axis `along`, level [m] along `up`}.
  std::vector<std::array<double, 2>> levels = {};
  int along = 0, up = 0;
};

}  // namespace lahar
