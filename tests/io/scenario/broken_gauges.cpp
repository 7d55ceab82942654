#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

namespace {

/// More of post_processing.
Edit measured(const std::string& text) {
  return replace("mpm.json", "\"output_steps\"", text + ",\n    \"output_steps\"");
}

}  // namespace

// clang-format off
TEST_CASE("gauges and maps that cannot be measured are refused with what is allowed") {
  const std::vector<Entry> table = {
    {"gauges without a name, of an unknown type, and without a place",
     {measured(R"("gauges": [
      {"type": "point", "at": [0.5, 0.5], "fields": ["velocity"]},
      {"name": "a", "type": "points"},
      {"name": "b", "type": "point", "fields": ["velocity"]},
      {"name": "c", "type": "point", "at": [0.5, 0.5]}])")},
     {},
     R"(mpm.json:21:7: error: 'name' is missing in a gauge [/post_processing/gauges/0]
        {"type": "point", "at": [0.5, 0.5], "fields": ["velocity"]},
        ^
  hint: name: name of its table
mpm.json:22:29: error: 'type' must be one of "point", "line", "column", "section", "front", "plane", "particles", "track", "force", found "points" [/post_processing/gauges/1/type]
        {"name": "a", "type": "points"},
                              ^
  hint: did you mean "point"?
mpm.json:23:7: error: 'at' is missing in a gauge [/post_processing/gauges/2]
        {"name": "b", "type": "point", "fields": ["velocity"]},
        ^
  hint: at [m]: the place
mpm.json:24:7: error: 'fields' is missing in a gauge [/post_processing/gauges/3]
        {"name": "c", "type": "point", "at": [0.5, 0.5]}],
        ^
  hint: fields: columns, state variables or derived fields, as frames name them
)"},
    {"fields that particles do not have",
     {measured(R"("gauges": [
      {"name": "a", "type": "point", "at": [0.5, 0.5], "fields": ["velocty"]},
      {"name": "b", "type": "point", "at": [0.5, 0.5], "fields": []}],
    "frame_fields": ["speeds"])")},
     {},
     R"(mpm.json:21:67: error: particles have no field "velocty" [/post_processing/gauges/0/fields/0]
        {"name": "a", "type": "point", "at": [0.5, 0.5], "fields": ["velocty"]},
                                                                    ^
  hint: did you mean 'velocity'?
mpm.json:22:66: error: no field is named [/post_processing/gauges/1/fields]
        {"name": "b", "type": "point", "at": [0.5, 0.5], "fields": []}],
                                                                   ^
  hint: fields: coordinates, velocity, displacement, stress, strain, volume, mass, domain, domain_vectors, domain_corners, opening, liquid_velocity, pore_pressure, acceleration, contact_force, contact_liquid, speed, kinetic_energy, mass_density, mean_stress, von_mises_stress, deviatoric_stress, volumetric_strain, equivalent_strain, porosity, liquid_mass, total_mean_stress, principal_stress_1, principal_stress_2, principal_stress_3, deviatoric_strain
mpm.json:23:22: error: particles have no field "speeds" [/post_processing/frame_fields/0]
      "frame_fields": ["speeds"],
                       ^
  hint: did you mean 'speed'?
)"},
    {"names that are no names of files, or taken",
     {measured(R"("gauges": [
      {"name": "a/b", "type": "particles"},
      {"name": "c", "type": "particles"},
      {"name": "c", "type": "front", "direction": [1, 0]}])")},
     {},
     R"(mpm.json:21:16: error: 'name' must be the name of a file, found "a/b" [/post_processing/gauges/0/name]
        {"name": "a/b", "type": "particles"},
                 ^
  hint: its table is gauges/NAME.csv in the run folder
mpm.json:23:16: error: there are two gauges "c" [/post_processing/gauges/2/name]
        {"name": "c", "type": "front", "direction": [1, 0]}],
                 ^
  hint: their tables need different names
)"},
    {"places and directions that are none",
     {measured(R"("gauges": [
      {"name": "a", "type": "column", "at": [0.5, 0.5]},
      {"name": "b", "type": "front", "direction": [0, 0]},
      {"name": "c", "type": "plane", "at": [0.5], "normal": [1, 0]},
      {"name": "d", "type": "line", "from": [0, 0], "to": [1, 1], "places": 1, "fields": ["velocity"]}])")},
     {},
     R"(mpm.json:21:45: error: 'at' is a place in plan, [x]; found 2 numbers [/post_processing/gauges/0/at]
        {"name": "a", "type": "column", "at": [0.5, 0.5]},
                                              ^
mpm.json:22:51: error: 'direction' has no length [/post_processing/gauges/1/direction]
        {"name": "b", "type": "front", "direction": [0, 0]},
                                                    ^
mpm.json:23:44: error: 'at' must be an array of numbers (2) [m], found array [0.5] [/post_processing/gauges/2/at]
        {"name": "c", "type": "plane", "at": [0.5], "normal": [1, 0]},
                                             ^
mpm.json:24:77: error: 'places' must be at least 2 and at most 1000, found 1 [/post_processing/gauges/3/places]
        {"name": "d", "type": "line", "from": [0, 0], "to": [1, 1], "places": 1, "fields": ["velocity"]}],
                                                                              ^
)"},
    {"sets and materials that do not exist, and keys of other gauges",
     {measured(R"("gauges": [
      {"name": "a", "type": "track", "pset": 7},
      {"name": "b", "type": "particles", "material": 4},
      {"name": "c", "type": "particles", "direction": [1, 0]}])")},
     {},
     R"(mpm.json:21:46: error: there is no particle set 7 [/post_processing/gauges/0/pset]
        {"name": "a", "type": "track", "pset": 7},
                                               ^
  hint: particle sets: 3
mpm.json:22:54: error: there is no material with the id 4 [/post_processing/gauges/1/material]
        {"name": "b", "type": "particles", "material": 4},
                                                       ^
  hint: ids: 0
mpm.json:23:42: error: 'direction' does not apply to a gauge of type "particles" [/post_processing/gauges/2/direction]
        {"name": "c", "type": "particles", "direction": [1, 0]}],
                                           ^
  hint: it belongs to "front"
)"},
    {"forces on nothing, on two things, and on what does not exist",
     {measured(R"("gauges": [
      {"name": "a", "type": "force"},
      {"name": "b", "type": "force", "nset": 0, "rigid_body": "post"},
      {"name": "c", "type": "force", "rigid_body": "post"},
      {"name": "d", "type": "force", "nset": 9}])")},
     {},
     R"(mpm.json:21:7: error: a gauge of forces needs 'nset' or 'rigid_body', one of them [/post_processing/gauges/0]
        {"name": "a", "type": "force"},
        ^
  hint: "nset": a set of nodes that are held; "rigid_body": the name of a body
mpm.json:22:7: error: a gauge of forces needs 'nset' or 'rigid_body', one of them [/post_processing/gauges/1]
        {"name": "b", "type": "force", "nset": 0, "rigid_body": "post"},
        ^
  hint: "nset": a set of nodes that are held; "rigid_body": the name of a body
mpm.json:23:52: error: no rigid body has the name "post" [/post_processing/gauges/2/rigid_body]
        {"name": "c", "type": "force", "rigid_body": "post"},
                                                     ^
  hint: there are no rigid bodies
mpm.json:24:46: error: there is no node set 9 [/post_processing/gauges/3/nset]
        {"name": "d", "type": "force", "nset": 9}],
                                               ^
  hint: node sets: 0
)"},
    {"frames of sets that do not exist or are empty, and fields that nodes do not have",
     {measured(R"("frame_pset": 4,
    "node_fields": ["velocity", "speed", "velocity"])")},
     {},
     R"(mpm.json:20:37: error: there is no particle set 4 [/post_processing/frame_pset]
    "post_processing": {"frame_pset": 4,
                                      ^
  hint: particle sets: 3
mpm.json:21:33: error: nodes have no field "speed" [/post_processing/node_fields/1]
      "node_fields": ["velocity", "speed", "velocity"],
                                  ^
  hint: fields: mass, velocity, acceleration
mpm.json:21:42: error: "velocity" is named twice [/post_processing/node_fields/2]
      "node_fields": ["velocity", "speed", "velocity"],
                                           ^
)"},
    {"frames of an empty set",
     {measured(R"("frame_pset": "none")"),
      replace("mpm.json", "\"materials\"", "\"sets\": {\"particles\": {\"none\": {\"box\": {\"min\": [5, 5], \"max\": [6, 6]}}}},\n  \"materials\"")},
     {},
     R"(mpm.json:21:37: error: the particle set "none" is empty: frames would have no particles [/post_processing/frame_pset]
    "post_processing": {"frame_pset": "none",
                                      ^
  hint: leave 'frame_pset' out: frames then have all particles
)"},
    {"frames of what is no set",
     {measured(R"("frame_pset": -2)")},
     {},
     R"(mpm.json:20:37: error: 'frame_pset' must be at least -1, found -2 [/post_processing/frame_pset]
    "post_processing": {"frame_pset": -2,
                                      ^
)"},
    {"maps in two dimensions, and two intervals",
     {measured(R"("maps": {"cell_size": 0},
    "gauge_steps": 5,
    "gauge_dt": 0.1)")},
     {},
     R"(mpm.json:20:31: error: 'maps' need three dimensions [/post_processing/maps]
    "post_processing": {"maps": {"cell_size": 0},
                                ^
  hint: a gauge of "type": "section" has the thickness along a line
mpm.json:20:45: error: 'cell_size' must be greater than 0 [m], found 0 [/post_processing/maps/cell_size]
    "post_processing": {"maps": {"cell_size": 0},
                                              ^
mpm.json:22:17: error: 'gauge_steps' and 'gauge_dt' both say when rows come [/post_processing/gauge_dt]
      "gauge_dt": 0.1,
                  ^
  hint: leave one of them out
)"},
  };
  check(table, 10);
}
