/// \file Geometric predicates of the scenario: which points belong to a named set.
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "io/json_source.h"
#include "physics/mesh.h"

namespace lahar {

/// A checked region of the scenario (see region_section). Points on its boundary are inside, to an
/// absolute tolerance.
template <int Dim>
class Region {
 public:
  /// Everywhere.
  Region();
  /// From the checked object; problems that the table cannot see (no shape, two shapes, an empty
  /// box, a zero normal) are reported. `tolerance` [m].
  Region(const JsonValue& value, double tolerance, const JsonDocument& document,
         ProblemList& problems);
  Region(Region&&) noexcept;
  Region& operator=(Region&&) noexcept;
  ~Region();

  bool contains(const Vec<Dim>& x) const;
  /// A box that holds the region, but for rounding; infinite where the shape does not say more.
  const std::pair<Vec<Dim>, Vec<Dim>>& bounds() const;

 private:
  struct Shape;
  std::unique_ptr<Shape> shape_;
};

/// Call `visit(id)` for the cells (nodes) of a mesh that may have points in (be in) a region,
/// ascending: all of them, or of a structured mesh those near the region's bounding box, so that a
/// small region costs little in a huge mesh.
template <int Dim>
void for_cells_near(const Mesh<Dim>& mesh, const Region<Dim>& region,
                    const std::function<void(Index)>& visit);
template <int Dim>
void for_nodes_near(const Mesh<Dim>& mesh, const Region<Dim>& region,
                    const std::function<void(Index)>& visit);

extern template class Region<2>;
extern template class Region<3>;

}  // namespace lahar
