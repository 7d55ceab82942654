// Tables of `lahar material`'s input.
#include "io/schema/keys.h"

namespace lahar {

const Section& path_section() {
  static const Section section{
      .name = "a segment of the path",
      .path = "path[]",
      .help =
          "A part of the path: `triaxial` with `axial_strain`, `change` with `control`, or "
          "`increments`.",
      .keys = {
          {.key = "steps", .kinds = integer, .help = "equal steps", .min = 1, .max = 1e7},
          {.key = "time",
           .kinds = number,
           .help = "duration of the segment, for laws that depend on the rate",
           .unit = "s",
           .fallback = "1",
           .min = 0,
           .above_min = true},
          {.key = "triaxial",
           .kinds = text,
           .help = "along z: drained (constant stress at the sides), undrained (constant volume), "
                   "or oedometer (no strain at the sides)",
           .allowed = {"drained", "undrained", "oedometer"}},
          {.key = "axial_strain",
           .kinds = number,
           .help = "change of strain_zz, negative in compression",
           .unit = "-",
           .min = -largest_path_strain,
           .max = largest_path_strain},
          {.key = "change",
           .kinds = numbers,
           .help =
               "changes of the six components xx yy zz xy yz xz over the segment; shear strains "
               "are engineering strains",
           .unit = "- or Pa"},
          {.key = "control",
           .kinds = texts,
           .help = "\"strain\" or \"stress\" for each component of `change`; default: all strain"},
          {.key = "increments",
           .kinds = file,
           .help = "file with a row of six strain increments per step"},
      }};
  return section;
}

const Section& driver_section() {
  static const Section section{
      .name = "a material driver",
      .path = "driver",
      .help =
          "`lahar material driver.json` drives one material point along a strain or stress path. "
          "Stresses are positive in tension.",
      .keys = {
          {.key = "title", .kinds = text, .help = "title of the plot", .fallback = "\"\""},
          {.key = "material",
           .kinds = object,
           .help = "the material",
           .required = true,
           .section = materials_section},
          {.key = "initial_stress",
           .kinds = numbers,
           .help = "stress before the first step, xx yy zz xy yz xz",
           .unit = "Pa",
           .fallback = "[0, 0, 0, 0, 0, 0]"},
          {.key = "path",
           .kinds = list,
           .help = "segments, in order",
           .required = true,
           .section = path_section},
      }};
  return section;
}

}  // namespace lahar
