// Tables of geometric regions.
#include "io/schema/keys.h"

namespace lahar {

namespace {

const Section& box_section() {
  static const Section section{
      .name = "a box",
      .path = "box",
      .help = "Axis-aligned box; either corner may be left out (unbounded on that side).",
      .keys = {
          {.key = "min", .kinds = vector, .help = "lower corner", .unit = "m", .native = true},
          {.key = "max", .kinds = vector, .help = "upper corner", .unit = "m", .native = true},
      }};
  return section;
}

const Section& half_space_section() {
  static const Section section{
      .name = "a half space",
      .path = "half_space",
      .help =
          "Everything on the side of a plane (2D: a line) that the normal points away from: "
          "(x - point) . normal <= 0.",
      .keys = {
          {.key = "point",
           .kinds = vector,
           .help = "a point on the plane",
           .unit = "m",
           .required = true,
           .native = true},
          {.key = "normal",
           .kinds = vector,
           .help = "outward normal, of any length",
           .required = true,
           .native = true},
      }};
  return section;
}

const Section& sphere_section() {
  static const Section section{.name = "a sphere",
                               .path = "sphere",
                               .help = "Ball (2D: disc).",
                               .keys = {
                                   {.key = "centre",
                                    .kinds = vector,
                                    .help = "centre",
                                    .unit = "m",
                                    .required = true,
                                    .native = true},
                                   {.key = "radius",
                                    .kinds = number,
                                    .help = "radius",
                                    .unit = "m",
                                    .required = true,
                                    .min = 0,
                                    .above_min = true,
                                    .native = true},
                               }};
  return section;
}

const Section& cylinder_section() {
  static const Section section{
      .name = "a cylinder",
      .path = "cylinder",
      .help =
          "Points within `radius` of the straight line between two points, with flat ends "
          "(2D: a strip).",
      .keys = {
          {.key = "from",
           .kinds = vector,
           .help = "centre of one end",
           .unit = "m",
           .required = true,
           .native = true},
          {.key = "to",
           .kinds = vector,
           .help = "centre of the other end",
           .unit = "m",
           .required = true,
           .native = true},
          {.key = "radius",
           .kinds = number,
           .help = "radius",
           .unit = "m",
           .required = true,
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "radius_to",
           .kinds = number,
           .help = "radius at `to`, for a cone or a frustum; default `radius`",
           .unit = "m",
           .min = 0,
           .native = true},
      }};
  return section;
}

const Section& polygon_section() {
  static const Section section{
      .name = "a polygon",
      .path = "polygon",
      .help =
          "Simple polygon, in either orientation. In 3D it lies in the plane normal to `axis` "
          "(coordinates in cyclic order: x-y, y-z, z-x) and is extruded along it over `range`.",
      .keys = {
          {.key = "points",
           .kinds = points,
           .help = "corners, at least three: [[x, y], ...]",
           .unit = "m",
           .required = true,
           .native = true},
          {.key = "axis",
           .kinds = direction,
           .help = "3D: direction of extrusion; default z",
           .native = true},
          {.key = "range",
           .kinds = numbers,
           .help = "3D: [from, to] along the axis; default "
                   "unbounded",
           .unit = "m",
           .native = true},
      }};
  return section;
}

}  // namespace

const Section& region_section() {
  static const Section section{
      .name = "a region",
      .path = "region",
      .help =
          "A geometric predicate: exactly one of the keys below. Points on the boundary are "
          "inside, to 1e-9 of the smallest cell size (so that nodes exactly on a plane or on the "
          "side of a box belong to it despite rounding).",
      .keys = {
          {.key = "box",
           .kinds = object,
           .help = "axis-aligned box",
           .section = box_section,
           .native = true},
          {.key = "half_space",
           .kinds = object,
           .help = "one side of a plane",
           .section = half_space_section,
           .native = true},
          {.key = "sphere",
           .kinds = object,
           .help = "ball, in 2D disc",
           .section = sphere_section,
           .native = true},
          {.key = "cylinder",
           .kinds = object,
           .help = "cylinder with flat ends",
           .section = cylinder_section,
           .native = true},
          {.key = "polygon",
           .kinds = object,
           .help = "polygon, in 3D extruded",
           .section = polygon_section,
           .native = true},
          {.key = "below",
           .kinds = text,
           .help = "points below a surface of `geometry`",
           .native = true},
          {.key = "above",
           .kinds = text,
           .help = "points above a surface of `geometry`",
           .native = true},
          {.key = "between",
           .kinds = texts,
           .help = "points between two surfaces of `geometry`: [lower, upper]",
           .native = true},
          {.key = "inside",
           .kinds = text,
           .help = "points inside a solid of `geometry`",
           .native = true},
          {.key = "under",
           .kinds = text,
           .help = "3D: points below and above the polygons of `geometry`: a prism without ends",
           .native = true},
          {.key = "union",
           .kinds = list,
           .help = "points in any of the regions",
           .section = region_section,
           .native = true},
          {.key = "intersection",
           .kinds = list,
           .help = "points in all of the regions",
           .section = region_section,
           .native = true},
          {.key = "difference",
           .kinds = list,
           .help = "[a, b, ...]: points in the first region and "
                   "in none of the others",
           .section = region_section,
           .native = true},
          {.key = "all", .kinds = boolean, .help = "true: everywhere", .native = true},
      }};
  return section;
}

}  // namespace lahar
