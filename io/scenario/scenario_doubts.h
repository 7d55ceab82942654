/// \file What a reader notes about generators and walls, for warnings that need the whole model.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "io/json/json_source.h"
#include "physics/base/types.h"

namespace lahar {

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// "from (x, y) to (x, y)".
template <int Dim>
std::string extent(const std::pair<Vec<Dim>, Vec<Dim>>& box) {
  // Six digits hide the tolerance by which regions are wider.
  const auto point = [](const Vec<Dim>& x) {
    std::string text;
    for (int d = 0; d < Dim; ++d)
      text += fmt::format("{}{:.6g}", d > 0 ? ", " : "", std::abs(x[d]) < 1e-8 ? 0.0 : x[d]);
    return text;
  };
  return fmt::format("from ({}) to ({})", point(box.first), point(box.second));
}

/// Particles of one layer lie behind each other by less than this, in the mean.
inline constexpr double one_layer = 1.5;

/// From here on all of them do. On slopes less do, even where they rise by one particle in all.
inline constexpr double two_layers = 2;

/// Particles of a traction that lie behind others, and have no load; and what the load acts on.
struct HiddenLoads {
  std::vector<bool> is_hidden;  ///< of all particles of the traction, in a grid
  Index count = 0, loaded = 0;  ///< hidden ones; those of the set
  Index deepest = 1;            ///< the most particles behind each other
  double area = 0;              ///< [m^2; m per m of depth] on which it acts
  int axis = 0;                 ///< along which they lie behind each other
  bool at_faces = false;        ///< the area is that of faces of cells: ScenarioBuilder::load_faces
  bool inside = false;          ///< there are no such faces
  double factor = 1;            ///< by which the traction is multiplied, so that it has this area
  /// Across which the surface may be, too; -1 = none. And its area [m^2; m per m of depth].
  int other_axis = -1;
  double other_area = 0;
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
