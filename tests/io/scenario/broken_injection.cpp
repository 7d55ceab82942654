// What is wrong with generators that inject particles, and with runs that are to be resumed.
#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

namespace {

/// Cells that are fed, instead of particles from a file; no set speaks of those any more.
std::vector<Edit> inject(const std::string& keys, const std::string& cell_set = "[0]") {
  return {replace("mpm.json", R"({"type": "file", "location": "particles.txt", "material_id": 0})",
                  R"({"type": "inject", )" + keys + "}"),
          write("sets.json", R"({"node_sets": [{"id": 0, "set": [0, 1, 2]}],
                                 "cell_sets": [{"id": 7, "set": )" +
                                 cell_set + "}]}")};
}

const char* const free_body =
    "\"rigid_bodies\": [{\"region\": {\"sphere\": {\"centre\": [1.5, 1.5], \"radius\": 0.25}},"
    " \"density\": 1000}],\n  \"particles\": [";

Edit resume(const std::string& keys, const std::string& more = "") {
  return replace("mpm.json", "\"dt\"", "\"resume\": {" + keys + "}, " + more + "\"dt\"");
}

}  // namespace

TEST_CASE("injection that cannot be is refused with what to do") {
  // clang-format off
  const std::vector<Entry> table{
    {"all is well",
     inject(R"("cset_id": -1, "nparticles_per_dir": 2, "velocity": [0, 1], "duration": [0, 1], "material_id": 0)"),
     {},
     R"(accepted
)"},
    {"velocity of another dimension",
     inject(R"("cset_id": -1, "nparticles_per_dir": 2, "velocity": [0, 1, 0], "material_id": 0)"),
     {},
     R"(mpm.json:12:90: error: 'velocity' must be an array of numbers (2) [m/s], found array [0, 1, 0] [/particles/0/generator/velocity]
  erator": {"type": "inject", "cset_id": -1, "nparticles_per_dir": 2, "velocity": [0, 1, 0], "material_id": 0}}
                                                                                  ^
  hint: the case has two dimensions: [x, y]
)"},
    {"an end before the start",
     inject(R"("cset_id": -1, "nparticles_per_dir": 2, "duration": [2, 1], "material_id": 0)"),
     {},
     R"(mpm.json:12:90: error: 'duration' must be [start, end] with start < end, found [2, 1] [/particles/0/generator/duration]
  erator": {"type": "inject", "cset_id": -1, "nparticles_per_dir": 2, "duration": [2, 1], "material_id": 0}}
                                                                                  ^
  hint: particles come in steps that begin at start <= t < end [s]
)"},
    {"three times",
     inject(R"("cset_id": -1, "nparticles_per_dir": 2, "duration": [0, 1, 2], "material_id": 0)"),
     {},
     R"(mpm.json:12:90: error: 'duration' must be [start, end] with start < end, found [0, 1, 2] [/particles/0/generator/duration]
  erator": {"type": "inject", "cset_id": -1, "nparticles_per_dir": 2, "duration": [0, 1, 2], "material_id": 0}}
                                                                                  ^
  hint: particles come in steps that begin at start <= t < end [s]
)"},
    {"missing keys",
     inject(R"("cset_id": -1)"),
     {},
     R"(mpm.json:12:19: error: 'nparticles_per_dir' is missing in a generator [/particles/0/generator]
      {"generator": {"type": "inject", "cset_id": -1}}
                    ^
  hint: nparticles_per_dir: Gauss points per direction: 1 to 4, in triangles and tetrahedra 1 (one point) or 2 (a point per corner), in the order of CB-Geo MPM
mpm.json:12:19: error: 'material' is missing [/particles/0/generator]
      {"generator": {"type": "inject", "cset_id": -1}}
                    ^
  hint: material: an id or a name of materials[]
)"},
    {"an unknown set, too many points",
     inject(R"("cset_id": 8, "nparticles_per_dir": 5, "material_id": 0)"),
     {},
     R"(mpm.json:12:49: error: there is no cell set 8 [/particles/0/generator/cset_id]
      {"generator": {"type": "inject", "cset_id": 8, "nparticles_per_dir": 5, "material_id": 0}}
                                                  ^
  hint: cell sets: 7
mpm.json:12:74: error: 'nparticles_per_dir' must be at least 1 and at most 4, found 5 [/particles/0/generator/nparticles_per_dir]
      {"generator": {"type": "inject", "cset_id": 8, "nparticles_per_dir": 5, "material_id": 0}}
                                                                           ^
)"},
    {"an empty set",
     inject(R"("cset_id": 7, "nparticles_per_dir": 1, "material_id": 0)", "[]"),
     {},
     R"(mpm.json:12:19: error: there is no cell to inject particles into [/particles/0/generator]
      {"generator": {"type": "inject", "cset_id": 7, "nparticles_per_dir": 1, "material_id": 0}}
                    ^
)"},
    {"a set of particles that do not exist yet",
     inject(R"("cset_id": -1, "nparticles_per_dir": 1, "pset_id": 3, "material_id": 0)"),
     {},
     R"(accepted
mpm.json:12:89: warning: injected particles are in no particle set [/particles/0/generator/pset_id]
  nerator": {"type": "inject", "cset_id": -1, "nparticles_per_dir": 1, "pset_id": 3, "material_id": 0}}
                                                                                  ^
  hint: loads and constraints of all particles (-1) act on them; leave the key out
)"},
    {"a duration of particles that are there from the start",
     {replace("mpm.json", "\"type\": \"file\"", "\"type\": \"file\", \"duration\": [0, 1]")},
     {},
     R"(mpm.json:12:36: error: 'duration' does not apply to a generator of type "file" [/particles/0/generator/duration]
      {"generator": {"type": "file", "duration": [0, 1], "location": "particles.txt", "material_id": 0}}
                                     ^
  hint: it belongs to "inject"
)"},
  };
  // clang-format on
  check(table, 9);
}

TEST_CASE("a run that cannot be resumed says why") {
  // clang-format off
  const std::vector<Entry> table{
    {"not wanted",
     {resume(R"("resume": false, "uuid": "x", "step": 5)")},
     {},
     R"(accepted
)"},
    {"no file",
     {resume(R"("resume": true, "uuid": "x", "step": 5)")},
     {},
     R"(mpm.json:19:51: error: there is no particle file of step 5 in results/x [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true, "uuid": "x", "step": 5}, "dt": 0.001, "nsteps": 10},
                                                    ^
  hint: CB-Geo MPM writes particlesNNN.h5 to post_processing.path / uuid
)"},
    {"neither run nor step",
     {resume(R"("resume": true)")},
     {},
     R"(mpm.json:19:51: error: 'uuid' is missing in analysis.resume [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true}, "dt": 0.001, "nsteps": 10},
                                                    ^
  hint: uuid: the run to go on from; step: that of its particle file
mpm.json:19:51: error: 'step' is missing in analysis.resume [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true}, "dt": 0.001, "nsteps": 10},
                                                    ^
  hint: uuid: the run to go on from; step: that of its particle file
)"},
    {"corners that a particle file does not have",
     {resume(R"("resume": true, "uuid": "x", "step": 5)", R"("shape_functions": "cpdi2", )")},
     {},
     R"(mpm.json:19:51: error: a run with "cpdi2" cannot be resumed from a particle file [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true, "uuid": "x", "step": 5}, "shape_functions": "cpdi2", "dt": 0.001, "nsteps": 10},
                                                    ^
  hint: the file does not have the corners of the particles' domains; go on from a checkpoint (--restart), or take "cpdi", whose domains begin anew as boxes
)"},
    {"free bodies that a particle file does not have",
     {resume(R"("resume": true, "uuid": "x", "step": 5)"),
      replace("mpm.json", "\"particles\": [", free_body)},
     {},
     R"(mpm.json:20:51: error: a run with free rigid bodies cannot be resumed from a particle file [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true, "uuid": "x", "step": 5}, "dt": 0.001, "nsteps": 10},
                                                    ^
  hint: the file does not have where bodies are and how they move; leave out "resume", and go on from a checkpoint of that run: lahar run ... --restart latest
)"},
    {"not an HDF5 file",
     {resume(R"("resume": true, "uuid": ".", "step": 5)"),
      replace("mpm.json", "\"output_steps\"", "\"path\": \".\", \"output_steps\""),
      write("particles05.h5", "text")},
     {},
     R"(particles05.h5: error: this is not an HDF5 file
)"},
    {"another step",
     {resume(R"("resume": true, "uuid": ".", "step": 7)"),
      replace("mpm.json", "\"output_steps\"", "\"path\": \".\", \"output_steps\""),
      write("particles05.h5", "text"), write("particles-0_2-07.h5", "text")},
     {},
     R"(mpm.json:19:51: error: there is no particle file of step 7 in  [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true, "uuid": ".", "step": 7}, "dt": 0.001, "nsteps": 10},
                                                    ^
  hint: of a parallel run the files of all ranks are needed
)"},
    {"a step that was not written",
     {resume(R"("resume": true, "uuid": ".", "step": 6)"),
      replace("mpm.json", "\"output_steps\"", "\"path\": \".\", \"output_steps\""),
      write("particles05.h5", "text")},
     {},
     R"(mpm.json:19:51: error: there is no particle file of step 6 in  [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true, "uuid": ".", "step": 6}, "dt": 0.001, "nsteps": 10},
                                                    ^
  hint: there are those of steps 5
)"},
    {"the end comes before",
     {resume(R"("resume": true, "uuid": ".", "step": 10)")},
     {},
     R"(mpm.json:19:51: error: the run ends with step 10, but is to go on from step 11 [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true, "uuid": ".", "step": 10}, "dt": 0.001, "nsteps": 10},
                                                    ^
  hint: raise nsteps: it counts the steps before as well
)"},
    {"the end comes before, by time",
     {resume(R"("resume": true, "uuid": ".", "step": 10)"),
      replace("mpm.json", "\"nsteps\": 10", "\"end_time\": 0.01")},
     {},
     R"(mpm.json:19:51: error: the run ends with step 10, but is to go on from step 11 [/analysis/resume]
    "analysis": {"type": "MPMExplicit2D", "resume": {"resume": true, "uuid": ".", "step": 10}, "dt": 0.001, "end_time": 0.01},
                                                    ^
  hint: raise end_time: with a fixed dt it counts the time before, steps times dt, as well; or leave dt out
)"},
  };
  // clang-format on
  check(table, 10);
}
