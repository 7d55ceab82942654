/// \file The named shapes of a scenario: surfaces, solids and outlines, from points and files.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "physics/geometry/outlines.h"
#include "physics/geometry/solid.h"
#include "physics/geometry/surface.h"

namespace lahar {

/// One entry of `geometry`. It is one of the three; none if it could not be read, which has been
/// reported.
template <int Dim>
struct Geometry {
  std::shared_ptr<const Surface<Dim>> surface;
  SolidPtr<Dim> solid;
  std::shared_ptr<const Outlines> outlines;

  bool known() const { return surface || solid || outlines; }
  const char* kind() const {
    return surface ? "a surface" : solid ? "a solid" : outlines ? "polygons" : "nothing";
  }
};

/// By name. Every member of a team has all of them.
template <int Dim>
using Geometries = std::map<std::string, Geometry<Dim>, std::less<>>;

}  // namespace lahar
