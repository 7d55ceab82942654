// Tables of the mesh, its boundary conditions, sets and regions.
#include "io/fields.h"

namespace lahar {

namespace {

const Section& structured_section() {
  static const Section section{
      .name = "mesh.structured",
      .path = "mesh.structured",
      .help =
          "A grid of equal boxes, in place of a mesh file. Two of `cell_size`, `extent` and "
          "`counts` say how large it is. Cell (i, j, k) has the id i + nx (j + ny k).",
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

const Section& stresses_section() {
  static const Section section{
      .name = "mesh.particles_stresses",
      .path = "mesh.particles_stresses",
      .help = "Initial stresses as an object (dialect of the fork).",
      .discriminator = "type",
      .fields = {
          {.key = "type",
           .kinds = text,
           .help = "where they come from",
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
           .help = "element; the default follows from the "
                   "dimension. ED2Q16G and ED3H64G: GIMP, the file lists the nodes around each cell "
                   "as well; ED2Q4P2B and ED3H8P2B: quadratic B-splines",
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
           .allowed = {"N2D", "N3D"},
           .planned = {"N2D2P", "N3D2P"}},
          {.key = "particle_cells",
           .kinds = file,
           .help = "lines `particle cell`: where to look "
                   "for a particle first"},
          {.key = "particles_volumes",
           .kinds = file,
           .help = "lines `particle volume`; without it "
                   "the volume is that of the cell divided by the number of particles in it"},
          {.key = "particles_stresses",
           .kinds = file | object,
           .help = "initial stresses: the "
                   "count, then a line xx yy zz xy yz xz per particle [Pa]",
           .section = stresses_section},
          {.key = "particles_tractions",
           .kinds = file,
           .help = "ignored by the reference",
           .support = Support::ignored},
          {.key = "boundary_conditions",
           .kinds = object,
           .help = "constraints on nodes and "
                   "particles",
           .fallback = "{}",
           .section = boundary_section},
          {.key = "particles_pore_pressures",
           .kinds = any,
           .help = "initial pore pressures (dialect of the fork)",
           .support = Support::planned},
          {.key = "mesh_reader", .kinds = any, .help = "write io_type", .support = Support::older},
          {.key = "material_id",
           .kinds = any,
           .help = "it is in particles[].generator",
           .support = Support::older},
          {.key = "particle_type",
           .kinds = any,
           .help = "it is in particles[].generator",
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
          "velocity`. Entries on the same node combine; of several for a node and direction "
          "the first wins.",
      .fields = {
          {.key = "nset_id",
           .kinds = id,
           .help = "node set: an id of entity_sets, -1 for all "
                   "nodes, or a name of sets.nodes",
           .min = -1},
          {.key = "nset", .kinds = id, .help = "the same as nset_id", .min = -1, .native = true},
          {.key = "dir", .kinds = direction, .help = "direction"},
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
          "sign_n friction`. It acts where the acceleration presses a node against the wall. A "
          "node has one friction; of several the last counts. What keeps the node from leaving "
          "through the wall is a velocity constraint.",
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
          {.key = "file", .kinds = file, .help = "file of lines `node dir sign_n friction`"},
      }};
  return section;
}

const Section& particle_velocity_section() {
  static const Section section{
      .name = "a particle velocity constraint",
      .path = "mesh.boundary_conditions.particles_velocity_constraints[]",
      .help =
          "A prescribed velocity component of a set of particles, applied at the end of every "
          "step.",
      .fields = {
          {.key = "pset_id",
           .kinds = id,
           .help = "particle set: an id, -1 for all, or a name of "
                   "sets.particles",
           .min = -1},
          {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = -1, .native = true},
          {.key = "dir", .kinds = direction, .help = "direction", .required = true},
          {.key = "velocity", .kinds = number, .help = "velocity", .unit = "m/s", .required = true},
      }};
  return section;
}

}  // namespace

const Section& boundary_section() {
  static const Section section{.name = "mesh.boundary_conditions",
                               .path = "mesh.boundary_conditions",
                               .help = "Constraints on nodes and particles.",
                               .fields = {
                                   {.key = "velocity_constraints",
                                    .kinds = list | file,
                                    .help = "prescribed nodal velocities; older cases name a file",
                                    .section = velocity_constraint_section},
                                   {.key = "friction_constraints",
                                    .kinds = list | file,
                                    .help = "friction at nodes; older cases name a file",
                                    .section = friction_section},
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
                                    .kinds = any,
                                    .help = "boundaries that waves leave through",
                                    .support = Support::planned},
                                   {.key = "pressure_constraints",
                                    .kinds = any,
                                    .help = "pressures of nodes (dialect of the fork)",
                                    .support = Support::planned},
                                   {.key = "pore_pressure_constraints",
                                    .kinds = any,
                                    .help = "pressures of nodes, from files (dialect of the fork)",
                                    .support = Support::planned},
                               }};
  return section;
}

const Section& sets_section() {
  static const Section section{
      .name = "sets",
      .path = "sets",
      .help =
          "Named sets from geometry: nodes in a region, cells whose centre is in it, particles "
          "that start in it. A name stands wherever the CB-Geo format has a numeric id.",
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
