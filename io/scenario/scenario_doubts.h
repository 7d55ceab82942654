/// \file What a reader notes about generators and walls, for warnings that need the whole model.
#pragma once

#include <cstddef>
#include <limits>

#include "io/json/json_source.h"
#include "physics/base/types.h"

namespace lahar {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// Particles of one layer lie behind each other by less than this, in the mean.
inline constexpr double one_layer = 1.5;

/// A generator and the rows of its particles.
struct GeneratorRows {
  const JsonValue* generator;
  Index first, end;  ///< rows [first, end) of all members
  int parts = 0;     ///< of a cell along each axis, one for each particle; 0: other particles
};

/// An entry of friction constraints or walls, and the elements of entries_of<NodeFriction>() it
/// made.
struct FrictionEntry {
  const JsonValue* entry;
  std::size_t first, end;  ///< of this member
};

}  // namespace lahar
