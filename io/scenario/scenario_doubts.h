/// \file What a reader notes about generators and walls, for warnings that need the whole model.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "io/json/json_source.h"
#include "physics/base/types.h"

namespace lahar {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// Particles of one layer lie behind each other by less than this, in the mean.
inline constexpr double one_layer = 1.5;

/// Particles of a traction that lie behind others, and have no load.
struct HiddenLoads {
  std::vector<bool> is_hidden;  ///< of all particles of the traction
  Index count = 0, loaded = 0;  ///< hidden ones; those of the set
  Index deepest = 1;            ///< the most particles behind each other
  double area = 0;              ///< [m^2; m per m of depth] on which it acts
  int axis = 0;                 ///< along which they lie behind each other
};

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
