// Table of stages.
#include "io/schema/keys.h"

namespace lahar {

namespace {

std::vector<KeySpec> group_keys() {
  return {
      {.key = "region",
       .kinds = object,
       .help = "those that are in it when the stage begins",
       .section = region_section,
       .native = true},
      {.key = "pset_id", .kinds = id, .help = "those of a particle set", .min = -1},
      {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = -1, .native = true},
  };
}

std::vector<KeySpec> removal_keys() {
  std::vector<KeySpec> keys = group_keys();
  keys.push_back({.key = "over",
                  .kinds = number,
                  .help = "they go little by little in this time, so that nothing is shaken: "
                          "mass and volume, and with them weight, forces of stress and stiffness, "
                          "fall to zero; 0: at once",
                  .unit = "s",
                  .fallback = "0",
                  .min = 0,
                  .native = true});
  return keys;
}

const Section& removal_section() {
  static const Section section{.name = "an entry of remove",
                               .path = "stages[].remove[]",
                               .help = "Particles that vanish: those of a region or of a set.",
                               .keys = removal_keys()};
  return section;
}

std::vector<KeySpec> changed_material_keys() {
  std::vector<KeySpec> keys = group_keys();
  keys.push_back(
      {.key = "material_id",
       .kinds = id | ids,
       .help = "material: an id or a name; with a liquid in its pores, two: [skeleton, liquid]",
       .min = 0});
  keys.push_back({.key = "material",
                  .kinds = id | ids,
                  .help = "the same as material_id",
                  .min = 0,
                  .native = true});
  return keys;
}

const Section& change_section() {
  static const Section section{
      .name = "an entry of change_material",
      .path = "stages[].change_material[]",
      .help =
          "Particles, of a region or of a set, that get another material; later entries win. "
          "They keep volume, motion and stress. Their mass is that of the new density, and "
          "state variables begin anew.",
      .keys = changed_material_keys()};
  return section;
}

/// What a stage does to particles.
std::vector<KeySpec> operation_keys() {
  return {
      {.key = "remove",
       .kinds = list,
       .help = "particles that vanish when the stage begins, or little by little",
       .section = removal_section,
       .native = true},
      {.key = "change_material",
       .kinds = list,
       .help = "then particles that get another material of the scenario",
       .section = change_section,
       .native = true},
      {.key = "reset",
       .kinds = texts,
       .help = "then what begins at zero again: \"displacement\", \"strain\"",
       .native = true},
  };
}

const Section& stage_mesh_section() {
  static const Section section{.name = "mesh of a stage",
                               .path = "stages[].mesh",
                               .help = "What changes in mesh.",
                               .keys = {
                                   {.key = "boundary_conditions",
                                    .kinds = object,
                                    .help = "constraints on nodes and particles",
                                    .section = boundary_section},
                               }};
  return section;
}

}  // namespace

const Section& at_start_section() {
  static const Section section{
      .name = "at_start",
      .path = "at_start",
      .help =
          "What a stage does to particles when it begins. `lahar run` writes it into "
          "scenario.full.json; in a scenario it is written in the stage.",
      .keys = operation_keys()};
  return section;
}

const Section& stage_section() {
  static const Section section = [] {
    Section stage{
        .name = "a stage",
        .path = "stages[]",
        .help =
            "`lahar run` runs stages one after the other. Each begins with the state in which the "
            "one before ended. Steps and time begin at 0 in each stage. A stage is the scenario, "
            "changed by this stage and by all before it: objects are merged, values and lists "
            "replace what was there, null removes a key (JSON merge patch, RFC 7396). Then, once, "
            "particles are removed, changed and placed. Mesh, sets, types and densities of "
            "materials, shape functions, contact of bodies and the number of phases are the same "
            "in all stages. Particles of stages are not injected.",
        .keys = {
            {.key = "name",
             .kinds = text,
             .help = "the run folder of the stage is RUN/name",
             .required = true},
            {.key = "analysis",
             .kinds = object,
             .help = "what changes in analysis: scheme, steps, ...",
             .section = analysis_section},
            {.key = "materials",
             .kinds = list,
             .help = "all materials, with other parameters; types and densities stay",
             .section = materials_section},
            {.key = "external_loading_conditions",
             .kinds = object,
             .help = "what changes in external_loading_conditions",
             .section = loading_section},
            {.key = "mesh",
             .kinds = object,
             .help = "what changes in mesh.boundary_conditions; no other key of mesh",
             .section = stage_mesh_section},
            {.key = "rigid_bodies",
             .kinds = list,
             .help = "all rigid bodies. Those that the stage before had, by `name`, begin where "
                     "they were; free ones keep their velocity. Others begin where `region` says",
             .section = rigid_body_section},
            {.key = "post_processing",
             .kinds = object,
             .help = "what changes in post_processing, except path",
             .section = post_processing_section},
        }};
    const std::vector<KeySpec> operations = operation_keys();
    stage.keys.insert(stage.keys.end(), operations.begin(), operations.end());
    stage.keys.push_back({.key = "place",
                          .kinds = list,
                          .help = "sources of particles that come when the stage begins, as in "
                                  "particles; their ids are above all others. They have no "
                                  "stress but the `stress` of the generator",
                          .section = particles_section,
                          .native = true});
    return stage;
  }();
  return section;
}

}  // namespace lahar
