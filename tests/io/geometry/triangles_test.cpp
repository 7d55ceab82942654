#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "io/geometry/triangles_check.h"
#include "io/geometry/triangles_file.h"

using namespace lahar;

namespace {

/// A file of this name with this text, which is kept in memory.
SideFile file_of(const std::string& name, const std::string& text) {
  return {name, name, static_cast<Index>(text.size()), text};
}

template <class T>
void append(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

const std::vector<std::array<float, 3>> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<std::array<int, 3>> faces{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

std::string stl_text() {
  std::string text = "solid wedge\r\n";
  for (const auto& face : faces) {
    text += "facet normal 0 0 0\n  OUTER loop\n";
    for (const int c : face) {
      text += "    vertex";
      for (const float x : corners[static_cast<std::size_t>(c)]) text += " " + std::to_string(x);
      text += "\n";
    }
    text += "  endloop\nendfacet\n";
  }
  return text + "endsolid wedge\n";
}

std::string stl_binary() {
  std::string bytes = "solid, although it is binary";
  bytes.resize(80, ' ');
  append(bytes, static_cast<std::uint32_t>(faces.size()));
  for (const auto& face : faces) {
    for (int d = 0; d < 3; ++d) append(bytes, 0.0F);
    for (const int c : face)
      for (const float x : corners[static_cast<std::size_t>(c)]) append(bytes, x);
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

const std::string obj_text = R"(# a wedge
mtllib none.mtl
o wedge
v 0 0 0
v 1 0 0 1.0
v 0 1 0
v 0 0 1
vn 0 0 1
usemtl stone
f 1 3 2
f 1/1 2/1 4/1
f -4//1 -1//1 -2//1
f 2/1/1 3/1/1 4/1/1
)";

std::string ply_head(const std::string& format) {
  return "ply\nformat " + format +
         " 1.0\ncomment a wedge\nelement vertex 4\nproperty float x\n"
         "property float y\nproperty float z\nproperty uchar red\nelement face 4\n"
         "property list uchar int vertex_indices\nelement edge 1\nproperty short "
         "from\nend_header\n";
}

std::string ply_text() {
  std::string text = ply_head("ascii");
  for (const auto& x : corners)
    text += std::to_string(x[0]) + " " + std::to_string(x[1]) + " " + std::to_string(x[2]) + " 7\n";
  for (const auto& f : faces)
    text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) +
            "\n";
  return text + "5\n";
}

std::string ply_binary() {
  std::string bytes = ply_head("binary_little_endian");
  for (const auto& corner : corners) {
    for (const float x : corner) append(bytes, x);
    append(bytes, std::uint8_t{7});
  }
  for (const auto& face : faces) {
    append(bytes, std::uint8_t{3});
    for (const int c : face) append(bytes, std::int32_t{c});
  }
  append(bytes, std::int16_t{5});
  return bytes;
}

/// What is said of a file, or "" where it is read.
std::string said_of(const std::string& name, const std::string& text) {
  ProblemList problems;
  const auto read = read_triangles(file_of(name, text), {}, problems);
  CHECK(read.has_value() == problems.empty());
  return format_problems(problems.errors(""));
}

/// What is said of a solid, warnings first.
std::string said_of_solid(const std::string& obj) {
  ProblemList problems;
  auto read = read_triangles(file_of("wall.obj", obj), {}, problems);
  const bool good = read && check_solid("wall.obj", *read, problems);
  CHECK(good == problems.empty());
  return format_problems(problems.found_warnings().kept, "warning") +
         format_problems(problems.errors(""));
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("the same body is read from STL, OBJ and PLY, as text and binary") {
  const std::vector<std::pair<std::string, std::string>> files{{"a.stl", stl_text()},
                                                               {"b.STL", stl_binary()},
                                                               {"c.obj", obj_text},
                                                               {"d.ply", ply_text()},
                                                               {"e.ply", ply_binary()}};
  for (const auto& [name, text] : files) {
    CAPTURE(name);
    ProblemList problems;
    auto read = read_triangles(file_of(name, text), {}, problems);
    REQUIRE(read);
    CHECK(problems.empty());
    CHECK(read->points.size() == 4);
    CHECK(read->corners.size() == 4);
    CHECK(enclosed_volume(*read) == doctest::Approx(1.0 / 6));
    CHECK(check_solid(name, *read, problems));
    CHECK(problems.found_warnings().kept.empty());
  }
}

TEST_CASE("triangles are scaled, then moved, and read from files in pieces") {
  const auto path = std::filesystem::temp_directory_path() / "lahar-triangles.obj";
  {
    std::ofstream out(path);
    for (int i = 0; i < 50000; ++i) out << "v " << i << " 0 0\nv 0 " << i + 1 << " 0\n";
    for (int i = 1; i < 50000; ++i)
      out << "f " << 2 * i - 1 << " " << 2 * i << " " << 2 * i + 1 << "\n";
  }
  std::string reason;
  const auto file = open_side_file("lahar-triangles.obj", path.string(), reason);
  REQUIRE(file);
  ProblemList problems;
  const auto read = read_triangles(*file, {.scale = 0.001, .offset = {10, 20, 30}}, problems);
  REQUIRE(read);
  CHECK(read->points.size() == 100000);
  CHECK(read->corners.size() == 49999);
  CHECK((read->points[3] - Vec<3>(10, 20.002, 30)).norm() < 1e-12);
  std::filesystem::remove(path);
}

TEST_CASE("convex polygons become triangles") {
  ProblemList problems;
  const std::string square = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 2 0\nv 0 1 0\n";
  const auto read = read_triangles(file_of("a.obj", square + "f 1 2 3 4 5\n"), {}, problems);
  REQUIRE(read);
  CHECK(read->corners.size() == 3);
  double area = 0;
  for (Index i = 0; i < 3; ++i) area += 0.5 * read->area_vector(i).z();
  CHECK(area == doctest::Approx(3));
}

// clang-format off
TEST_CASE("broken STL files are refused with their place") {
  CHECK(said_of("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 zero\n") ==
R"(a.stl:4:12: error: the z coordinate must be a finite number, found 'zero'
  vertex 0 0 zero
             ^
)");
  CHECK(said_of("a.stl", replaced(stl_text(), "vertex 1.0", "vertex nan")) ==
R"(a.stl:6:12: error: the x coordinate must be a finite number, found 'nan00000'
      vertex nan00000 0.000000 0.000000
             ^
)");
  CHECK(said_of("a.stl", replaced(stl_text(), "endloop", "vertex 1 1 1")) ==
R"(a.stl:7:3: error: expected 'endloop', found 'vertex'
    vertex 1 1 1
    ^
)");
  CHECK(said_of("a.stl", stl_text().substr(0, stl_text().find("  endloop"))) ==
R"(a.stl: error: the file ends before 'endloop': it is cut short
)");
  CHECK(said_of("a.stl", replaced(stl_text(), "endsolid wedge", "")) ==
R"(a.stl: error: the file ends before 'endsolid': it is cut short
)");
  CHECK(said_of("a.stl", "a text that is not of triangles") ==
R"(a.stl: error: 31 bytes are less than the head of a binary STL file (84)
  hint: it is cut short or damaged, or not an STL file (as text, these begin with 'solid')
)");
  CHECK(said_of("a.stl", "solid a\nendsolid a\n").empty());  // check_solid() refuses it
}

TEST_CASE("binary STL files with a wrong count, cut short or with wild numbers are refused") {
  const std::string good = stl_binary();
  CHECK(said_of("a.stl", good.substr(0, good.size() - 7)) ==
R"(a.stl: error: the file counts 4 triangles, which take 284 bytes, but it has 277 bytes
  hint: it is cut short or damaged, or not an STL file (as text, these begin with 'solid')
)");
  std::string wrong = good;
  wrong[80] = 9;
  CHECK(said_of("a.stl", wrong) ==
R"(a.stl: error: the file counts 9 triangles, which take 534 bytes, but it has 284 bytes
  hint: it is cut short or damaged, or not an STL file (as text, these begin with 'solid')
)");
  std::string wild = good;
  const float infinite = std::numeric_limits<float>::infinity();
  std::memcpy(wild.data() + 84 + 50 + 12 + 12 + 4, &infinite, sizeof infinite);
  CHECK(said_of("a.stl", wild) ==
R"(a.stl: error: coordinates must be finite numbers, but corner 1 of triangle 1 is (1, inf, 0)
)");
}

TEST_CASE("broken OBJ files are refused with their place") {
  CHECK(said_of("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1\n") ==
R"(a.obj:3:6: error: the z coordinate is missing
  v 0 1
       ^
)");
  CHECK(said_of("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n") ==
R"(a.obj:3:7: error: a corner must be one of the 2 vertices so far, found '3'
  f 1 2 3
        ^
  hint: vertices count from 1
)");
  CHECK(said_of("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 0\n") ==
R"(a.obj:3:7: error: a corner must be one of the 2 vertices so far, found '0'
  f 1 2 0
        ^
  hint: vertices count from 1
)");
  CHECK(said_of("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n") ==
R"(a.obj:3:5: error: a face needs at least 3 corners, found 2
  f 1 2
      ^
)");
  CHECK(said_of("a.obj", "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 2 3 4 1\nf 1 2 3 4\n") ==
R"(a.obj:5:9: error: this face of 4 corners is not convex
  f 2 3 4 1
          ^
  hint: export the surface as triangles
)");
  CHECK(said_of("a.obj", "v 0 0 0\ncurv 0 1\n") ==
R"(a.obj:2:1: error: 'curv' is not read; surfaces are made of 'v' and 'f' rows
  curv 0 1
  ^
  hint: export the surface as triangles
)");
  CHECK(said_of("a.dxf", "0\nSECTION\n") ==
R"(a.dxf: error: the format of 'a.dxf' is not known
  hint: triangles are read from files that end on .stl, .obj or .ply
)");
}

TEST_CASE("broken PLY files are refused with their place") {
  CHECK(said_of("a.ply", replaced(ply_text(), "ascii", "binary_big_endian")) ==
R"(a.ply:2:8: error: the format must be 'ascii' or 'binary_little_endian', found 'binary_big_endian'
  format binary_big_endian 1.0
         ^
)");
  CHECK(said_of("a.ply", replaced(ply_text(), "end_header\n", "")).starts_with(
R"(a.ply:13:1: error: unknown '0.000000' in the head)"));
  CHECK(said_of("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n") ==
R"(a.ply: error: the file ends before 'end_header': it is cut short
)");
  CHECK(said_of("a.ply", replaced(ply_text(), "property float z\n", "property float w\n")) ==
R"(a.ply: error: the head has no element 'vertex' with x, y and z
)");
  CHECK(said_of("a.ply", replaced(ply_text(), "vertex_indices", "corners")) ==
R"(a.ply: error: the head has no element 'face' with a list 'vertex_indices'
)");
  CHECK(said_of("a.ply", replaced(ply_text(), "property float x", "property real x")) ==
R"(a.ply:5:10: error: 'real' is not a type of numbers
  property real x
           ^
)");
  CHECK(said_of("a.ply", replaced(ply_text(), "3 0 2 1", "3 0 2 4")) ==
R"(a.ply:18:7: error: a corner must be one of the 4 vertices, found 4
  3 0 2 4
        ^
  hint: vertices count from 0
)");
  CHECK(said_of("a.ply", replaced(ply_text(), "3 0 2 1", "2 0 2")) ==
R"(a.ply:18:5: error: a face needs at least 3 corners, face 0 has 2
  2 0 2
      ^
)");
  const std::string good = ply_binary();
  CHECK(said_of("a.ply", good.substr(0, good.size() - 3)) ==
R"(a.ply: error: at byte 342: the file ends before its last element: it is cut short
)");
  std::string wrong = good;
  wrong[good.size() - 2 - 4] = 100;
  CHECK(said_of("a.ply", wrong) ==
R"(a.ply: error: at byte 343: a corner must be one of the 4 vertices, found 100
  hint: vertices count from 0
)");
}

TEST_CASE("elements of PLY files that take no bytes take no time, and none is there twice") {
  const std::string empty = "element nothing 2147483647\n";
  std::string many;
  for (int i = 0; i < 1000; ++i) many += empty;
  CHECK(said_of("a.ply", replaced(ply_binary(), "element face", many + "element face")) == "");
  CHECK(said_of("a.ply", replaced(ply_binary(), "element face", "element vertex 2000000000\nelement face")) ==
R"(a.ply: error: the head has two elements 'vertex'
)");
}

TEST_CASE("corners of surfaces that are infinitely far away are refused, with the file") {
  const std::string text = replaced(obj_text, "v 1 0 0", "v 1e200 0 0");
  CHECK(said_of("a.obj", text) ==
R"(a.obj: error: a surface has a corner at (1e+200, 0, 0)
  hint: coordinates, times 'scale' and with 'offset', are finite numbers of metres
)");
  ProblemList problems;
  CHECK_FALSE(read_triangles(file_of("a.obj", obj_text), {.scale = 1e300}, problems));
  CHECK(problems.count() == 1);
}

TEST_CASE("surfaces that are not closed, flat, branched or turned are refused as solids") {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  CHECK(said_of_solid(points) ==
R"(wall.obj: error: the file has no triangles
)");
  CHECK(said_of_solid(points + "f 1 3 2\nf 1 2 4\nf 1 4 3\n") ==
R"(wall.obj: error: the surface is not closed: 3 edges belong to one triangle only
  hint: close the hole: 3 edges around (0.333333, 0.333333, 0.333333)
)");
  CHECK(said_of_solid(points + "v 0.25 0.25 0\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 1 2 5\n") ==
R"(wall.obj: error: 1 edge belongs to more than two triangles, the first at (0.5, 0, 0)
  hint: walls within a solid, and bodies that share an edge, are not one solid
wall.obj: error: the surface is not closed: 2 edges belong to one triangle only
  hint: close the hole: 2 edges around (0.375, 0.125, 0)
)");
  CHECK(said_of_solid(points + "f 1 3 2\nf 1 2 4\nf 1 3 4\nf 2 3 4\n") ==
R"(wall.obj: error: triangles do not agree which side is outside: at 3 edges neighbours are turned over, the first at (0, 0.5, 0)
  hint: corners have to be counter-clockwise seen from outside; let the program that made the surface recalculate its normals
)");
  CHECK(said_of_solid(points + "v 2 0 0\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 1 2 5\n") ==
R"(wall.obj: error: 1 triangle has no area, the first at (1, 0, 0)
  hint: their corners lie on a line; remove them in the program that made the surface
)");
  CHECK(said_of_solid(points + "f 1 2 3\nf 1 3 2\n") ==
R"(wall.obj: error: the surface encloses no volume
)");
}

TEST_CASE("surfaces that show their inside, and triangles that are a line, are mended") {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  CHECK(said_of_solid(points + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n") ==
R"(wall.obj: warning: all triangles are turned over: the surface showed its inside
  hint: corners have to be counter-clockwise seen from outside
)");
  CHECK(said_of_solid(points + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 4 2 2\n") ==
R"(wall.obj: warning: 1 triangle with a corner twice is left out, the first at (0, 0, 1)
)");
}
// clang-format on

namespace {

/// A wedge with its corner at x = y = z = `at`, whose edges have the length `size`.
std::string wedge(double at, double size, int first, bool turned) {
  std::string text;
  for (const auto& c : corners)
    text += fmt::format("v {} {} {}\n", at + size * c[0], at + size * c[1], at + size * c[2]);
  for (const auto& f : faces)
    text += fmt::format("f {} {} {}\n", first + f[0], first + f[turned ? 2 : 1],
                        first + f[turned ? 1 : 2]);
  return text;
}

double volume_of(const std::string& obj) {
  ProblemList problems;
  auto read = read_triangles(file_of("wall.obj", obj), {}, problems);
  REQUIRE(read);
  REQUIRE(check_solid("wall.obj", *read, problems));
  return enclosed_volume(*read);
}

}  // namespace

TEST_CASE("each closed surface of a solid shows its outside, and those within others are hollows") {
  const std::string outer = wedge(0, 6, 1, false), turned = wedge(0, 6, 1, true);
  CHECK(said_of_solid(outer + wedge(10, 3, 5, false)).empty());
  CHECK(said_of_solid(outer + wedge(1, 1, 5, true)).empty());
  CHECK(volume_of(outer + wedge(10, 3, 5, true)) == doctest::Approx(36 + 4.5));
  CHECK(volume_of(outer + wedge(10, 6, 5, true)) == doctest::Approx(72));
  CHECK(volume_of(turned + wedge(10, 3, 5, true)) == doctest::Approx(36 + 4.5));
  CHECK(volume_of(outer + wedge(1, 1, 5, true)) == doctest::Approx(36 - 1.0 / 6));
  CHECK(volume_of(outer + wedge(1, 1, 5, false)) == doctest::Approx(36 - 1.0 / 6));
  CHECK(volume_of(turned + wedge(1, 1, 5, false)) == doctest::Approx(36 - 1.0 / 6));
  CHECK(volume_of(turned + wedge(1, 1, 5, true)) == doctest::Approx(36 - 1.0 / 6));
  CHECK(said_of_solid(outer + wedge(10, 3, 5, true)) ==
        "wall.obj: warning: 1 of the 2 closed surfaces is turned over: it showed its inside\n"
        "  hint: corners have to be counter-clockwise seen from outside\n");
  CHECK(said_of_solid(outer + wedge(1, 1, 5, false)) ==
        "wall.obj: warning: 1 of the 2 closed surfaces lies within others, and is turned over: the "
        "body is hollow there, 0.1667 m^3\n"
        "  hint: remove inner surfaces from the file if the body is solid there\n");
}
