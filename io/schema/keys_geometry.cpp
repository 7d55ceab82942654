// Table of named shapes.
#include "io/schema/keys.h"

namespace lahar {

const Section& geometry_section() {
  static const Section section{
      .name = "a geometry",
      .path = "geometry",
      .help =
          "A shape with a name, by exactly one of `points`, `raster`, `triangles`, "
          "`surface`, `solid` and `polygons`. "
          "Regions name it in "
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
          {.key = "raster",
           .kinds = file | texts,
           .help = "3D: a surface from an elevation raster, an ESRI ASCII grid or a GeoTIFF; of "
                   "several that lie beside each other a list. Of a raster that is finer than half "
                   "of the smallest cell of the mesh, means over this distance are taken",
           .native = true},
          {.key = "triangles",
           .kinds = file,
           .help = "3D: a surface from triangles, of an STL, OBJ or PLY file (text, or binary in "
                   "little endian). It must have one height above each place; heights between are "
                   "bilinear over a grid",
           .native = true},
          {.key = "spacing",
           .kinds = number,
           .help = "of `triangles`: the grid has at most this spacing; by default the mean edge of "
                   "triangles as squares, and at most 1/500 of the surface",
           .unit = "m",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "solid",
           .kinds = file,
           .help = "3D: what a closed surface of triangles encloses, of an STL, OBJ or PLY file. "
                   "Corners are counter-clockwise seen from outside",
           .native = true},
          {.key = "scale",
           .kinds = number,
           .help = "of `triangles` and `solid`: metres per unit of the file; default 1",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "offset",
           .kinds = vector,
           .help = "of `triangles` and `solid`: where the origin of the file lies; default the "
                   "model's",
           .unit = "m",
           .native = true},
          {.key = "polygons",
           .kinds = file,
           .help = "3D: polygons in plan, from GeoJSON or a shapefile, with holes",
           .native = true},
          {.key = "where",
           .kinds = text,
           .help =
               "of `polygons`: features that count, as in SQL: \"zone = 'upper' AND depth > 2\"; "
               "default all",
           .native = true},
          {.key = "surface",
           .kinds = text,
           .help = "a surface that follows from the surface of this name, by `lower_by` or "
                   "`raise_by`",
           .native = true},
          {.key = "lower_by",
           .kinds = number | text,
           .help = "how far it lies below `surface`: a number, or the name of a surface whose "
                   "heights are the thickness: 0 where that has no data. It is known where both "
                   "reach",
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
