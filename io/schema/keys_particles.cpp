// Tables of particles, loads and functions of time.
#include "io/schema/keys.h"

namespace lahar {

const Section& particles_section() {
  static const Section section{
      .name = "an entry of particles",
      .path = "particles[]",
      .help = "One source of particles.",
      .keys = {
          {.key = "generator",
           .kinds = object,
           .help = "source of the particles",
           .required = true,
           .section = generator_section},
          {.key = "group_id",
           .kinds = integer,
           .help = "ignored by CB-Geo MPM",
           .support = Support::ignored},
          {.key = "set_id",
           .kinds = integer,
           .help = "ignored by CB-Geo MPM (pset_id of the generator makes a set)",
           .support = Support::ignored},
      }};
  return section;
}

namespace {

const Section& layer_section() {
  static const Section section{
      .name = "a layer",
      .path = "particles[].generator.layers[]",
      .help =
          "What of the region lies below a surface, below those of the layers before, and not "
          "below "
          "that of the next layer.",
      .keys = {
          {.key = "below",
           .kinds = text,
           .help = "the upper side: a surface of `geometry`",
           .required = true,
           .native = true},
          {.key = "material_id",
           .kinds = id | ids,
           .help = "material, as in the generator",
           .min = 0,
           .native = true},
          {.key = "material",
           .kinds = id | ids,
           .help = "the same as material_id",
           .min = 0,
           .native = true},
          {.key = "pset_id",
           .kinds = id,
           .help = "particle set that these particles form: an id or a new name",
           .min = 0,
           .native = true},
          {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = 0, .native = true},
      }};
  return section;
}

}  // namespace

const Section& generator_section() {
  static const Section section{
      .name = "a generator",
      .path = "particles[].generator",
      .help =
          "`file` reads positions; `gauss` puts particles at the Gauss points of cells; `region` "
          "fills a region with equally spaced particles; `inject` adds particles during the run. "
          "At the beginning of every step in `duration`, each empty cell of the set gets particles "
          "at its Gauss points. They share the volume that flows in with `velocity` until the last "
          "of them has left the cell: the flow is density * area * velocity as long as they keep "
          "this velocity there. Weight makes it more, and what lies before it less: prescribe the "
          "velocity at the nodes of these cells, too. Cells into which other particles come give "
          "less. Of triangles and tetrahedra only those get particles into which something flows "
          "from outside of the set. (CB-Geo MPM: all, and particles share the cell's volume.) "
          "Particle ids continue from one generator to the next. Ids of injected particles "
          "continue from these, step by step.",
      .discriminator = "type",
      .keys = {
          {.key = "type",
           .kinds = text,
           .help = "kind of generator",
           .required = true,
           .allowed = {"file", "gauss", "region", "inject"}},
          {.key = "location",
           .kinds = file,
           .help = "file of positions: the count, then a line of "
                   "coordinates per particle",
           .required = true,
           .only = {"file"}},
          {.key = "io_type",
           .kinds = text,
           .help = "follows from the dimension",
           .fallback = "\"Ascii2D\"",
           .fallback_3d = "\"Ascii3D\"",
           .allowed = {"Ascii2D", "Ascii3D"},
           .only = {"file"}},
          {.key = "cset_id",
           .kinds = id,
           .help = "cells to fill: an id of entity_sets, -1 for "
                   "all, or a name of sets.cells",
           .min = -1,
           .only = {"gauss", "inject"}},
          {.key = "cset",
           .kinds = id,
           .help = "the same as cset_id",
           .min = -1,
           .only = {"gauss", "inject"},
           .native = true},
          {.key = "nparticles_per_dir",
           .kinds = integer,
           .help = "Gauss points per direction: 1 to 4, in triangles and tetrahedra 1 (one point) "
                   "or 2 (a point per corner), in the order of CB-Geo MPM",
           .required = true,
           .min = 1,
           .max = 4,
           .only = {"gauss", "inject"}},
          {.key = "region",
           .kinds = object,
           .help = "what to fill; default: the whole mesh",
           .section = region_section,
           .only = {"region"},
           .native = true},
          {.key = "per_cell",
           .kinds = integer,
           .help = "particles per direction and cell. Each cell is cut into per_cell^dim equal "
                   "parts. Each part that lies in the region gets a particle at its centre, with "
                   "the part's volume; default 2",
           .min = 1,
           .max = 64,
           .only = {"region"},
           .native = true},
          {.key = "spacing",
           .kinds = number,
           .help = "instead of per_cell: the largest distance of particles. A cell has the fewest "
                   "equal parts that are not larger",
           .unit = "m",
           .min = 0,
           .above_min = true,
           .only = {"region"},
           .native = true},
          {.key = "cut_cells",
           .kinds = text,
           .help = "parts of cells that the boundary of the region cuts. `centres`: a part counts "
                   "as a whole if its centre is inside. `exact`: the particle has the volume that "
                   "lies inside, and is in its centroid; a part with less than a tenth of its "
                   "volume inside gives it to a neighbour in the cell. Default: `exact` if the "
                   "region has a polygon or names a shape of `geometry`, else `centres`",
           .allowed = {"exact", "centres"},
           .only = {"region"},
           .native = true},
          {.key = "layers",
           .kinds = list,
           .help = "layers of the region with materials of their own, the uppermost first",
           .section = layer_section,
           .only = {"region"},
           .native = true},
          {.key = "velocity",
           .kinds = vector,
           .help = "initial velocity; default 0 (CB-Geo MPM: only for `inject`)",
           .unit = "m/s"},
          {.key = "stress",
           .kinds = number | numbers,
           .help = "initial stress xx yy zz xy yz xz, or one number for xx, yy and zz; default: "
                   "that of mesh.particles_stresses, or none",
           .unit = "Pa",
           .only = {"file", "gauss", "region"},
           .native = true},
          {.key = "duration",
           .kinds = numbers,
           .help = "[start, end) of the injection; default: the whole run",
           .unit = "s",
           .only = {"inject"}},
          {.key = "material_id",
           .kinds = id | ids,
           .help = "material: an id or a name, or [skeleton, liquid in its pores]",
           .min = 0},
          {.key = "material",
           .kinds = id | ids,
           .help = "the same as material_id",
           .min = 0,
           .native = true},
          {.key = "pset_id",
           .kinds = id,
           .help = "particle set that these particles form: an id or a new name",
           .min = 0},
          {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = 0, .native = true},
          {.key = "particle_type",
           .kinds = text,
           .help =
               "follows from the dimension. P2DBBAR and P3DBBAR: `b_bar` of analysis. P2DFS and "
               "P3DFS: finite strains, which implicit steps always have, but for --as-cbgeo; "
               "explicit steps add up small increments, as for P2D and P3D",
           .fallback = "\"P2D\"",
           .fallback_3d = "\"P3D\"",
           .allowed = {"P2D", "P3D", "P2D2PHASE", "P3D2PHASE", "P2DBBAR", "P3DBBAR", "P2DFS",
                       "P3DFS", "P2DFLUID", "P3DFLUID"}},
          {.key = "check_duplicates",
           .kinds = boolean,
           .help = "warn about particles at the same "
                   "place",
           .fallback = "true"},
      }};
  return section;
}

const Section& material_set_section() {
  static const Section section{
      .name = "an entry of material_sets",
      .path = "material_sets[]",
      .help = "Another material for a set of particles; later entries win.",
      .keys = {
          {.key = "material_id",
           .kinds = id | ids,
           .help = "material: an id or a name; with a liquid in its pores, two: [skeleton, liquid]",
           .min = 0},
          {.key = "material",
           .kinds = id | ids,
           .help = "the same as material_id",
           .min = 0,
           .native = true},
          {.key = "pset_id", .kinds = id, .help = "particle set", .min = -1},
          {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = -1, .native = true},
          {.key = "phase_id",
           .kinds = integer,
           .help = "phase",
           .fallback = "0",
           .min = 0,
           .max = 1},
      }};
  return section;
}

namespace {

const Section& gravity_section() {
  static const Section section{.name = "gravity",
                               .path = "external_loading_conditions.gravity",
                               .help =
                                   "Gravity that grows linearly from zero until `ramping_time` "
                                   "(dialect of the fork).",
                               .keys = {
                                   {.key = "gravity",
                                    .kinds = vector,
                                    .help = "acceleration",
                                    .unit = "m/s^2",
                                    .required = true},
                                   {.key = "ramping_time",
                                    .kinds = number,
                                    .help = "time at which gravity reaches its full value",
                                    .unit = "s",
                                    .min = 0},
                               }};
  return section;
}

const Section& traction_section() {
  static const Section section{
      .name = "a surface traction",
      .path = "external_loading_conditions.particle_surface_traction[]",
      .help =
          "Force on each particle of a set: traction * function(t) * area. The area is that of the "
          "particle's face at the beginning, and stays; rings grow with their radius. The face is "
          "across the axis along which the particles of the set are one layer, or nearly. If there "
          "are several such axes, it is the one along which the body ends at the particles. If "
          "particles lie behind each other, as in slopes, the one at the surface has the load, on "
          "its area in plan: divide a stress per area of the slope by the cosine of the slope. "
          "Where whole rows lie behind each other, each row has it, and a warning says so. It "
          "acts on "
          "the side where a particle has no neighbour, if it has one on the other side. In meshes "
          "whose cells are no boxes it is the area of the faces at which material ends, as seen "
          "along that axis, and the particles nearest to them have it. With "
          "analysis.preset \"cbgeo\" it acts at the "
          "centre, and the area is volume / size, where size is the initial volume to the power "
          "1/dim. The last traction for a particle and direction wins.",
      .keys = {
          {.key = "pset_id",
           .kinds = id,
           .help = "particle set: an id, -1 for all, or a name",
           .min = -1},
          {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = -1, .native = true},
          {.key = "dir",
           .kinds = phase_direction,
           .help = "direction; from the dimension on, that of the liquid in pores",
           .required = true},
          {.key = "phase",
           .kinds = text,
           .help = "what the traction acts on: both phases together (default), or the liquid in "
                   "pores alone",
           .allowed = {"mixture", "liquid"},
           .native = true},
          {.key = "traction", .kinds = number, .help = "traction", .unit = "Pa", .required = true},
          {.key = "math_function_id",
           .kinds = id,
           .help = "factor over time: an id of "
                   "math_functions or a name; default constant",
           .min = 0},
      }};
  return section;
}

std::vector<KeySpec> loading_keys() {
  std::vector<KeySpec> keys = {
      {.key = "gravity",
       .kinds = vector | object,
       .help = "acceleration of gravity",
       .unit = "m/s^2",
       .fallback = "[0, 0]",
       .fallback_3d = "[0, 0, 0]",
       .section = gravity_section},
      {.key = "particle_surface_traction",
       .kinds = list,
       .help = "tractions on particles",
       .section = traction_section},
      {.key = "rotation_forces",
       .kinds = any,
       .help = "forces in a frame that turns, as in a centrifuge (dialect of the fork)",
       .support = Support::planned},
  };
  const std::vector<KeySpec> conditions = condition_keys(true);
  keys.insert(keys.end(), conditions.begin(), conditions.end());
  return keys;
}

}  // namespace

const Section& loading_section() {
  static const Section section{.name = "external_loading_conditions",
                               .path = "external_loading_conditions",
                               .help = "External loads on the material.",
                               .keys = loading_keys()};
  return section;
}

const Section& function_section() {
  static const Section section{
      .name = "a math function",
      .path = "math_functions[]",
      .help =
          "`Linear`: straight lines between the points (xvalues, fxvalues), constant outside. "
          "`Sin`: sin(a (t - x0)) inside `xrange`, 0 outside.",
      .discriminator = "type",
      .keys = {
          {.key = "id",
           .kinds = integer,
           .help = "id; default: the position in the list",
           .min = 0},
          {.key = "name", .kinds = text, .help = "name, usable in place of the id", .native = true},
          {.key = "type",
           .kinds = text,
           .help = "kind of function",
           .required = true,
           .allowed = {"Linear", "Sin"}},
          {.key = "xvalues",
           .kinds = numbers,
           .help = "times, ascending",
           .unit = "s",
           .only = {"Linear"}},
          {.key = "fxvalues",
           .kinds = numbers,
           .help = "values at these times",
           .only = {"Linear"}},
          {.key = "file",
           .kinds = file,
           .help = "file of lines `x fx` or `x, fx` in place of both (dialect of the fork)",
           .only = {"Linear"}},
          {.key = "derivative",
           .kinds = boolean,
           .help = "the factor is the slope of the function. With displacements as values, what "
                   "has a velocity of 1 along an axis follows them, from where it begins",
           .fallback = "false",
           .native = true},
          {.key = "x0",
           .kinds = number,
           .help = "time shift",
           .unit = "s",
           .required = true,
           .only = {"Sin"}},
          {.key = "a",
           .kinds = number,
           .help = "angular frequency",
           .unit = "rad/s",
           .required = true,
           .only = {"Sin"}},
          {.key = "xrange",
           .kinds = numbers,
           .help = "[from, to]; default: all times after 0, "
                   "so that f(0) = 0",
           .unit = "s",
           .only = {"Sin"}},
      }};
  return section;
}

}  // namespace lahar
