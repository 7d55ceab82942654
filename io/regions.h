/// \file Geometric predicates of the scenario: which points belong to a named set.
#pragma once

#include <memory>

#include "io/json_source.h"
#include "physics/types.h"

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

 private:
  struct Shape;
  std::unique_ptr<Shape> shape_;
};

extern template class Region<2>;
extern template class Region<3>;

}  // namespace lahar
