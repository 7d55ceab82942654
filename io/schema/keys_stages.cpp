// Table of stages.
#include "io/schema/keys.h"

namespace lahar {

const Section& stage_section() {
  static const Section section{
      .name = "a stage",
      .path = "stages[]",
      .help =
          "`lahar run` runs stages one after the other. Each begins with the state in which the "
          "one before ended. Steps and time begin at 0 in each stage. A stage is the scenario, "
          "changed by this stage and by all before it: objects are merged, values and lists "
          "replace what was there, null removes a key (JSON merge patch, RFC 7396). Particles, "
          "mesh, sets, types and densities of materials, shape functions, contact of bodies and "
          "the number of phases are the same in all stages. Particles of stages are not injected.",
      .keys = {
          {.key = "name",
           .kinds = text,
           .help = "the run folder of the stage is RUN/name",
           .required = true},
          {.key = "analysis", .kinds = any, .help = "what changes in analysis: scheme, steps, ..."},
          {.key = "materials",
           .kinds = any,
           .help = "all materials, with other parameters; types and densities stay"},
          {.key = "external_loading_conditions",
           .kinds = any,
           .help = "what changes in external_loading_conditions"},
          {.key = "mesh",
           .kinds = any,
           .help = "what changes in mesh.boundary_conditions; no other key of mesh"},
          {.key = "post_processing",
           .kinds = any,
           .help = "what changes in post_processing, except path"},
      }};
  return section;
}

}  // namespace lahar
