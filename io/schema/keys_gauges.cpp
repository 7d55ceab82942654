// Tables of what a run measures.
#include "io/schema/keys.h"

namespace lahar {

const Section& gauge_section() {
  static const Section section{
      .name = "a gauge",
      .path = "post_processing.gauges[]",
      .help =
          "A quantity that is measured while the run goes on. Each has a table, "
          "gauges/NAME.csv in the run folder. `point` and `line`: fields at places, as means of "
          "the particles around them. A particle counts with its volume, times 1 - d / radius for "
          "the distance d along each axis. `column` and `section`: thickness, height and velocity "
          "of what lies above places in plan; the last axis is upward. The thickness is the volume "
          "around a place over the area of the mesh there. `front`: the largest and the least "
          "position of centres of particles along `direction`. `plane`: mass and volume beyond a "
          "plane, and the mass that passes it; what is injected beyond it has not passed it. "
          "`particles`: mass, volume, centre, velocity, kinetic and potential energy of particles. "
          "In saturated soil both count grains and liquid. `track`: each particle of a set. "
          "`force`: "
          "force and moment of the material on what holds the nodes of a set, or on a rigid body, "
          "as means since the row before. Supports, walls, "
          "springs and absorbing boundaries hold nodes. Two bodies that meet do not count.",
      .discriminator = "type",
      .keys = {
          {.key = "name",
           .kinds = text,
           .help = "name of its table",
           .required = true,
           .native = true},
          {.key = "type",
           .kinds = text,
           .help = "what is measured",
           .required = true,
           .allowed = {"point", "line", "column", "section", "front", "plane", "particles", "track",
                       "force"},
           .native = true},
          {.key = "at",
           .kinds = vector,
           .help = "the place",
           .unit = "m",
           .required = true,
           .only = {"point"},
           .native = true},
          {.key = "at",
           .kinds = vector,
           .help = "a point of the plane",
           .unit = "m",
           .required = true,
           .only = {"plane"},
           .native = true},
          {.key = "at",
           .kinds = numbers,
           .help = "the place in plan: [x], in 3D [x, y]",
           .unit = "m",
           .required = true,
           .only = {"column"},
           .native = true},
          {.key = "at",
           .kinds = vector,
           .help = "positions count from this point; default the origin",
           .unit = "m",
           .only = {"front"},
           .native = true},
          {.key = "at",
           .kinds = vector,
           .help = "moments on nodes are about this point; default the origin. Those on a rigid "
                   "body are about its centre",
           .unit = "m",
           .only = {"force"},
           .native = true},
          {.key = "nset",
           .kinds = id,
           .help = "set of nodes: id or name; this or `rigid_body`",
           .min = -1,
           .only = {"force"},
           .native = true},
          {.key = "rigid_body",
           .kinds = text,
           .help = "name of a rigid body; this or `nset`",
           .only = {"force"},
           .native = true},
          {.key = "from",
           .kinds = vector,
           .help = "one end",
           .unit = "m",
           .required = true,
           .only = {"line"},
           .native = true},
          {.key = "to",
           .kinds = vector,
           .help = "the other end",
           .unit = "m",
           .required = true,
           .only = {"line"},
           .native = true},
          {.key = "from",
           .kinds = numbers,
           .help = "one end in plan: [x], in 3D [x, y]",
           .unit = "m",
           .required = true,
           .only = {"section"},
           .native = true},
          {.key = "to",
           .kinds = numbers,
           .help = "the other end in plan",
           .unit = "m",
           .required = true,
           .only = {"section"},
           .native = true},
          {.key = "places",
           .kinds = integer,
           .help = "places along the line, its ends included",
           .required = true,
           .min = 2,
           .max = 1000,
           .only = {"line", "section"},
           .native = true},
          {.key = "radius",
           .kinds = number,
           .help = "particles count up to this distance; default along each axis the edge of a "
                   "cell. Best is a multiple of the distance of particles: else thickness goes up "
                   "and down as rows of particles pass",
           .unit = "m",
           .min = 0,
           .above_min = true,
           .only = {"point", "line", "column", "section"},
           .native = true},
          {.key = "fields",
           .kinds = texts,
           .help = "columns, state variables or derived fields, as frames name them",
           .required = true,
           .only = {"point", "line"},
           .native = true},
          {.key = "fields",
           .kinds = texts,
           .help = "beside coordinates; columns, state variables or derived fields",
           .fallback = "[\"velocity\"]",
           .only = {"track"},
           .native = true},
          {.key = "direction",
           .kinds = vector,
           .help = "along which positions count, of any length",
           .required = true,
           .only = {"front"},
           .native = true},
          {.key = "normal",
           .kinds = vector,
           .help = "of the plane, of any length: it leads to what is beyond",
           .required = true,
           .only = {"plane"},
           .native = true},
          {.key = "pset",
           .kinds = id,
           .help = "set of particles: id or name",
           .required = true,
           .min = -1,
           .only = {"track"},
           .native = true},
          {.key = "pset",
           .kinds = id,
           .help = "only the particles of this set count: id or name; default all",
           .min = -1,
           .only = {"point", "line", "column", "section", "front", "plane", "particles"},
           .native = true},
          {.key = "material",
           .kinds = id,
           .help = "only particles of this material count: id or name; default all",
           .min = 0,
           .only = {"point", "line", "column", "section", "front", "plane", "particles"},
           .native = true},
      }};
  return section;
}

const Section& maps_section() {
  static const Section section{
      .name = "maps",
      .path = "post_processing.maps",
      .help =
          "Rasters in plan of the whole run, in maps/ of the run folder, as ESRI ASCII grids and, "
          "where GDAL is there, as GeoTIFF with the coordinates of the map. thickness and "
          "max_thickness: volume over area. speed and max_speed: of the mean velocity, by volume, "
          "of what lies over a raster cell. pressure and max_pressure: the largest of its "
          "particles. arrival_time: when the thickness first was above `threshold`. Those without "
          "max_ are at the end. Maxima are those of the rows of gauges.",
      .keys = {
          {.key = "cell_size",
           .kinds = number,
           .help = "edge of a raster cell; default the longest edge of a cell in plan",
           .unit = "m",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "min",
           .kinds = numbers,
           .help = "least corner [x, y] of the raster; default that of the mesh",
           .unit = "m",
           .native = true},
          {.key = "max",
           .kinds = numbers,
           .help = "greatest corner [x, y]; default that of the mesh",
           .unit = "m",
           .native = true},
          {.key = "threshold",
           .kinds = number,
           .help = "thinner layers count as nothing, in all maps; default a tenth of the height of "
                   "a cell",
           .unit = "m",
           .min = 0,
           .native = true},
      }};
  return section;
}

}  // namespace lahar
