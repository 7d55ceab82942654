// The reference page of the input, from the key tables.
#include <fmt/format.h>

#include <cmath>

#include "io/schema/cbgeo_deviations.h"
#include "io/schema/keys.h"
#include "physics/particles/derived_fields.h"

namespace lahar {

namespace {

constexpr const char* introduction = R"(# Reference of the scenario file

A scenario is a JSON file with comments. This file is a complete case: an elastic block rests on
the floor and settles under its weight.

```json
{
  "title": "Block on the floor",
  "mesh": {
    "structured": {"origin": [0, 0], "cell_size": 0.1, "counts": [20, 12]},
    "boundary_conditions": {
      "velocity_constraints": [{"nset": "floor", "dir": "y", "velocity": 0}]
    }
  },
  "sets": {"nodes": {"floor": {"half_space": {"point": [0, 0], "normal": [0, 1]}}}},
  "particles": [
    {"generator": {
      "type": "region", "region": {"box": {"min": [0.5, 0], "max": [1.5, 1]}},
      "per_cell": 2, "material": "rubber"
    }}
  ],
  "materials": [
    {"name": "rubber", "type": "LinearElastic2D", "density": 1000,
     "youngs_modulus": 1e6, "poisson_ratio": 0.3}
  ],
  "external_loading_conditions": {"gravity": [0, -9.81]},
  "analysis": {"mpm_scheme": "usl", "dt": 1e-4, "nsteps": 1000},
  "post_processing": {"output_steps": 100}
}
```

The format is a superset of the CB-Geo MPM input format; keys marked *Lahar* are not in CB-Geo's.
A key that the tables below do not list is an error.

**Names and ids.** Sets, materials and functions of time are referred to by id or by name. Ids are
those of the entity sets file (`-1` means all), of `materials[].id` and of `math_functions[].id`;
names are those of `sets`, `materials[].name` and `math_functions[].name`. A generator's `pset_id`
makes a particle set of its particles.

**Command line.** `--set analysis.nsteps=10` or `--set /materials/0/density=1800` replaces a value
(read as JSON, or as text if it is not valid JSON).

**Which cell owns a particle.** Cells are closed. At the start a particle belongs to the cell in
`particle_cells` if that cell contains it, otherwise to the cell with the lowest id that contains
it. A particle outside the mesh is an error.
)";

constexpr const char* side_files = R"(
## Side files

Columns are separated by blanks; blank lines and lines that begin with # or ! are skipped; ids count
from 0 in file order. Numbers must be finite, and the counts must be right.

| file | rows |
|---|---|
| `mesh.mesh` | `nnodes ncells`; then per node its coordinates; then per cell its node ids, quadrilaterals counter-clockwise, hexahedra bottom face counter-clockwise, then top |
| `particles[].generator.location` | the count; then per particle its coordinates |
| `mesh.particles_volumes` | `particle volume`, each particle at most once |
| `mesh.particle_cells` | `particle cell` |
| `mesh.particles_stresses` | the count; then per particle `xx yy zz xy yz xz` |
| `velocity_constraints[].file` | `node dir velocity` |
| `acceleration_constraints[].file` | `node dir acceleration` |
| `concentrated_nodal_forces[].file` | `node dir force` |
| `friction_constraints[].file` | `node dir sign_n friction` |
| `math_functions[].file` | `time value` or `time, value` |
| `nodal_euler_angles` | `node alpha beta [gamma]` in radians |
| `mesh.entity_sets` | JSON: `{"node_sets": [{"id": 0, "set": [0, 1]}], "cell_sets": [...], "particle_sets": [...]}` |

In two dimensions a third coordinate is accepted and not used.
)";

std::string range(const KeySpec& spec) {
  const bool low = std::isfinite(spec.min), high = std::isfinite(spec.max);
  if (low && high)
    return fmt::format("{}{}, {}{}", spec.above_min ? "(" : "[", spec.min, spec.max,
                       spec.below_max ? ")" : "]");
  if (low) return fmt::format("{} {}", spec.above_min ? ">" : ">=", spec.min);
  if (high) return fmt::format("{} {}", spec.below_max ? "<" : "<=", spec.max);
  return "";
}

std::string code_list(const std::vector<std::string_view>& words) {
  std::vector<std::string> out;
  for (const auto w : words) out.push_back(fmt::format("`{}`", w));
  return join(out);
}

std::string value_of(const KeySpec& spec) {
  if (!spec.allowed.empty() && (spec.kinds & number))
    return fmt::format("a number{} or {}", range(spec).empty() ? "" : " " + range(spec) + ",",
                       code_list(spec.allowed));
  if (!spec.allowed.empty() && !(spec.kinds & boolean)) return code_list(spec.allowed);
  KeySpec plain = spec;
  plain.unit = "";
  std::string out = allowed_kinds(plain);
  if (spec.section && (spec.kinds & (object | list | map)))
    out += fmt::format(" (see {})", spec.section().path);
  if (!spec.allowed.empty()) out += ": " + code_list(spec.allowed);
  const std::string bounds = range(spec);
  if (!bounds.empty() && !(spec.kinds & (id | text))) out += ", " + bounds;
  return out;
}

std::string default_of(const KeySpec& spec) {
  if (spec.required) return "required";
  if (spec.fallback.empty()) return "";
  if (spec.fallback_3d.empty()) return fmt::format("`{}`", spec.fallback);
  return fmt::format("`{}` or `{}`", spec.fallback, spec.fallback_3d);
}

std::string meaning_of(const KeySpec& spec) {
  std::string out(spec.help);
  if (!spec.only.empty()) out += fmt::format("; only for {}", code_list(spec.only));
  if (!spec.planned.empty()) out += fmt::format("; not supported yet: {}", code_list(spec.planned));
  if (spec.planned_kinds) out += "; not supported yet as an object";
  if (spec.support == Support::planned) out += "; **not supported yet**";
  if (spec.support == Support::older) out += "; **older format, not read**";
  if (spec.support == Support::ignored) out += "; accepted with a warning, without effect";
  if (spec.native) out += " *(Lahar)*";
  return out;
}

// Table cells must not end early.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c;
  }
  return out;
}

std::string derived_fields_table() {
  std::string out =
      "\n## Derived fields\n\nFrames contain the derived fields that `post_processing.vtk` names. "
      "They follow from the columns of\nthe particle at that step. Stress is positive in tension, "
      "strain has engineering shears.\n\n| name | unit | components | meaning "
      "|\n|---|---|---|---|\n";
  for (const DerivedField& field : derived_fields)
    out += fmt::format("| `{}` | {} | {} | {} |\n", field.name, field.unit, field.components,
                       field.help);
  return out;
}

std::string deviations() {
  std::string out =
      "\n## What --as-cbgeo changes\n\nIn these places CB-Geo MPM departs from its documentation "
      "or from physics. `--as-cbgeo` (or\n`analysis.as_cbgeo`) reproduces them, so that results "
      "can be compared:\n\n| what | with `--as-cbgeo`, as CB-Geo MPM | without |\n|---|---|---|\n";
  for (const CbgeoDeviation& d : cbgeo_deviations())
    out += fmt::format("| {} | {} | {} |\n", d.what, d.there, d.here);
  return out;
}

}  // namespace

std::string section_reference(const Section& section) {
  std::string out = fmt::format(
      "\n## {}\n\n{}\n\n| key | value | unit | default | meaning |\n|---|---|---|---|---|\n",
      section.path, section.help);
  for (const KeySpec& spec : section.keys)
    out += fmt::format("| `{}` | {} | {} | {} | {} |\n", spec.key, escaped(value_of(spec)),
                       spec.unit, escaped(default_of(spec)), escaped(meaning_of(spec)));
  return out;
}

std::string scenario_reference() {
  std::string out = introduction;
  for (const Section* section : all_sections()) out += section_reference(*section);
  out += side_files;
  for (const Section* section : {&driver_section(), &path_section()})
    out += section_reference(*section);
  return out + derived_fields_table() + deviations();
}

}  // namespace lahar
