// Tables of the mesh, its boundary conditions, sets and regions.
#include "io/schema/keys.h"

namespace lahar {

namespace {

const Section& structured_section() {
  static const Section section{
      .name = "mesh.structured",
      .path = "mesh.structured",
      .help =
          "A grid of equal boxes, in place of a mesh file. Two of `cell_size`, `extent` and "
          "`counts` define its size. Cell (i, j, k) has the id i + nx (j + ny k).",
      .keys = {
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
           .kinds = cell_counts,
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
      .keys = {
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
      .keys = {
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
          {.key = "surface",
           .kinds = text,
           .help = "the name of a surface of geometry that is the level of the water, in place of "
                   "water_tables; without water where it has no height",
           .only = {"water_table"},
           .native = true},
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
                               .keys = {
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
      .keys = {
          {.key = "type",
           .kinds = text,
           .help = "kind of functions",
           .required = true,
           .allowed = {"BSPLINE"},
           .planned = {"LME"}},
          {.key = "kernel_correction", .kinds = boolean, .help = "without effect"},
          {.key = "kernel_correction_iteration", .kinds = number, .help = "without effect"},
          {.key = "kernel_correction_tolerance", .kinds = number, .help = "without effect"},
          {.key = "node_types",
           .kinds = list,
           .help = "without effect",
           .section = node_type_section},
      }};
  return section;
}

const Section& k0_section() {
  static const Section section{
      .name = "an entry of materials of mesh.particles_stresses",
      .path = "mesh.particles_stresses.materials[]",
      .help = "K0 of a material.",
      .keys = {
          {.key = "material_id", .kinds = id, .help = "material: an id or a name", .min = 0},
          {.key = "material",
           .kinds = id,
           .help = "the same as material_id",
           .min = 0,
           .native = true},
          {.key = "k0",
           .kinds = number | text,
           .help = "as k0 of mesh.particles_stresses",
           .unit = "-",
           .required = true,
           .min = 0,
           .allowed = {"jaky"},
           .native = true},
      }};
  return section;
}

const Section& stresses_section() {
  static const Section section{
      .name = "mesh.particles_stresses",
      .path = "mesh.particles_stresses",
      .help = "Initial stresses as an object (`file` and `isotropic`: dialect of the fork).",
      .discriminator = "type",
      .keys = {
          {.key = "type",
           .kinds = text,
           .help = "source of the stresses",
           .required = true,
           .allowed = {"file", "isotropic", "k0"}},
          {.key = "location", .kinds = file, .help = "file of stresses", .only = {"file"}},
          {.key = "k0",
           .kinds = number | text,
           .help = "effective stress across over the vertical one: a number, or \"jaky\": 1 - "
                   "sin(phi), of laws with a friction angle. Fluids have 1. The vertical stress "
                   "is the weight of the particles above, column by column, less the pore "
                   "pressure. It is in balance where the ground is level; under slopes bring it "
                   "to rest (analysis.until)",
           .unit = "-",
           .min = 0,
           .allowed = {"jaky"},
           .only = {"k0"},
           .native = true},
          {.key = "materials",
           .kinds = list,
           .help = "k0 of single materials, in place of that of all",
           .section = k0_section,
           .only = {"k0"},
           .native = true},
          {.key = "surcharge",
           .kinds = number,
           .help = "vertical stress at the ground surface; give it as a traction, too",
           .unit = "Pa",
           .fallback = "0",
           .min = 0,
           .only = {"k0"},
           .native = true},
          {.key = "values",
           .kinds = number | numbers,
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
      .keys = {
          {.key = "mesh",
           .kinds = file,
           .help =
               "mesh file: `nnodes ncells`, a line of coordinates "
               "per node, a line of node ids per cell (counter-clockwise; hexahedra bottom "
               "face, then top; then the middles of sides, edges and faces in Gmsh's order). Or a "
               "file of Gmsh (.msh 2.2 or 4.1, text or binary) or of VTK (.vtu): these say "
               "their element, and groups and arrays of integers are sets of their names"},
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
           .help = "element of all cells; the default follows from the dimension, or from a file "
                   "of Gmsh or VTK. ED2Q16G and "
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
          {.key = "map_origin",
           .kinds = numbers,
           .help =
               "3D: [x, y], the place on the map where the model has x = 0 and y = 0. Rasters "
               "and polygons of geometry are in coordinates of the map, all else is in those of "
               "the model; default [0, 0]",
           .unit = "m",
           .native = true},
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

const Section& sets_section() {
  static const Section section{
      .name = "sets",
      .path = "sets",
      .help =
          "Named sets from geometry: nodes in a region, cells with their centre in it, particles "
          "that start in it. A name can replace any numeric id of the CB-Geo format.",
      .keys = {
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
