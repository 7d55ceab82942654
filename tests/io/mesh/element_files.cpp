// Meshes with groups from Gmsh and VTU files. Those in gmsh/ were written by Gmsh 4.8.4: a plate or
// block of 2 x 1 (x 1) m of every element, with the groups "floor" (y = 0, or z = 0), "floor and
// side" (2D: also x = 2), "soil mass" (all of it), and 7, without a name (the point (2, 1)).
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <zlib.h>

#include <cstring>
#include <fstream>
#include <sstream>

#include "io/mesh/element_file.h"
#include "physics/mesh/element_grid.h"
#include "physics/mesh/mesh.h"

using namespace lahar;

namespace {

SideFile file_of(const std::string& text) {
  return {"mesh", "mesh", static_cast<Index>(text.size()), text};
}

std::string gmsh_file(const std::string& name) {
  std::ifstream in(LAHAR_SOURCE_DIR "/tests/io/mesh/gmsh/" + name + ".msh", std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  REQUIRE(!text.str().empty());
  return text.str();
}

template <int Dim>
ElementMesh<Dim> read(const std::string& text, std::string* warnings = nullptr) {
  ProblemList problems;
  auto mesh = mesh_of<Dim>(read_element_file(file_of(text)), "mesh", problems);
  const std::string said = format_problems(problems.found_warnings().kept, "warning");
  if (warnings)
    *warnings = said;
  else
    CHECK(said == "");
  return mesh;
}

/// What is said of a broken file.
template <int Dim = 2>
std::string refusal(const std::string& text) {
  try {
    std::string warnings;
    read<Dim>(text, &warnings);
  } catch (const InputError& error) {
    return format_problems(error.problems());
  }
  return "accepted";
}

template <int Dim>
double volume_of(const ElementMesh<Dim>& mesh) {
  const auto checked = Mesh<Dim>::from_tables(mesh.nodes, mesh.element, mesh.cells, true);
  double volume = 0;
  for (Index cell = 0; cell < checked.n_cells(); ++cell) volume += checked.cell_volume(cell);
  return volume;
}

template <int Dim>
const typename ElementMesh<Dim>::Set& set_of(
    const std::vector<typename ElementMesh<Dim>::Set>& sets, const std::string& name) {
  const auto it =
      std::find_if(sets.begin(), sets.end(), [&](const auto& s) { return s.name == name; });
  REQUIRE(it != sets.end());
  return *it;
}

template <int Dim>
void check_plate(const std::string& name, Element element) {
  CAPTURE(name);
  const auto mesh = read<Dim>(gmsh_file(name));
  CHECK(mesh.element == element);
  CHECK(volume_of(mesh) == doctest::Approx(2));
  const auto n_cells = mesh.cells.size() / static_cast<std::size_t>(info(element).nodes);
  CHECK(set_of<Dim>(mesh.cell_sets, "soil mass").members.size() == n_cells);
  std::vector<Index> floor, corner;
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    const Vec<Dim>& x = mesh.nodes[i];
    if (std::abs(x[Dim - 1]) < 1e-9) floor.push_back(static_cast<Index>(i));
    if (Dim == 3 && x[2] != 0) continue;
    if ((x.template head<2>() - Vec<2>(2, 1)).norm() < 1e-9)
      corner.push_back(static_cast<Index>(i));
  }
  CHECK(set_of<Dim>(mesh.node_sets, "floor").members == floor);
  const auto& unnamed = set_of<Dim>(mesh.node_sets, "");
  CHECK(unnamed.id == 7);
  CHECK(unnamed.members == corner);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("Gmsh's own files of every element are read with their groups") {
  for (const char* name : {"t3-22a", "t3-22b", "t3-41a", "t3-41b"})
    check_plate<2>(name, Element::T3);
  check_plate<2>("t6-22b", Element::T6);
  check_plate<2>("q4-41a", Element::Q4);
  check_plate<2>("q8-41b", Element::Q8);
  check_plate<2>("q9-22b", Element::Q9);
  check_plate<3>("tet4-41a", Element::Tet4);
  check_plate<3>("h8-22b", Element::H8);
  check_plate<3>("h20-41b", Element::H20);
  check_plate<3>("h27-22a", Element::H27);
}

TEST_CASE("elements that Gmsh 2.2 lists once for each of their groups count once") {
  const auto mesh = read<2>(gmsh_file("t3-22a"));
  CHECK(mesh.cells.size() == 3 * 16);
  CHECK(set_of<2>(mesh.node_sets, "floor and side").members.size() == 7);
  // A cell in two groups.
  std::string text = replaced(gmsh_file("t3-22a"), "$Elements\n27\n", "$Elements\n28\n");
  text = replaced(text, "27 2 2 2 1 9 8 3\n", "27 2 2 2 1 9 8 3\n28 2 2 5 1 8 3 9\n");
  const auto twice = read<2>(text);
  CHECK(twice.cells.size() == 3 * 16);
  CHECK(twice.cell_sets.size() == 2);
  CHECK(set_of<2>(twice.cell_sets, "").members == std::vector<Index>{15});
}

TEST_CASE("nodes of no cell are left out, and numbers of nodes may have gaps in any order") {
  const std::string text =
      "$MeshFormat\r\n2.2 0 8\r\n$EndMeshFormat\r\n$Nodes\r\n5\r\n900 0 0 0\r\n7 1 0 0\r\n"
      "3000000 1 1 0\r\n8 5 5 5\r\n20 0 1 0\r\n$EndNodes\r\n$Elements\r\n2\r\n1 15 2 4 1 8\r\n"
      "9 3 2 3 1 900 7 3000000 20\r\n$EndElements\r\n";
  const auto mesh = read<2>(text);
  CHECK(mesh.nodes == std::vector<Vec<2>>{{1, 0}, {0, 1}, {0, 0}, {1, 1}});
  CHECK(mesh.cells == std::vector<Index>{2, 0, 3, 1});
  CHECK(set_of<2>(mesh.node_sets, "").members.empty());
}

TEST_CASE("cells that are turned over are mended, with a warning") {
  const std::string text = replaced(gmsh_file("t3-22a"), "27 2 2 2 1 9 8 3", "27 2 2 2 1 9 3 8");
  std::string warnings;
  const auto mesh = read<2>(text, &warnings);
  CHECK(volume_of(mesh) == doctest::Approx(2));
  CHECK(warnings ==
        "mesh: warning: 1 of 16 cells are turned over and have been mended, the first is cell 15\n"
        "  hint: corners have to be counter-clockwise; the surface faces downwards\n");
  // Of every element: all cells mirrored, by coordinates.
  for (const auto& [name, of] : {std::pair("t6-22b", 2), {"q9-22b", 2}, {"q8-41b", 2}}) {
    CAPTURE(name);
    auto tables = read_element_file(file_of(gmsh_file(name)));
    for (Vec<3>& x : tables.points) x[0] = -x[0];
    ProblemList problems;
    CHECK(volume_of(mesh_of<2>(std::move(tables), "mesh", problems)) == doctest::Approx(2));
    CHECK(problems.found_warnings().kept.size() == 1);
    static_cast<void>(of);
  }
  for (const char* name : {"tet4-41a", "h8-22b", "h20-41b", "h27-22a"}) {
    CAPTURE(name);
    auto tables = read_element_file(file_of(gmsh_file(name)));
    for (Vec<3>& x : tables.points) x[0] = -x[0];
    ProblemList problems;
    CHECK(volume_of(mesh_of<3>(std::move(tables), "mesh", problems)) == doctest::Approx(2));
    CHECK(problems.found_warnings().kept.size() == 1);
  }
}

// clang-format off
TEST_CASE("meshes that are folded are refused") {
  CHECK(refusal(replaced(gmsh_file("t3-22a"), "13 0.5000000000004514", "13 9.5"))
            .starts_with("mesh: error: the mesh is folded: cells "));
}

TEST_CASE("broken Gmsh files are refused with their place") {
  const std::string good = gmsh_file("t3-22a"), v4 = gmsh_file("t3-41a");
  CHECK(refusal(replaced(good, "2.2 0 8", "4 0 8")) ==
R"(mesh:2: error: version 4 of the format is not read
  4 0 8
  hint: save as version 4.1 or 2.2: gmsh -save -format msh41 FILE, or -format msh22
)");
  CHECK(refusal(replaced(good, "2.2 0 8", "2.2 0 4")) ==
R"(mesh:2: error: the size of numbers must be 8 bytes, found 4
  2.2 0 4
)");
  CHECK(refusal(good.substr(0, good.find("5 0.49"))) ==
R"(mesh:11: error: the file promises 15 nodes, but ends after 32 bytes more
  15
)");
  CHECK(refusal(good.substr(0, good.find("$Elements"))) ==
R"(mesh:27: error: the file ends before $Elements: it is cut short
  $EndNodes
)");
  CHECK(refusal(good.substr(0, good.find("8 3\n$EndElements"))) ==
R"(mesh:56: error: the file ends before a node of an element: it is cut short
  27 2 2 2 1 9 
)");
  CHECK(refusal(good.substr(0, good.find("$EndElements"))) ==
R"(mesh:56: error: the file ends before $EndElements: it is cut short
  27 2 2 2 1 9 8 3
)");
  CHECK(refusal(replaced(good, "2 2 0 0\n", "2 nan 0 0\n")) ==
R"(mesh:13: error: a coordinate must be a finite number
  2 nan 0 0
)");
  CHECK(refusal(replaced(good, "2 2 0 0\n", "2 two 0 0\n")) ==
R"(mesh:13: error: a coordinate must be a number, found 'two'
  2 two 0 0
)");
  CHECK(refusal(replaced(good, "2 2 0 0\n", "1 2 0 0\n")) ==
R"(mesh:26: error: node 1 occurs twice
  15 1.499999999999688 0.499999999999534 0
)");
  CHECK(refusal(replaced(good, "\n13 0.5000", "\n-13 0.5000")).starts_with(
R"(mesh:26: error: the number of a node must be positive, found -13)"));
  CHECK(refusal(replaced(good, "9 8 3\n", "9 8 30\n")).starts_with(
R"(mesh:56: error: an element has node 30, which does not exist)"));
  CHECK(refusal(replaced(good, "27 2 2 2 1 9 8 3", "27 92 2 2 1 9 8 3")).starts_with(
R"(mesh:56: error: elements of type 92 are not read)"));
  CHECK(refusal(replaced(good, "27 2 2 2 1 9 8 3", "27 3 2 2 1 9 8 3 4")) ==
R"(mesh: error: all cells have to be of one element, found 15 3-node triangles, 1 4-node quadrilaterals
  hint: let the generator recombine all of them, or none
)");
  CHECK(refusal<3>(good) ==
R"(mesh: error: the mesh has no cells of 3 dimensions: it has 1 points, 10 2-node lines, 16 3-node triangles
  hint: in Gmsh, put them into a physical group too: it saves nothing else once there are groups
)");
  CHECK(refusal<2>(gmsh_file("h8-22b")) ==
R"(mesh: error: the mesh is of three dimensions, and the case of two: it has 16 8-node hexahedra
)");
  CHECK(refusal<3>(gmsh_file("tet10-41a")).starts_with(
R"(mesh: error: there are no shape functions for )"));
  CHECK(refusal(replaced(good, "2 2 0 0\n", "2 2 0 0.5\n")) ==
R"(mesh: error: a mesh of a 2D case has to lie in the plane x, y; here z is from 0 to 0.5
)");
  CHECK(refusal(replaced(v4, "9 15 1 15", "9 14 1 15")) ==
R"(mesh:62: error: the file promises 14 nodes and has 15
  1.499999999999688 0.499999999999534 0
)");
  CHECK(refusal(replaced(v4, "$Entities", "$PartitionedEntities")) ==
R"(mesh:10: error: the mesh is partitioned
  $PartitionedEntities
  hint: save it without partitions; Lahar makes its own
)");
  CHECK(refusal(replaced(good, "1 8 \"floor and side\"", "1 8 floor")) ==
R"(mesh:7: error: expected a dimension, a number and a name in quotes, found '1 8 floor'
  1 8 floor
)");
}

TEST_CASE("entities of Gmsh files that are in very many physical groups are refused") {
  const std::string v4 = gmsh_file("t3-41a");
  std::string groups;
  for (int g = 0; g < 101; ++g) groups += fmt::format(" {}", g + 1);
  const std::string surface = "1 0 0 0 2 1 0 1 2";
  REQUIRE(v4.find(surface) != v4.npos);
  CHECK(refusal(replaced(v4, surface, "1 0 0 0 2 1 0 101" + groups)).find(
      "entity 1 of dimension 2 is in 101 physical groups; at most 100 are read") != std::string::npos);
}

TEST_CASE("binary Gmsh files cut short, with wild counts or in another byte order are refused") {
  for (const char* name : {"t3-22b", "t3-41b"}) {
    const std::string good = gmsh_file(name);
    for (std::size_t n = 60; n + 15 < good.size(); n += 13) {
      CAPTURE(n);
      CHECK(refusal(good.substr(0, n)).find("error: ") != std::string::npos);
    }
  }
  std::string turned = gmsh_file("t3-41b");
  const auto one = turned.find("4.1 1 8\n") + 8;
  std::swap(turned[one], turned[one + 3]);
  CHECK(refusal(turned) ==
R"(mesh: error: at byte 24: the file was written in another byte order
)");
  std::string wild = gmsh_file("t3-41b");
  const std::uint64_t many = 1ULL << 60;
  std::memcpy(wild.data() + wild.find("$Nodes\n") + 7 + 8, &many, sizeof many);
  CHECK(refusal(wild).find("the file promises 1152921504606846976 nodes, but ends after") !=
        std::string::npos);
}
// clang-format on
