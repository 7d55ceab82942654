// Tables of the scenario's top level and of post-processing.
#include <algorithm>

#include "io/schema/keys.h"

namespace lahar {

const Section& scenario_section() {
  static const Section section{
      .name = "the scenario",
      .path = "Scenario",
      .help =
          "A scenario is one JSON object; `//` and `/* */` comments are allowed. File names are "
          "relative to the scenario's folder. Units are SI: m, kg, s, N, Pa; in two dimensions "
          "forces, masses and energies are per metre of thickness, and the state is plane strain, "
          "unless analysis.plane says something else.",
      .keys = {
          {.key = "title", .kinds = text, .help = "what the case is", .fallback = "\"\""},
          {.key = "mesh",
           .kinds = object,
           .help = "background mesh and boundary conditions",
           .required = true,
           .section = mesh_section},
          {.key = "geometry",
           .kinds = map,
           .help = "name: a surface or polygons; regions name them",
           .section = geometry_section,
           .native = true},
          {.key = "sets",
           .kinds = object,
           .help = "named sets of nodes, cells and particles, from geometry",
           .section = sets_section,
           .native = true},
          {.key = "particles",
           .kinds = list,
           .help = "sources of particles; ids follow their order",
           .required = true,
           .section = particles_section},
          {.key = "materials",
           .kinds = list,
           .help = "constitutive laws and densities",
           .required = true,
           .section = materials_section},
          {.key = "rigid_bodies",
           .kinds = list,
           .help = "terrain, obstacles and tools that cut the mesh",
           .section = rigid_body_section,
           .native = true},
          {.key = "material_sets",
           .kinds = list,
           .help = "give sets of particles another material before the first step",
           .section = material_set_section},
          {.key = "external_loading_conditions",
           .kinds = object,
           .help = "gravity and loads",
           .fallback = "{}",
           .section = loading_section},
          {.key = "math_functions",
           .kinds = list,
           .help = "functions of time that multiply a load",
           .section = function_section},
          {.key = "analysis",
           .kinds = object,
           .help = "scheme, time step and duration",
           .required = true,
           .section = analysis_section},
          {.key = "post_processing",
           .kinds = object,
           .help = "what is written, where and how often",
           .fallback = "{}",
           .section = post_processing_section},
          {.key = "stages",
           .kinds = list,
           .help = "runs that follow each other, and what changes in each",
           .section = stage_section,
           .native = true},
          {.key = "at_start",
           .kinds = object,
           .help = "what a stage does to particles; it is written in the stage",
           .section = at_start_section,
           .native = true},
          {.key = "input_files",
           .kinds = any,
           .help = "name files where they belong: mesh.mesh, mesh.particles_volumes, \"file\" in "
                   "entries of mesh.boundary_conditions and external_loading_conditions, and "
                   "\"location\" in particles[].generator of type \"file\"",
           .support = Support::older},
          {.key = "particle",
           .kinds = any,
           .help = "material_id and particle_type are in particles[].generator",
           .support = Support::older},
      }};
  return section;
}

namespace {

const Section& statevars_section() {
  static const Section section{
      .name = "post_processing.vtk_statevars",
      .path = "post_processing.vtk_statevars[]",
      .help =
          "State variables for ParaView. Frames always contain the state variables of all "
          "materials, each as a field with its name. A field is 0 for particles whose material "
          "does not have the variable.",
      .keys = {
          {.key = "phase_id",
           .kinds = integer,
           .help = "phase",
           .fallback = "0",
           .min = 0,
           .max = 1},
          {.key = "statevars",
           .kinds = texts,
           .help = "names of state variables",
           .required = true},
      }};
  return section;
}

}  // namespace

const Section& post_processing_section() {
  static const Section section{
      .name = "post_processing",
      .path = "post_processing",
      .help =
          "The run folder is `path`/`analysis.uuid`. Frames always contain every column of the "
          "particles and every state variable. Names of derived fields in `vtk` add these. Other "
          "names in `vtk`, and those in `vtk_statevars`, are accepted for compatibility.",
      .keys = {
          {.key = "path",
           .kinds = text,
           .help = "folder of the results, in that of the scenario; --output writes elsewhere",
           .fallback = "\"results/\""},
          {.key = "output_steps",
           .kinds = integer,
           .help = "steps between frames; 0: only the "
                   "end",
           .fallback = "0",
           .min = 0,
           .max = 9e15},
          {.key = "output_dt",
           .kinds = number,
           .help = "instead of output_steps: a frame at every multiple of this time; 0: none. A "
                   "fixed step is not shortened: the step that reaches the time gets the frame. "
                   "Adaptive steps end at these times: the last two steps before a frame are equal",
           .unit = "s",
           .fallback = "0",
           .min = 0,
           .native = true},
          {.key = "max_frames",
           .kinds = integer,
           .help = "largest number of frames, not counting the first and the last. The run warns "
                   "when it reaches this number; after that it writes the last state only",
           .fallback = "10000",
           .min = 0,
           .max = 9e15,
           .native = true},
          {.key = "frame_fields",
           .kinds = texts,
           .help = "the only fields of frames, beside coordinates, ids and materials; default all",
           .native = true},
          {.key = "frame_pset",
           .kinds = id,
           .help = "the only particles of frames: id or name of a set of particles; default all. "
                   "Particles that come in later are in no set. Checkpoints hold all particles",
           .min = -1,
           .native = true},
          {.key = "frame_precision",
           .kinds = text,
           .help = "numbers of frames: \"single\" halves the files. Checkpoints are always double",
           .fallback = "\"double\"",
           .allowed = {"double", "single"},
           .native = true},
          {.key = "node_fields",
           .kinds = texts,
           .help = "fields of nodes: \"mass\", \"velocity\", \"acceleration\". With each frame "
                   "after a step comes a file of the nodes that have mass. Values are those of the "
                   "last step before the frame: the mass that moved in it, the acceleration, and "
                   "the velocity after its update, when conditions and contact are met and before "
                   "particles move. Newmark: the mean velocity of the step. Nodes at which bodies "
                   "meet have the mass of all bodies, and means by mass. Soil with water has "
                   "those of the skeleton. Default none",
           .native = true},
          {.key = "history_steps",
           .kinds = integer,
           .help = "steps between rows of history.csv; "
                   "0: automatic",
           .fallback = "0",
           .min = 0,
           .max = 9e15,
           .native = true},
          {.key = "history_dt",
           .kinds = number,
           .help = "instead of history_steps: a row at every multiple of this time, as output_dt",
           .unit = "s",
           .fallback = "0",
           .min = 0,
           .native = true},
          {.key = "gauges",
           .kinds = list,
           .help = "what is measured while the run goes on",
           .section = gauge_section,
           .native = true},
          {.key = "maps",
           .kinds = object,
           .help = "rasters of the largest thickness, speed and more; 3D only",
           .section = maps_section,
           .native = true},
          {.key = "gauge_steps",
           .kinds = integer,
           .help = "steps between rows of gauges; 0: with the rows of history.csv",
           .fallback = "0",
           .min = 0,
           .max = 9e15,
           .native = true},
          {.key = "gauge_dt",
           .kinds = number,
           .help = "instead of gauge_steps: a row at every multiple of this time, as output_dt; "
                   "adaptive steps end there, too",
           .unit = "s",
           .fallback = "0",
           .min = 0,
           .native = true},
          {.key = "checkpoint_steps",
           .kinds = integer,
           .help = "steps between checkpoints, from which --restart continues; 0: none. With this "
                   "key or checkpoint_minutes the run also writes a checkpoint at its end",
           .fallback = "0",
           .min = 0,
           .max = 9e15,
           .native = true},
          {.key = "checkpoint_minutes",
           .kinds = number,
           .help = "wall time between checkpoints; 0: none",
           .unit = "min",
           .fallback = "0",
           .min = 0,
           .native = true},
          {.key = "checkpoints_kept",
           .kinds = integer,
           .help = "number of latest checkpoints to keep; older ones are removed",
           .fallback = "2",
           .min = 1,
           .max = 1e6,
           .native = true},
          {.key = "vtk",
           .kinds = texts,
           .help =
               "fields for ParaView: names of derived fields (see Derived fields), and "
               "displacements, velocities, stresses, strains, ..., which frames contain anyway"},
          {.key = "vtk_statevars",
           .kinds = list | texts,
           .help = "state variables for ParaView; older cases have a list of their names",
           .section = statevars_section},
      }};
  return section;
}

bool KeySpec::applies(std::string_view variant) const {
  return only.empty() || std::find(only.begin(), only.end(), variant) != only.end();
}

const KeySpec* Section::find(std::string_view key, std::string_view variant) const {
  const KeySpec* found = nullptr;
  for (const KeySpec& spec : keys) {
    if (spec.key != key) continue;
    if (spec.applies(variant)) return &spec;
    if (!found) found = &spec;
  }
  return found;
}

namespace {

void collect(const Section& section, std::vector<const Section*>& out) {
  if (std::find(out.begin(), out.end(), &section) != out.end()) return;
  out.push_back(&section);
  for (const KeySpec& spec : section.keys)
    if (spec.section) collect(spec.section(), out);
}

}  // namespace

std::vector<const Section*> all_sections() {
  std::vector<const Section*> out;
  collect(scenario_section(), out);
  return out;
}

}  // namespace lahar
