// Scenarios on meshes of Gmsh, whose groups are sets; by one process and by teams.
#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <tuple>

#include "io/scenario/scenario.h"
#include "tests/io/base/team_folder.h"
#include "tests/io/base/thread_team.h"
#include "tests/io/scenario/said.h"

using namespace lahar;
using namespace lahar::test;

namespace {

std::string mesh_file(const std::string& name) {
  std::ifstream in(LAHAR_SOURCE_DIR "/tests/io/mesh/gmsh/" + name + ".msh", std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  REQUIRE(!text.str().empty());
  return text.str();
}

std::string scenario(int dim, const std::string& mesh_keys = "", const std::string& more = "") {
  const std::string zeros = dim == 2 ? "[0, -9.81]" : "[0, 0, -9.81]";
  return R"({"mesh": {"mesh": "slope.msh")" + mesh_keys +
         R"(, "boundary_conditions": {"velocity_constraints": [
      {"nset": "floor", "dir": )" +
         std::to_string(dim - 1) + R"(, "velocity": 0},
      {"nset_id": 7, "dir": 0, "velocity": 0}]}},
  "particles": [{"generator": {"type": "gauss", "cset": "soil mass", "nparticles_per_dir": 2,
                               "material_id": 0}}],
  "materials": [{"id": 0, "type": "LinearElastic", "density": 1000, "youngs_modulus": 1e6,
                 "poisson_ratio": 0.3}],
  "external_loading_conditions": {"gravity": )" +
         zeros + R"(},
  "analysis": {"type": "MPMExplicit)" +
         std::to_string(dim) + R"(D", "dt": 0.001, "nsteps": 1})" + more + "}";
}

using Entry = std::tuple<Index, int, double>;  // node, direction, velocity

template <int Dim>
std::vector<Entry> velocities(const Model<Dim>& model) {
  std::vector<Entry> entries;
  for (const NodeVelocity& v : entries_of<NodeVelocity>(model))
    entries.emplace_back(v.node, v.dir, v.velocity);
  return entries;
}

template <int Dim>
void check_teams(const std::string& name, std::size_t particles) {
  CAPTURE(name);
  const Folder folder;
  folder.write("slope.msh", mesh_file(name));
  folder.write("case.json", scenario(Dim));
  const auto whole = std::get<Model<Dim>>(read_scenario(folder.path / "case.json").model);
  CHECK(whole.particles.x.size() == particles);
  auto expected = velocities(whole);
  CHECK(expected.size() > 3);
  std::sort(expected.begin(), expected.end());
  for (const int size : {2, 3, 5}) {
    std::vector<Model<Dim>> parts(static_cast<std::size_t>(size));
    run_team(size, [&](const Team& team) {
      parts[static_cast<std::size_t>(team.index())] =
          std::get<Model<Dim>>(read_scenario(folder.path / "case.json", {{}, false, &team}).model);
    });
    std::vector<Entry> found;
    std::vector<Vec<Dim>> x(particles);
    std::size_t n = 0;
    for (const auto& part : parts) {
      const auto own = velocities(part);
      found.insert(found.end(), own.begin(), own.end());
      for (std::size_t i = 0; i < part.particles.x.size(); ++i, ++n)
        x[static_cast<std::size_t>(part.particles.id[i])] = part.particles.x[i];
      for (Index cell = 0; cell < whole.mesh->n_cells(); ++cell)
        if (part.mesh->holds(cell))
          CHECK(
              std::ranges::equal(part.mesh->element_nodes(cell), whole.mesh->element_nodes(cell)));
    }
    std::sort(found.begin(), found.end());
    CHECK(found == expected);
    CHECK(n == particles);
    CHECK(x == whole.particles.x);
  }
}

/// What is said of a case, by one process and by a team alike.
std::string said_of(const std::string& mesh, const std::string& text) {
  const Folder folder;
  folder.write("slope.msh", mesh);
  folder.write("case.json", text);
  folder.write("sets.json", R"({"node_sets": [{"id": 7, "set": [0]}]})");
  std::vector<std::string> said(3);
  const auto read = [&](const Team& team) {
    std::string& own = said[static_cast<std::size_t>(team.index())];
    try {
      const auto scenario = read_scenario(folder.path / "case.json", {{}, false, &team});
      own = format_problems(scenario.warnings, "warning");
    } catch (const InputError& error) {
      for (const Problem& p : error.problems())
        own += p.message + (p.hint.empty() ? "" : " (" + p.hint + ")") + "\n";
    }
  };
  run_team(3, read);
  for (const std::string& text : said) CHECK(text == said[0]);
  said[0] = "";
  std::string by_team = said[1];
  read(Team());
  CHECK(said[0] == by_team);
  return said[0];
}

}  // namespace

TEST_CASE("groups of Gmsh meshes are sets of nodes and cells, the same for teams") {
  check_teams<2>("t3-22a", 16 * 3);
  check_teams<2>("q4-41a", 8 * 4);
  check_teams<3>("h8-22b", 16 * 8);
}

TEST_CASE("the element of a Gmsh mesh is the file's") {
  const std::string mesh = mesh_file("t3-41b");
  CHECK(said_of(mesh, scenario(2, R"(, "cell_type": "ED2T3")")) == "");
  CHECK(said_of(mesh, scenario(2, R"(, "cell_type": "ED2Q4")")) ==
        "the cells of the mesh file are ED2T3 (leave 'cell_type' out: the file says of which "
        "element cells are)\n");
  const Folder folder;
  folder.write("slope.msh", mesh);
  const auto read = read_scenario_text(scenario(2), folder.path);
  CHECK(says(read.full, "\"cell_type\": \"ED2T3\""));
}

TEST_CASE("a VTU mesh that takes more memory than there is is refused before it is read") {
  const Folder folder;
  folder.write("slope.msh", R"(<VTKFile type="UnstructuredGrid"><UnstructuredGrid>
<Piece NumberOfPoints="150000" NumberOfCells="100000"></Piece></UnstructuredGrid></VTKFile>
)");
  folder.write("case.json", scenario(2));
  ScenarioOptions options;
  options.memory = {20e6, "there are 20 MB"};
  std::string said;
  try {
    read_scenario(folder.path / "case.json", options);
  } catch (const InputError& error) {
    said = format_problems(error.problems());
  }
  CHECK(says(said, "MiB of memory are needed for reading 'slope.msh'; there are 20 MB"));
}

TEST_CASE("mistakes in sets and cells of Gmsh meshes are said by all members of a team") {
  const std::string mesh = mesh_file("t3-22a");
  CHECK(said_of(mesh, scenario(2, R"(, "entity_sets": "sets.json")")) ==
        "the node set 7 is both a group of the mesh file and in 'entity_sets' (give the group a "
        "name)\n");
  const std::string sets = R"(, "sets": {"nodes": {"floor": {"box": {"min": [0, 0],
                                                                   "max": [1, 1]}}}})";
  CHECK(said_of(mesh, scenario(2, "", sets)) ==
        "the mesh file has a node set 'floor', too (give one of them another name)\n");
  std::string text = scenario(2);
  text.replace(text.find("floor"), 5, "flour");
  CHECK(said_of(mesh, text) == "there is no node set named 'flour' (did you mean 'floor'?)\n");
  std::string folded = mesh;
  folded.replace(folded.find("13 0.50"), 4, "13 9");
  CHECK(says(said_of(folded, scenario(2)), "the mesh is folded: cells "));
  CHECK(says(said_of(mesh.substr(0, 700), scenario(2)), "promises 27 elements, but ends after"));
}
