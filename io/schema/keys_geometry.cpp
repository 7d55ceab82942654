// Table of named shapes.
#include "io/schema/keys.h"

namespace lahar {

const Section& geometry_section() {
  static const Section section{
      .name = "a geometry",
      .path = "geometry",
      .help =
          "A shape with a name, by exactly one of `points` and `surface`. Regions name it in "
          "`below`, `above`, `between`, `inside` and `under`. A surface has one height above each "
          "place in plan: y over x in two dimensions, z over x and y in three. Outside of it, and "
          "where its height is not known, nothing is below or above it.",
      .keys = {
          {.key = "points",
           .kinds = places,
           .help = "a surface through points, straight between them. 2D: [[x, y], ...] with "
                   "ascending x. 3D: [[x, y, z], ...], all points of a grid over some x and some "
                   "y, in any order",
           .unit = "m",
           .native = true},
          {.key = "surface",
           .kinds = text,
           .help = "a surface that follows from the surface of this name, by `lower_by` or "
                   "`raise_by`",
           .native = true},
          {.key = "lower_by",
           .kinds = number | text,
           .help = "how far it lies below `surface`: a number, or the name of a surface whose "
                   "heights are the thickness. It is known where both are",
           .unit = "m",
           .min = 0,
           .native = true},
          {.key = "raise_by",
           .kinds = number | text,
           .help = "how far it lies above `surface`, as `lower_by`",
           .unit = "m",
           .min = 0,
           .native = true},
      }};
  return section;
}

}  // namespace lahar
