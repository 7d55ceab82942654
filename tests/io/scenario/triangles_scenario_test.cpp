// Scenarios with solids and surfaces of triangles.
#include <doctest/doctest.h>

#include "io/scenario/scenario.h"
#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"

using namespace lahar;

namespace {

const std::string cube =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n"
    "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
const std::string ramp = "v 0 0 1\nv 8 0 5\nv 0 8 1\nv 8 8 5\nf 1 2 4\nf 1 4 3\n";

std::string scenario(const std::string& geometry, const std::string& region) {
  return R"({"mesh": {"structured": {"cell_size": 1, "counts": [8, 8, 8]}},
  "geometry": )" +
         geometry + R"(,
  "particles": [{"generator": {"type": "region", "region": )" +
         region +
         R"(, "per_cell": 2, "cut_cells": "centres", "material_id": 0}}],
  "materials": [{"id": 0, "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                 "poisson_ratio": 0.3}],
  "analysis": {"type": "MPMExplicit3D", "dt": 0.001, "nsteps": 1}})";
}

class Files {
 public:
  Files() {
    folder_.write("cube.obj", cube);
    folder_.write("ramp.obj", ramp);
  }
  void write(const std::string& name, const std::string& text) { folder_.write(name, text); }
  std::vector<Vec<3>> particles(const std::string& geometry, const std::string& region) const {
    return std::get<Model<3>>(read_scenario_text(scenario(geometry, region), folder_.path).model)
        .particles.x;
  }
  /// The problems, or else the warnings, as "file: message (hint)".
  std::string said(const std::string& text) const {
    std::string out;
    const auto say = [&](const std::vector<Problem>& problems) {
      for (const Problem& p : problems)
        out += p.file + ": " + p.message + (p.hint.empty() ? "" : " (" + p.hint + ")") + "\n";
    };
    try {
      say(read_scenario_text(text, folder_.path).warnings);
    } catch (const InputError& error) {
      say(error.problems());
    }
    return out;
  }

 private:
  Folder folder_;
};

}  // namespace

TEST_CASE("particles fill a solid of triangles as they fill the same box") {
  const Files files;
  const auto inside =
      files.particles(R"({"wall": {"solid": "cube.obj", "scale": 3, "offset": [2, 1, 0.5]}})",
                      R"({"inside": "wall"})");
  const auto box = files.particles(R"({"wall": {"solid": "cube.obj"}})",
                                   R"({"box": {"min": [2, 1, 0.5], "max": [5, 4, 3.5]}})");
  CHECK(box.size() == 6 * 6 * 6);
  CHECK(inside == box);
}

TEST_CASE("particles lie below a surface of triangles") {
  const Files files;
  const auto below =
      files.particles(R"({"ground": {"triangles": "ramp.obj"}})", R"({"below": "ground"})");
  CHECK(below.size() > 1000);
  for (const auto& x : below) CHECK(x.z() <= 1 + 0.5 * x.x() + 1e-5);
  const auto points =
      files.particles(R"({"ground": {"points": [[0, 0, 1], [8, 0, 5], [0, 8, 1], [8, 8, 5]]}})",
                      R"({"below": "ground"})");
  CHECK(below == points);
}

TEST_CASE("members of a team that read a solid have the particles of one process") {
  const Folder folder;
  folder.write("cube.obj", cube);
  const std::string text =
      scenario(R"({"wall": {"solid": "cube.obj", "scale": 5, "offset": [1, 1, 1]}})",
               R"({"inside": "wall"})");
  const auto whole = std::get<Model<3>>(read_scenario_text(text, folder.path).model).particles.x;
  std::vector<std::vector<Vec<3>>> parts(3);
  run_team(3, [&](const Team& team) {
    const auto model =
        std::get<Model<3>>(read_scenario_text(text, folder.path, {{}, false, &team}).model);
    parts[static_cast<std::size_t>(team.index())] = model.particles.x;
  });
  CHECK(whole.size() == parts[0].size() + parts[1].size() + parts[2].size());
}

TEST_CASE("solids and surfaces of triangles that cannot be used are refused") {
  Files files;
  files.write("open.obj", cube.substr(0, cube.rfind("f 2")));
  files.write("two.obj", cube +  // another cube passes through the first
                             "v .75 .5 .5\nv 2 .5 .5\nv .75 2 .5\nv 2 2 .5\nv .75 .5 2\nv 2 .5 2\n"
                             "v .75 2 2\nv 2 2 2\nf 9 11 12 10\nf 13 14 16 15\nf 9 10 14 13\n"
                             "f 11 15 16 12\nf 9 13 15 11\nf 10 12 16 14\n");
  files.write("over.obj",
              "v 0 0 0\nv 4 0 0\nv 0 8 0\nv 4 8 0\nv 2 0 3\nv 2 8 3\n"
              "f 1 2 4\nf 1 4 3\nf 2 5 6\nf 2 6 4\n");
  files.write("cliff.obj",
              "v 0 0 0\nv 4 0 0\nv 0 8 0\nv 4 8 0\nv 4 0 3\nv 4 8 3\n"
              "f 1 2 4\nf 1 4 3\nf 2 5 6\nf 2 6 4\n");
  const std::string all = R"({"box": {"min": [0, 0, 0], "max": [8, 8, 8]}})";
  const auto said = [&](const std::string& geometry) {
    return files.said(scenario(geometry, all));
  };
  CHECK(said(R"({"wall": {"solid": "cube.obj", "scale": 4, "offset": [1, 1, 1]}})") == "");
  CHECK(said(R"({"wall": {"solid": "open.obj"}})") ==
        "open.obj: the surface is not closed: 4 edges belong to one triangle only (close the hole: "
        "4 edges around (1, 0.5, 0.5))\n");
  CHECK(
      said(R"({"wall": {"solid": "two.obj"}})") ==
      "two.obj: the surface passes through itself: 10 pairs of triangles cross, the first at "
      "(0.75, "
      "0.75, 1) (these two have their centres at (0.333333, 0.666667, 1) and (0.75, 1, 1.5); unite "
      "what overlaps in the program that made the surface)\n");
  CHECK(said(R"({"wall": {"solid": "none.obj"}})") ==
        "scenario: file 'none.obj' does not exist (file names are relative to the scenario's "
        "folder)\n");
  CHECK(said(R"({"ground": {"triangles": "over.obj"}})") ==
        "scenario: the surface has several heights at one place: 1 edges under or over which it "
        "turns back, the first at (4, 4, 0) (a surface has one height above each place; overhangs "
        "are solids)\n");
  CHECK(said(R"({"ground": {"triangles": "cliff.obj"}})") ==
        "scenario: the surface has several heights at one place: 2 vertical triangles, the first "
        "at (4, 2.66667, 2) (a surface has one height above each place; overhangs are solids)\n");
  CHECK(said(R"({"ground": {"points": [[0, 0, 1], [8, 0, 5], [0, 8, 1], [8, 8, 5]],
                            "scale": 2}})") == "scenario: 'scale' is for surfaces of triangles\n");
  CHECK(said(R"({"wall": {"solid": "cube.obj", "spacing": 2}})") ==
        "scenario: 'spacing' is for surfaces of triangles\n");
  CHECK(said(R"({"wall": {"solid": "cube.obj", "scale": 0}})") ==
        "scenario: 'scale' must be greater than 0, found 0\n");
  CHECK(said(R"({"wall": {"solid": "cube.obj", "offset": [1, 1, 20]}})") ==
        "scenario: the shape lies outside of the mesh: along z it reaches from 20 to 21 m, the "
        "mesh from 0 to 8 m (coordinates are in metres; 'scale' and 'offset' convert others)\n");
  CHECK(said(R"({"wall": {"solid": "cube.obj"}, "hill": {"surface": "wall", "lower_by": 1}})") ==
        "scenario: the geometry 'wall' is a solid, not a surface\n");
  const std::string flat =
      R"({"mesh": {"structured": {"cell_size": 1, "counts": [8, 8]}},
          "geometry": {"wall": {"solid": "cube.obj"}, "ground": {"triangles": "ramp.obj"}},
          "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 1}})";
  const std::string refused = files.said(flat);
  CHECK(refused.find("a solid of triangles is for 3D") != std::string::npos);
  CHECK(refused.find("a surface of triangles is for 3D") != std::string::npos);
}
