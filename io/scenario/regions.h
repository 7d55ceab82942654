/// \file Geometric predicates of the scenario: which points belong to a named set.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "io/json/json_source.h"
#include "io/scenario/geometry.h"
#include "physics/mesh/mesh.h"

namespace lahar {

/// How much of a box lies in a region. `part` is right whatever there is; the others are not said
/// unless they are true.
enum class Coverage { none, part, all };

template <int Dim>
struct RegionShape;

/// A checked region of the scenario (see region_section). Points on its boundary are inside, to an
/// absolute tolerance.
template <int Dim>
class Region {
 public:
  /// Everywhere.
  Region();
  /// From the checked object; problems that the table cannot see (no shape, two shapes, an empty
  /// box, a zero normal, a name that `geometries` has not) are reported, and the region is then
  /// empty. `tolerance` [m].
  Region(const JsonValue& value, double tolerance, const JsonDocument& document,
         ProblemList& problems, const Geometries<Dim>& geometries = {});
  /// A box, without a tolerance.
  Region(const Vec<Dim>& low, const Vec<Dim>& high);
  Region(Region&&) noexcept;
  Region& operator=(Region&&) noexcept;
  ~Region();

  /// Points below a surface.
  Region(std::shared_ptr<const Surface<Dim>> surface, double tolerance);
  /// What is in all of some regions, and in none of others.
  Region(const std::vector<const Region*>& in_all, const std::vector<const Region*>& in_none);

  /// false: it could not be read, which has been reported, here or where its shapes are.
  bool known() const { return known_; }
  bool contains(const Vec<Dim>& x) const;
  /// How much of the box from `low` to `high` lies in the region.
  Coverage coverage(const Vec<Dim>& low, const Vec<Dim>& high) const;
  /// contains() for points of this box, which may be faster.
  std::function<bool(const Vec<Dim>&)> contains_within(const Vec<Dim>& low,
                                                       const Vec<Dim>& high) const;
  /// Whether cells that it cuts are cut exactly by default: it has slopes, as a polygon or a shape
  /// of `geometry`.
  bool cuts_exactly() const;
  /// What fills it, without the tolerance; null where it has no surface: "all", or a box that has
  /// an end on some sides of both of its corners alone.
  const SolidPtr<Dim>& solid() const;
  /// A box that holds the region, but for rounding; infinite where the shape does not say more.
  const std::pair<Vec<Dim>, Vec<Dim>>& bounds() const;

 private:
  std::unique_ptr<RegionShape<Dim>> shape_;
  bool known_ = true;
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

/// The cells that for_cells_near() visits, numbered in its order, for those who share them out.
template <int Dim>
class CellsNear {
 public:
  CellsNear(const Mesh<Dim>& mesh, const Region<Dim>& region);
  Index size() const { return size_; }
  /// Call `visit(cell)` for the cells with these numbers.
  void visit(Index begin, Index end, const std::function<void(Index)>& visit) const;

 private:
  bool grid_;
  std::array<Index, Dim> counts_{}, low_{}, high_{};  ///< of a grid: cells low to high, both in
  Index size_;
};

extern template class CellsNear<2>;
extern template class CellsNear<3>;
extern template class Region<2>;
extern template class Region<3>;

}  // namespace lahar
