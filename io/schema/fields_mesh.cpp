// Tables of the mesh, its boundary conditions, sets and regions.
#include "io/schema/fields.h"

namespace lahar {

namespace {

const Section& structured_section() {
  static const Section section{
      .name = "mesh.structured",
      .path = "mesh.structured",
      .help =
          "A grid of equal boxes, in place of a mesh file. Two of `cell_size`, `extent` and "
          "`counts` define its size. Cell (i, j, k) has the id i + nx (j + ny k).",
      .fields = {
          {.key = "origin",
           .kinds = vector,
           .help = "lowest corner",
           .unit = "m",
           .fallback = "[0, 0]",
           .fallback_3d = "[0, 0, 0]",
           .native = true},
          {.key = "cell_size",
           .kinds = vector | number,
           .help = "edge lengths of a cell; one "
                   "number for squares or cubes",
           .unit = "m",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "extent",
           .kinds = vector,
           .help = "edge lengths of the whole mesh",
           .unit = "m",
           .min = 0,
           .above_min = true,
           .native = true},
          {.key = "counts",
           .kinds = counts,
           .help = "number of cells along each axis",
           .min = 1,
           .max = 2e9,
           .native = true},
      }};
  return section;
}

const Section& water_table_section() {
  static const Section section{
      .name = "an entry of water_tables",
      .path = "mesh.particles_pore_pressures.water_tables[]",
      .help = "Level of the water at a position. Between positions it is linear.",
      .fields = {
          {.key = "position",
           .kinds = number,
           .help = "coordinate along dir_h",
           .unit = "m",
           .required = true},
          {.key = "h0",
           .kinds = number,
           .help = "coordinate of the level along dir_v",
           .unit = "m",
           .required = true},
      }};
  return section;
}

const Section& pore_pressures_section() {
  static const Section section{
      .name = "mesh.particles_pore_pressures",
      .path = "mesh.particles_pore_pressures",
      .help = "Pressure of the liquid in pores at the beginning.",
      .discriminator = "type",
      .fields = {
          {.key = "type",
           .kinds = text,
           .help = "how they are given",
           .required = true,
           .allowed = {"file", "isotropic", "water_table"}},
          {.key = "location",
           .kinds = file,
           .help = "file of lines `particle pressure`",
           .only = {"file"}},
          {.key = "values",
           .kinds = number,
           .help = "pressure of all particles",
           .unit = "Pa",
           .only = {"isotropic"}},
          {.key = "dir_v",
           .kinds = direction,
           .help = "direction upwards; default the last",
           .only = {"water_table"}},
          {.key = "dir_h",
           .kinds = direction,
           .help = "direction of the positions",
           .fallback = "0",
           .only = {"water_table"}},
          {.key = "water_tables",
           .kinds = list,
           .help =
               "levels of the water: the pressure is that of water at rest below them, and zero "
               "above",
           .section = water_table_section,
           .only = {"water_table"}},
      }};
  return section;
}

const Section& node_type_section() {
  static const Section section{.name = "an entry of node_types",
                               .path = "mesh.nonlocal_mesh_properties.node_types[]",
                               .help = "Position of nodes in the mesh along an axis.",
                               .fields = {
                                   {.key = "nset_id", .kinds = id, .help = "node set", .min = -1},
                                   {.key = "dir", .kinds = direction, .help = "direction"},
                                   {.key = "type",
                                    .kinds = integer,
                                    .help = "0 inside, 1 to 4 at or near a border",
                                    .min = 0},
                               }};
  return section;
}

const Section& nonlocal_section() {
  static const Section section{
      .name = "mesh.nonlocal_mesh_properties",
      .path = "mesh.nonlocal_mesh_properties",
      .help =
          "Settings of splines (ED2Q4P2B, ED3H8P2B) in the dialect of the fork. They have no "
          "effect here, because the mesh determines all of them. Splines end at the border of the "
          "mesh. They sum to one and reproduce linear fields there.",
      .fields = {
          {.key = "type",
           .kinds = text,
           .help = "kind of functions",
           .required = true,
           .allowed = {"BSPLINE"},
           .planned = {"LME"}},
          {.key = "kernel_correction", .kinds = boolean, .help = "without effect"},
          {.key = "node_types",
           .kinds = list,
           .help = "without effect",
           .section = node_type_section},
      }};
  return section;
}

const Section& stresses_section() {
  static const Section section{
      .name = "mesh.particles_stresses",
      .path = "mesh.particles_stresses",
      .help = "Initial stresses as an object (dialect of the fork).",
      .discriminator = "type",
      .fields = {
          {.key = "type",
           .kinds = text,
           .help = "source of the stresses",
           .required = true,
           .allowed = {"file", "isotropic"}},
          {.key = "location", .kinds = file, .help = "file of stresses", .only = {"file"}},
          {.key = "values",
           .kinds = numbers,
           .help =
               "the stress of all particles: xx yy zz xy yz xz, or one number for xx, yy and zz",
           .unit = "Pa",
           .only = {"isotropic"}},
      }};
  return section;
}

}  // namespace

const Section& mesh_section() {
  static const Section section{
      .name = "mesh",
      .path = "mesh",
      .help = "The background mesh: `mesh` (a file) or `structured`.",
      .fields = {
          {.key = "mesh",
           .kinds = file,
           .help = "mesh file: `nnodes ncells`, a line of coordinates "
                   "per node, a line of node ids per cell (counter-clockwise; hexahedra bottom "
                   "face, then top; then the middles of sides, edges and faces in Gmsh's order)"},
          {.key = "structured",
           .kinds = object,
           .help = "a grid of equal boxes; each is a cell, or cut into 2 triangles or 6 tetrahedra",
           .section = structured_section,
           .native = true},
          {.key = "entity_sets",
           .kinds = file,
           .help = "JSON file of numbered sets: "
                   "{\"node_sets\": [{\"id\": 0, \"set\": [0, 1]}], \"cell_sets\": [], "
                   "\"particle_sets\": []}"},
          {.key = "cell_type",
           .kinds = text,
           .help = "element of all cells; the default follows from the dimension. ED2Q16G and "
                   "ED3H64G: GIMP; the file also lists the nodes around each cell. ED2Q4P2B and "
                   "ED3H8P2B: quadratic B-splines. ED2T6, ED2Q9 and ED3H27: quadratic Bernstein "
                   "polynomials; with analysis.preset \"cbgeo\" Lagrange functions. ED2Q8 and "
                   "ED3H20: only with that preset",
           .fallback = "\"ED2Q4\"",
           .fallback_3d = "\"ED3H8\"",
           .allowed = {"ED2T3", "ED2T6", "ED2Q4", "ED2Q8", "ED2Q9", "ED3T4", "ED3H8", "ED3H20",
                       "ED3H27", "ED2Q16G", "ED3H64G", "ED2Q4P2B", "ED3H8P2B"},
           .planned = {"ED2Q4L", "ED2T3L", "ED3H8L"}},
          {.key = "isoparametric",
           .kinds = boolean,
           .help = "false: every cell is a box along the axes; triangles and tetrahedra may have "
                   "any shape",
           .fallback = "true"},
          {.key = "check_duplicates",
           .kinds = boolean,
           .help = "warn about nodes at the same place",
           .fallback = "true"},
          {.key = "io_type",
           .kinds = text,
           .help = "format of the mesh file, follows from the "
                   "dimension",
           .fallback = "\"Ascii2D\"",
           .fallback_3d = "\"Ascii3D\"",
           .allowed = {"Ascii2D", "Ascii3D"}},
          {.key = "node_type",
           .kinds = text,
           .help = "follows from the dimension",
           .fallback = "\"N2D\"",
           .fallback_3d = "\"N3D\"",
           .allowed = {"N2D", "N3D", "N2D2P", "N3D2P"}},
          {.key = "particle_cells",
           .kinds = file,
           .help = "lines `particle cell`: where to look "
                   "for a particle first"},
          {.key = "particles_cells",
           .kinds = file,
           .help = "the same as particle_cells. CB-Geo MPM documents this key but ignores it"},
          {.key = "particles_volumes",
           .kinds = file,
           .help = "lines `particle volume`. Default: the volume of the cell divided by the number "
                   "of particles in it"},
          {.key = "particles_stresses",
           .kinds = file | object,
           .help = "initial stresses: the "
                   "count, then a line xx yy zz xy yz xz per particle [Pa]",
           .section = stresses_section},
          {.key = "particles_tractions",
           .kinds = file,
           .help = "ignored by CB-Geo MPM",
           .support = Support::ignored},
          {.key = "boundary_conditions",
           .kinds = object,
           .help = "constraints on nodes and "
                   "particles",
           .fallback = "{}",
           .section = boundary_section},
          {.key = "nonlocal_mesh_properties",
           .kinds = object,
           .help = "borders of the mesh for splines (dialect of the fork), without effect",
           .section = nonlocal_section},
          {.key = "particles_pore_pressures",
           .kinds = object,
           .help = "initial pressures of the liquid in pores, positive in compression",
           .section = pore_pressures_section},
          {.key = "mesh_reader", .kinds = any, .help = "write io_type", .support = Support::older},
          {.key = "material_id",
           .kinds = any,
           .help = "write it in particles[].generator",
           .support = Support::older},
          {.key = "particle_type",
           .kinds = any,
           .help = "write it in particles[].generator",
           .support = Support::older},
          {.key = "generate_particles_cells",
           .kinds = any,
           .help = "write a particles[].generator of type \"gauss\" with \"cset_id\": -1 and this "
                   "number as nparticles_per_dir",
           .support = Support::older},
      }};
  return section;
}

namespace {

const Section& velocity_constraint_section() {
  static const Section section{
      .name = "a velocity constraint",
      .path = "mesh.boundary_conditions.velocity_constraints[]",
      .help =
          "A prescribed velocity component of a set of nodes, or a `file` of lines `node dir "
          "velocity`. Entries on the same node combine. The first entry for a node and direction "
          "wins.",
      .fields = {
          {.key = "nset_id",
           .kinds = id,
           .help = "node set: an id of entity_sets, -1 for all "
                   "nodes, or a name of sets.nodes",
           .min = -1},
          {.key = "nset", .kinds = id, .help = "the same as nset_id", .min = -1, .native = true},
          {.key = "dir",
           .kinds = phase_direction,
           .help = "direction; from the dimension on, that of the liquid in pores"},
          {.key = "phase",
           .kinds = text,
           .help = "which phase is held; default the skeleton",
           .allowed = {"skeleton", "liquid"},
           .native = true},
          {.key = "velocity", .kinds = number, .help = "velocity", .unit = "m/s"},
          {.key = "file", .kinds = file, .help = "file of lines `node dir velocity`"},
      }};
  return section;
}

const Section& friction_section() {
  static const Section section{
      .name = "a friction constraint",
      .path = "mesh.boundary_conditions.friction_constraints[]",
      .help =
          "Coulomb friction of a set of nodes on a rigid wall, or a `file` of lines `node dir "
          "sign_n friction`. The wall pushes and does not pull. It stops material that moves into "
          "it, at the velocity that is prescribed along its normal (default 0). Friction is at "
          "most `friction` times that impulse. With `two_sided` the wall is as in CB-Geo MPM: a "
          "velocity constraint along the normal holds the node in both directions, and friction "
          "acts where the acceleration presses the node against the wall. The last entry for a "
          "node and direction wins.",
      .fields = {
          {.key = "nset_id", .kinds = id, .help = "node set", .min = -1},
          {.key = "nset", .kinds = id, .help = "the same as nset_id", .min = -1, .native = true},
          {.key = "dir", .kinds = direction, .help = "normal direction in the node's frame"},
          {.key = "sign_n",
           .kinds = integer,
           .help = "sign of the direction that points out of the body: -1 for a floor below it",
           .min = -1,
           .max = 1},
          {.key = "friction",
           .kinds = number,
           .help = "friction coefficient",
           .unit = "-",
           .min = 0},
          {.key = "two_sided",
           .kinds = boolean,
           .help =
               "the wall also pulls, as in CB-Geo MPM; default false, with the preset cbgeo true",
           .native = true},
          {.key = "file", .kinds = file, .help = "file of lines `node dir sign_n friction`"},
      }};
  return section;
}

const Section& wall_section() {
  static const Section section{
      .name = "a wall",
      .path = "mesh.boundary_conditions.walls[]",
      .help =
          "A rigid wall at rest through a set of nodes. It pushes and does not pull: material may "
          "leave it, and slides on it with Coulomb friction. A node may lie on several walls along "
          "different axes. Use velocity constraints for symmetry planes and fixed ends.",
      .fields = {
          {.key = "nset_id", .kinds = id, .help = "node set", .min = -1},
          {.key = "nset", .kinds = id, .help = "the same as nset_id", .min = -1, .native = true},
          {.key = "normal",
           .kinds = vector,
           .help = "direction from the wall into the material, along an axis: [0, 1] for a floor",
           .required = true,
           .native = true},
          {.key = "friction",
           .kinds = number | text,
           .help =
               "friction coefficient, or \"rough\": material does not slide while it is pressed "
               "against the wall",
           .unit = "-",
           .fallback = "0",
           .native = true},
      }};
  return section;
}

const Section& acceleration_section() {
  static const Section section{
      .name = "an acceleration constraint",
      .path = "mesh.boundary_conditions.acceleration_constraints[]",
      .help =
          "A prescribed acceleration component of a set of nodes, in their frame, for example at "
          "the base in an earthquake; or a `file` of lines `node dir acceleration` (dialect of the "
          "fork). The last entry for a node and direction wins. A prescribed velocity in the same "
          "direction is an error.",
      .fields = {
          {.key = "nset_id", .kinds = id, .help = "node set", .min = -1},
          {.key = "nset", .kinds = id, .help = "the same as nset_id", .min = -1, .native = true},
          {.key = "dir", .kinds = direction, .help = "direction"},
          {.key = "acceleration", .kinds = number, .help = "acceleration", .unit = "m/s^2"},
          {.key = "math_function_id",
           .kinds = id,
           .help = "factor over time: an id of math_functions or a name; default constant"},
          {.key = "file", .kinds = file, .help = "file of lines `node dir acceleration`"},
      }};
  return section;
}

const Section& absorbing_section() {
  static const Section section{
      .name = "an absorbing constraint",
      .path = "mesh.boundary_conditions.absorbing_constraints[]",
      .help =
          "Dashpots and springs at a set of nodes: a boundary that waves leave through. The "
          "traction is -rho c v - rho c^2 u / delta. Along `dir` c is c_p, times `a` in the first "
          "term. In the other directions c is c_s, times `b` in the first term. v is the node's "
          "velocity. rho, c_p, c_s and the displacement u are means over the particles around the "
          "node. Densities and wave speeds are those of the materials at the beginning; fluids "
          "have no c_s. The area of a node follows from `h_min` and `position`. Several entries on "
          "a node add up. Within a step dashpots at most stop a node. They are weaker if its mass "
          "is too small for them.",
      .fields = {
          {.key = "nset_id", .kinds = id, .help = "node set", .min = -1},
          {.key = "nset", .kinds = id, .help = "the same as nset_id", .min = -1, .native = true},
          {.key = "dir",
           .kinds = direction,
           .help = "normal of the boundary, along which compression waves leave",
           .required = true},
          {.key = "delta",
           .kinds = number,
           .help =
               "the springs have the stiffness of a layer of this thickness; at least h_min / (2 "
               "a) and h_min / (2 b). A static stress s moves the boundary by s delta / (rho c^2)",
           .unit = "m",
           .required = true,
           .min = 0,
           .above_min = true},
          {.key = "h_min",
           .kinds = number,
           .help = "edge length of the cells at the boundary",
           .unit = "m",
           .required = true,
           .min = 0,
           .above_min = true},
          {.key = "a",
           .kinds = number,
           .help = "factor of the dashpots along dir",
           .unit = "-",
           .fallback = "1",
           .min = 0,
           .above_min = true},
          {.key = "b",
           .kinds = number,
           .help = "factor of the dashpots in the other directions",
           .unit = "-",
           .fallback = "1",
           .min = 0,
           .above_min = true},
          {.key = "position",
           .kinds = text,
           .help = "position of the nodes on the boundary, which gives their area. 2D: h_min on an "
                   "edge, half of it at the ends of an edge (corner). 3D: h_min^2 inside a face, "
                   "half of it at the edges of a face, a quarter at its corners",
           .required = true,
           .allowed = {"corner", "edge", "face"}},
      }};
  return section;
}

const Section& particle_velocity_section() {
  static const Section section{
      .name = "a particle velocity constraint",
      .path = "mesh.boundary_conditions.particles_velocity_constraints[]",
      .help =
          "A prescribed velocity component of a set of particles. The particles move exactly with "
          "it, as a rigid body, and drive the nodes around them. Other material there sticks to "
          "them. With analysis.preset \"cbgeo\" the velocity is set at the end of every step, and "
          "particles move with nodes on which the constraint does not act.",
      .fields = {
          {.key = "pset_id",
           .kinds = id,
           .help = "particle set: an id, -1 for all, or a name of "
                   "sets.particles",
           .min = -1},
          {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = -1, .native = true},
          {.key = "dir",
           .kinds = phase_direction,
           .help = "direction; from the dimension on, that of the liquid in pores",
           .required = true},
          {.key = "phase",
           .kinds = text,
           .help = "which phase is held; default the skeleton",
           .allowed = {"skeleton", "liquid"},
           .native = true},
          {.key = "velocity", .kinds = number, .help = "velocity", .unit = "m/s", .required = true},
      }};
  return section;
}

const Section& pressure_section() {
  static const Section section{
      .name = "a pressure constraint",
      .path = "mesh.boundary_conditions.pressure_constraints[]",
      .help =
          "Prescribed pressure of the liquid in the pores at a set of nodes, or a `file` of lines "
          "`node pressure`. Free surfaces have none without it. The first entry for a node wins.",
      .fields = {
          {.key = "phase_id",
           .kinds = integer,
           .help = "phase: 1 is the liquid",
           .fallback = "1",
           .min = 1,
           .max = 1},
          {.key = "nset_id",
           .kinds = id,
           .help = "node set: an id of entity_sets, -1 for all nodes, or a name of sets.nodes",
           .min = -1},
          {.key = "nset", .kinds = id, .help = "the same as nset_id", .min = -1, .native = true},
          {.key = "pressure",
           .kinds = number,
           .help = "pressure, positive in compression",
           .unit = "Pa"},
          {.key = "file", .kinds = file, .help = "file of lines `node pressure`"},
          {.key = "math_function_id",
           .kinds = id,
           .help = "factor over time: an id of math_functions or a name; default constant",
           .min = 0},
      }};
  return section;
}

}  // namespace

const Section& boundary_section() {
  static const Section section{
      .name = "mesh.boundary_conditions",
      .path = "mesh.boundary_conditions",
      .help = "Constraints on nodes and particles.",
      .fields = {
          {.key = "velocity_constraints",
           .kinds = list | file,
           .help = "prescribed nodal velocities; a file name in older cases",
           .section = velocity_constraint_section},
          {.key = "friction_constraints",
           .kinds = list | file,
           .help = "friction at nodes; a file name in older cases",
           .section = friction_section},
          {.key = "walls",
           .kinds = list,
           .help = "rigid walls that push and do not pull",
           .section = wall_section,
           .native = true},
          {.key = "nodal_euler_angles",
           .kinds = file,
           .help = "rotated frames of nodes, in which their velocity and "
                   "friction constraints act: lines `node alpha beta "
                   "[gamma]` in radians"},
          {.key = "particles_velocity_constraints",
           .kinds = list,
           .help = "prescribed particle velocities",
           .section = particle_velocity_section},
          {.key = "absorbing_constraints",
           .kinds = list,
           .help = "boundaries that waves leave through",
           .section = absorbing_section},
          {.key = "acceleration_constraints",
           .kinds = list,
           .help = "prescribed nodal accelerations",
           .section = acceleration_section},
          {.key = "displacement_constraints",
           .kinds = any,
           .help = "for implicit analyses (dialect of the fork)",
           .support = Support::planned},
          {.key = "cohesion_constraints",
           .kinds = any,
           .help = "adhesion of nodes to a wall (dialect of the fork)",
           .support = Support::planned},
          {.key = "adhesion_constraints",
           .kinds = any,
           .help = "adhesion of nodes to a wall (dialect of the fork)",
           .support = Support::planned},
          {.key = "pressure_constraints",
           .kinds = list,
           .help = "prescribed pressures of the liquid in pores",
           .section = pressure_section},
          {.key = "pore_pressure_constraints",
           .kinds = any,
           .help = "write pressure_constraints, where free surfaces do not drain the pores anyway",
           .support = Support::ignored},
      }};
  return section;
}

const Section& sets_section() {
  static const Section section{
      .name = "sets",
      .path = "sets",
      .help =
          "Named sets from geometry: nodes in a region, cells with their centre in it, particles "
          "that start in it. A name can replace any numeric id of the CB-Geo format.",
      .fields = {
          {.key = "nodes",
           .kinds = map,
           .help = "name: region",
           .section = region_section,
           .native = true},
          {.key = "cells",
           .kinds = map,
           .help = "name: region",
           .section = region_section,
           .native = true},
          {.key = "particles",
           .kinds = map,
           .help = "name: region",
           .section = region_section,
           .native = true},
      }};
  return section;
}

}  // namespace lahar
