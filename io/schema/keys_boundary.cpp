// Boundary conditions: the keys of those in the table (physics/boundary/conditions.h), and of what
// else holds or moves nodes and particles.
#include "io/schema/keys_parameter.h"
#include "physics/boundary/conditions.h"

namespace lahar {

namespace {

template <class T>
inline constexpr bool has_older_form = false;
template <class T>
requires T::older_file_form inline constexpr bool has_older_form<T> = true;

std::vector<KeySpec> node_set_keys() {
  return {{.key = "nset_id",
           .kinds = id,
           .help = "node set: an id of entity_sets, -1 for all nodes, or a name of sets.nodes",
           .min = -1},
          {.key = "nset", .kinds = id, .help = "the same as nset_id", .min = -1, .native = true}};
}

KeySpec function_key() {
  return {.key = "math_function_id",
          .kinds = id,
          .help = "factor over time: an id of math_functions or a name; default constant",
          .min = 0};
}

KeySpec phase_key() {
  return {.key = "phase",
          .kinds = text,
          .help = "which phase is held; default both, with the preset cbgeo the skeleton",
          .allowed = {"skeleton", "liquid"},
          .native = true};
}

template <class T>
std::vector<KeySpec> keys_of() {
  std::vector<KeySpec> keys = node_set_keys();
  if constexpr (HasDirection<T>)
    keys.push_back({.key = "dir",
                    .kinds = has_phases<T> ? phase_direction : direction,
                    .help = T::direction.help,
                    .required = !is_from_file<T>});
  if (has_phases<T>) keys.push_back(phase_key());
  if (is_of_liquid<T>)
    keys.push_back({.key = "phase_id",
                    .kinds = integer,
                    .help = "phase: 1 is the liquid in pores, 0 a fluid without pores",
                    .min = 0,
                    .max = 1});
  std::string row = HasDirection<T> ? "file of lines `node dir" : "file of lines `node";
  for (const auto& p : T::parameters) {
    keys.push_back(key_of(p));
    if (is_from_file<T>) keys.back().required = false;
    keys.back().native = p.by_preset || T::native;
    if (p.required) row += fmt::format(" {}", p.key);
  }
  if constexpr (HasFunction<T>) keys.push_back(function_key());
  if (is_from_file<T>) keys.push_back({.key = "file", .kinds = file, .help = kept_text(row + "`")});
  return keys;
}

template <class T>
const Section& section_of() {
  static const Section section{
      .name = T::name,
      .path = kept_text(fmt::format(
          "{}.{}[]", is_load<T> ? "external_loading_conditions" : "mesh.boundary_conditions",
          T::key)),
      .help = T::help,
      .keys = keys_of<T>()};
  return section;
}

std::vector<KeySpec> wall_keys() {
  std::vector<KeySpec> keys = node_set_keys();
  keys.push_back(
      {.key = "normal",
       .kinds = vector,
       .help = "direction from the wall into the material, along an axis: [0, 1] for a floor",
       .required = true,
       .native = true});
  keys.push_back({.key = "friction",
                  .kinds = number | text,
                  .help = "friction coefficient, or \"rough\": material does not slide while it is "
                          "pressed against the wall",
                  .unit = "-",
                  .fallback = "0",
                  .native = true});
  return keys;
}

const Section& wall_section() {
  static const Section section{
      .name = "a wall",
      .path = "mesh.boundary_conditions.walls[]",
      .help =
          "A rigid wall at rest through a set of nodes. It pushes and does not pull: material may "
          "leave it, and slides on it with Coulomb friction. A node may lie on several walls along "
          "different axes. Inside of the mesh take all nodes behind the wall as well: smooth shape "
          "functions reach past a single row. Use velocity constraints for symmetry planes and "
          "fixed ends.",
      .keys = wall_keys()};
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
      .keys = {
          {.key = "pset_id",
           .kinds = id,
           .help = "particle set: an id, -1 for all, or a name of sets.particles",
           .min = -1},
          {.key = "pset", .kinds = id, .help = "the same as pset_id", .min = -1, .native = true},
          {.key = "dir",
           .kinds = phase_direction,
           .help = "direction; from the dimension on, that of the liquid in pores",
           .required = true},
          phase_key(),
          {.key = "velocity", .kinds = number, .help = "velocity", .unit = "m/s", .required = true},
          function_key(),
      }};
  return section;
}

}  // namespace

std::vector<KeySpec> condition_keys(bool loads) {
  std::vector<KeySpec> keys;
  for_each_condition([&]<class T>() {
    if (is_load<T> != loads) return;
    unsigned kinds = list;
    if (loads) kinds |= object;
    if (!loads && has_older_form<T>) kinds |= file;
    keys.push_back({.key = T::key,
                    .kinds = kinds,
                    .help = T::summary,
                    .section = section_of<T>,
                    .native = T::native});
  });
  return keys;
}

namespace {

std::vector<KeySpec> boundary_keys() {
  std::vector<KeySpec> keys = condition_keys(false);
  const std::vector<KeySpec> others = {
      {.key = "walls",
       .kinds = list,
       .help = "rigid walls that push and do not pull",
       .section = wall_section,
       .native = true},
      {.key = "nodal_euler_angles",
       .kinds = file,
       .help =
           "rotated frames of nodes, in which their velocity and friction constraints act: lines "
           "`node alpha beta [gamma]` in radians"},
      {.key = "particles_velocity_constraints",
       .kinds = list,
       .help = "prescribed particle velocities",
       .section = particle_velocity_section},
      {.key = "cohesion_constraints",
       .kinds = any,
       .help = "adhesion of nodes to a wall (dialect of the fork)",
       .support = Support::planned},
      {.key = "adhesion_constraints",
       .kinds = any,
       .help = "adhesion of nodes to a wall (dialect of the fork)",
       .support = Support::planned},
      {.key = "pore_pressure_constraints",
       .kinds = any,
       .help = "write pressure_constraints, where free surfaces do not drain the pores anyway",
       .support = Support::ignored},
  };
  keys.insert(keys.end(), others.begin(), others.end());
  return keys;
}

}  // namespace

const Section& boundary_section() {
  static const Section section{.name = "mesh.boundary_conditions",
                               .path = "mesh.boundary_conditions",
                               .help = "Constraints on nodes and particles.",
                               .keys = boundary_keys()};
  return section;
}

}  // namespace lahar
