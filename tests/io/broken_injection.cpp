// What is wrong with generators that inject particles, and with runs that are to be resumed.
#include <doctest/doctest.h>

#include "broken_case.h"

using namespace lahar::broken;

namespace {

Edit inject(const std::string& keys) {
  return replace("mpm.json",
                 R"({"type": "file", "location": "particles.txt", "material_id": 0})",
                 R"({"type": "inject", )" + keys + "}");
}

Edit resume(const std::string& keys, const std::string& more = "") {
  return replace("mpm.json", "\"dt\"", "\"resume\": {" + keys + "}, " + more + "\"dt\"");
}

}  // namespace

TEST_CASE("injection that cannot be is refused with what to do") {
  // clang-format off
  const std::vector<Entry> table{
    {"all is well",
     {inject(R"("cset_id": -1, "nparticles_per_dir": 2, "velocity": [0, 1], "duration": [0, 1], "material_id": 0)")},
     {},
     R"(accepted
)"},
    {"velocity of another dimension",
     {inject(R"("cset_id": -1, "nparticles_per_dir": 2, "velocity": [0, 1, 0], "material_id": 0)")},
     {},
     R"(?)"},
    {"an end before the start",
     {inject(R"("cset_id": -1, "nparticles_per_dir": 2, "duration": [2, 1], "material_id": 0)")},
     {},
     R"(?)"},
    {"three times",
     {inject(R"("cset_id": -1, "nparticles_per_dir": 2, "duration": [0, 1, 2], "material_id": 0)")},
     {},
     R"(?)"},
    {"missing keys",
     {inject(R"("cset_id": -1)")},
     {},
     R"(?)"},
    {"an unknown set, too many points",
     {inject(R"("cset_id": 7, "nparticles_per_dir": 5, "material_id": 0)")},
     {},
     R"(?)"},
    {"an empty set",
     {inject(R"("cset_id": 7, "nparticles_per_dir": 1, "material_id": 0)"),
      write("sets.json", R"({"node_sets": [{"id": 0, "set": [0, 1, 2]}], "cell_sets": [{"id": 7, "set": []}]})")},
     {},
     R"(?)"},
    {"a set of particles that do not exist yet",
     {inject(R"("cset_id": -1, "nparticles_per_dir": 1, "pset_id": 3, "material_id": 0)")},
     {},
     R"(?)"},
    {"a duration of particles that are there from the start",
     {replace("mpm.json", "\"type\": \"file\"", "\"type\": \"file\", \"duration\": [0, 1]")},
     {},
     R"(?)"},
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
     R"(?)"},
    {"missing keys",
     {resume(R"("resume": true)")},
     {},
     R"(?)"},
    {"adaptive steps",
     {resume(R"("resume": true, "uuid": "x", "step": 5)", R"("time_step": {"adaptive": true}, )")},
     {},
     R"(?)"},
    {"not an HDF5 file",
     {resume(R"("resume": true, "uuid": ".", "step": 5)"),
      replace("mpm.json", "\"output_steps\"", "\"path\": \".\", \"output_steps\""),
      write("particles05.h5", "text")},
     {},
     R"(?)"},
    {"another step",
     {resume(R"("resume": true, "uuid": ".", "step": 7)"),
      replace("mpm.json", "\"output_steps\"", "\"path\": \".\", \"output_steps\""),
      write("particles05.h5", "text"), write("particles-0_2-07.h5", "text")},
     {},
     R"(?)"},
    {"the end comes before",
     {resume(R"("resume": true, "uuid": ".", "step": 10)")},
     {},
     R"(?)"},
  };
  // clang-format on
  check(table, 7);
}
