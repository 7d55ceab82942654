// Meshes with sets from VTU files.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <zlib.h>

#include <cstring>

#include "io/base/base64.h"
#include "io/mesh/element_file.h"
#include "physics/mesh/element_grid.h"
#include "physics/mesh/mesh.h"

using namespace lahar;

namespace {

enum class Way { ascii, base64, zlib, raw, raw_zlib, appended_base64 };

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// Writes the arrays of a file in one way.
class VtuWriter {
 public:
  explicit VtuWriter(Way way) : way_(way) {}

  template <class T>
  void array(const std::string& name, const std::string& type, const std::vector<T>& values,
             int components = 1) {
    text_ += fmt::format("<DataArray type='{}' Name=\"{}\" NumberOfComponents = \"{}\" ", type,
                         name, components);
    const bool appended = way_ >= Way::raw;
    if (way_ == Way::ascii) {
      std::vector<double> shown(values.begin(), values.end());
      text_ += fmt::format("format=\"ascii\">\n {} \n</DataArray>\n", fmt::join(shown, " "));
      if (type != "Float64" && type != "Float32") {
        const std::vector<long> whole(values.begin(), values.end());
        text_.erase(text_.rfind("format"));
        text_ += fmt::format("format=\"ascii\">\n {} \n</DataArray>\n", fmt::join(whole, "\n"));
      }
    } else if (appended) {
      text_ += fmt::format("format=\"appended\" offset=\"{}\"/>\n", appended_.size());
      appended_ += encoded(bytes_of(values));
    } else {
      text_ += fmt::format("format=\"binary\">\n  {}\n</DataArray>\n", encoded(bytes_of(values)));
    }
  }
  void tag(const std::string& text) { text_ += text + "\n"; }

  std::string file() const {
    std::string out =
        "<?xml version=\"1.0\"?>\n<!-- it's a > comment -->\n<VTKFile type=\"UnstructuredGrid\" "
        "version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"";
    if (compressed()) out += " compressor=\"vtkZLibDataCompressor\"";
    out += ">\n<UnstructuredGrid>\n" + text_ + "</Piece>\n</UnstructuredGrid>\n";
    if (way_ >= Way::raw)
      out += fmt::format("<AppendedData encoding=\"{}\">\n _{}\n</AppendedData>\n",
                         way_ == Way::appended_base64 ? "base64" : "raw", appended_);
    return out + "</VTKFile>\n";
  }

 private:
  bool compressed() const { return way_ == Way::zlib || way_ == Way::raw_zlib; }
  std::string encoded(const std::string& bytes) const {
    std::vector<std::uint64_t> header{bytes.size()};
    std::string data = bytes;
    if (compressed()) {  // blocks of 100 bytes, the last shorter
      header = {(bytes.size() + 99) / 100, 100, bytes.size() % 100};
      data.clear();
      for (std::size_t at = 0; at < bytes.size(); at += 100) {
        const std::size_t n = std::min<std::size_t>(100, bytes.size() - at);
        uLongf size = ::compressBound(n);
        std::string block(size, '\0');
        ::compress(reinterpret_cast<Bytef*>(block.data()), &size,
                   reinterpret_cast<const Bytef*>(bytes.data() + at), n);
        header.push_back(size);
        data += block.substr(0, size);
      }
    }
    const std::string head = bytes_of(header);
    if (way_ == Way::raw || way_ == Way::raw_zlib) return head + data;
    return way_ == Way::zlib ? base64(head) + base64(data) : base64(head + data);
  }

  Way way_;
  std::string text_, appended_;
};

int vtk_number(Element element) {
  for (const ElementKind& kind : element_kinds())
    if (kind.element == element) return kind.vtk;
  return -1;
}

/// A grid of an element with sets: "left" (0 or 1) of nodes, "zone" (0, 3 or 5) of cells.
template <int Dim>
std::string grid_file(Element element, Way way, double x_scale = 1) {
  std::array<Index, static_cast<std::size_t>(Dim)> counts;
  counts.fill(2);
  const auto grid = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Ones(), counts);
  const auto per_cell = static_cast<std::size_t>(info(element).nodes);
  const std::size_t n_cells = grid.cells.size() / per_cell;
  const auto kind = std::find_if(element_kinds().begin(), element_kinds().end(),
                                 [&](const ElementKind& k) { return k.element == element; });
  const auto order = vtk_order(*kind);
  std::vector<double> x;
  std::vector<std::int8_t> left;
  for (const auto& node : grid.nodes) {
    for (int d = 0; d < 3; ++d) x.push_back(d < Dim ? node[d] * (d == 0 ? x_scale : 1) : 0);
    left.push_back(node[0] == 0 ? 1 : 0);
  }
  std::vector<std::int64_t> nodes(grid.cells.size()), ends;
  std::vector<std::uint8_t> types(n_cells, static_cast<std::uint8_t>(vtk_number(element)));
  std::vector<std::int32_t> zones;
  for (std::size_t c = 0; c < n_cells; ++c) {
    for (std::size_t a = 0; a < per_cell; ++a)
      nodes[c * per_cell + static_cast<std::size_t>(order[a])] = grid.cells[c * per_cell + a];
    ends.push_back(static_cast<std::int64_t>((c + 1) * per_cell));
    zones.push_back(c == 0 ? 3 : c == 1 ? 0 : 5);
  }
  VtuWriter out(way);
  out.tag(fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", grid.nodes.size(),
                      n_cells));
  out.tag("<PointData>");
  out.array("left", "Int8", left);
  out.array("height", "Float32", std::vector<float>(left.size(), 0.5F));
  out.tag("</PointData>\n<CellData>");
  out.array("zone", "Int32", zones);
  out.tag("</CellData>\n<Points>");
  out.array("Points", "Float64", x, 3);
  out.tag("</Points>\n<Cells>");
  out.array("connectivity", "Int64", nodes);
  out.array("offsets", "Int64", ends);
  out.array("types", "UInt8", types);
  out.tag("</Cells>");
  return out.file();
}

SideFile file_of(const std::string& text) {
  return {"mesh.vtu", "mesh.vtu", static_cast<Index>(text.size()), text};
}

template <int Dim>
void check_grid(Element element, Way way) {
  CAPTURE(info(element).name);
  CAPTURE(static_cast<int>(way));
  ProblemList problems;
  const auto mesh =
      mesh_of<Dim>(read_element_file(file_of(grid_file<Dim>(element, way))), "mesh.vtu", problems);
  CHECK(problems.found_warnings().kept.empty());
  CHECK(mesh.element == element);
  const auto checked = Mesh<Dim>::from_tables(mesh.nodes, mesh.element, mesh.cells, true);
  double volume = 0;
  for (Index cell = 0; cell < checked.n_cells(); ++cell) volume += checked.cell_volume(cell);
  CHECK(volume == doctest::Approx(1 << Dim));
  REQUIRE(mesh.node_sets.size() == 1);
  CHECK(mesh.node_sets[0].name == "left");
  for (const Index node : mesh.node_sets[0].members)
    CHECK(mesh.nodes[static_cast<std::size_t>(node)][0] == 0);
  CHECK(mesh.node_sets[0].members.size() > 2);
  REQUIRE(mesh.cell_sets.size() == 2);
  CHECK(mesh.cell_sets[0].name == "zone=3");
  CHECK(mesh.cell_sets[0].members == std::vector<Index>{0});
  CHECK(mesh.cell_sets[1].name == "zone=5");
  CHECK(static_cast<Index>(mesh.cell_sets[1].members.size()) == checked.n_cells() - 2);
}

std::string refusal(const std::string& text) {
  try {
    ProblemList problems;
    mesh_of<2>(read_element_file(file_of(text)), "mesh.vtu", problems);
  } catch (const InputError& error) {
    return format_problems(error.problems());
  }
  return "accepted";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("VTU files of every element are read in every encoding, with their sets") {
  for (const Way way :
       {Way::ascii, Way::base64, Way::zlib, Way::raw, Way::raw_zlib, Way::appended_base64}) {
    check_grid<2>(Element::Q4, way);
    check_grid<3>(Element::H8, way);
  }
  for (const Element element : {Element::T3, Element::T6, Element::Q8, Element::Q9})
    check_grid<2>(element, Way::raw);
  for (const Element element : {Element::Tet4, Element::H20, Element::H27})
    check_grid<3>(element, Way::zlib);
}

TEST_CASE("cells of lower dimension in VTU files are sets of nodes") {
  VtuWriter out(Way::ascii);
  out.tag("<Piece NumberOfPoints=\"5\" NumberOfCells=\"3\"><Points>");
  out.array("Points", "Float64", std::vector<double>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 7, 7, 7},
            3);
  out.tag("</Points><Cells>");
  out.array("connectivity", "Int32", std::vector<int>{0, 1, 0, 1, 2, 3, 2});
  out.array("offsets", "Int32", std::vector<int>{2, 6, 7});
  out.array("types", "UInt8", std::vector<std::uint8_t>{3, 9, 1});
  out.tag("</Cells><CellData>");
  out.array("gmsh:physical", "Int32", std::vector<int>{4, 4, 6});
  out.tag("</CellData>");
  ProblemList problems;
  const auto mesh = mesh_of<2>(read_element_file(file_of(out.file())), "mesh.vtu", problems);
  REQUIRE(mesh.node_sets.size() == 2);
  REQUIRE(mesh.cell_sets.size() == 1);
  CHECK(mesh.node_sets[0].name == "gmsh:physical=4");
  CHECK(mesh.node_sets[0].members == std::vector<Index>{0, 1});
  CHECK(mesh.node_sets[1].name == "gmsh:physical=6");
  CHECK(mesh.node_sets[1].members == std::vector<Index>{2});
  CHECK(mesh.cell_sets[0].members == std::vector<Index>{0});
  CHECK(mesh.nodes.size() == 4);
}

TEST_CASE("cells of VTU files that are turned over are mended") {
  ProblemList problems;
  const auto mesh = mesh_of<2>(read_element_file(file_of(grid_file<2>(Element::Q4, Way::raw, -1))),
                               "mesh.vtu", problems);
  CHECK(problems.found_warnings().kept.size() == 1);
  CHECK(Mesh<2>::from_tables(mesh.nodes, mesh.element, mesh.cells, true).cell_volume(0) == 1);
}

// clang-format off
TEST_CASE("broken VTU files are refused") {
  const std::string ascii = grid_file<2>(Element::Q4, Way::ascii);
  CHECK(refusal(replaced(ascii, "UnstructuredGrid", "PolyData")) ==
R"(mesh.vtu: error: the file must have an UnstructuredGrid, found 'PolyData'
  hint: save it as .vtu
)");
  CHECK(refusal(replaced(ascii, "LittleEndian", "BigEndian")) ==
R"(mesh.vtu: error: the byte order must be LittleEndian, found 'BigEndian'
)");
  CHECK(refusal(replaced(ascii, "header_type", "compressor=\"vtkLZ4DataCompressor\" header_type")) ==
R"(mesh.vtu: error: arrays compressed by vtkLZ4DataCompressor are not read
  hint: save it compressed by ZLib, or not compressed
)");
  CHECK(refusal(replaced(ascii, "NumberOfCells=\"4\"", "NumberOfCells=\"5\"")) ==
R"(mesh.vtu: error: the array 'types' has 4 numbers, expected 5
)");
  CHECK(refusal(replaced(ascii, "NumberOfCells=\"4\"", "NumberOfCells=\"four\"")) ==
R"(mesh.vtu: error: NumberOfCells must be a non-negative integer, found 'four'
)");
  CHECK(refusal(replaced(ascii, "NumberOfCells=\"4\"", "NumberOfCells=\"4000000000000\"")) ==
R"(mesh.vtu: error: 9 points and 4000000000000 cells are too many for this file
)");
  CHECK(refusal(replaced(ascii, "Name=\"types\"", "Name=\"kinds\"")) ==
R"(mesh.vtu: error: the cells have no array 'types'
)");
  CHECK(refusal(replaced(ascii, "<Points>\n<DataArray type='Float64' Name=\"Points\" NumberOfComponents = \"3\"",
                         "<Points>\n<DataArray type='Float64' Name=\"Points\" NumberOfComponents = \"2\"")) ==
R"(mesh.vtu: error: the grid needs one array of points, with three components
)");
  CHECK(refusal(replaced(ascii, "9\n9\n9\n9", "9\n9\n9\n7")) ==
R"(mesh.vtu: error: cell 3 is of type 7, which is not read
)");
  CHECK(refusal(replaced(ascii, "9\n9\n9\n9", "9\n9\n9\n5")) ==
R"(mesh.vtu: error: cell 3 has 4 nodes, but 3-node triangles have 3
)");
  CHECK(refusal(replaced(ascii, "<Piece", "<Piece NumberOfPoints=\"1\" NumberOfCells=\"1\"></Piece><Piece")) ==
R"(mesh.vtu: error: the grid has several pieces
  hint: merge them to one before saving
)");
  CHECK(refusal(replaced(ascii, "Name=\"connectivity\" NumberOfComponents = \"1\" format=\"ascii\">\n 0",
                         "Name=\"connectivity\" NumberOfComponents = \"1\" format=\"ascii\">\n 99")) ==
R"(mesh.vtu: error: cell 0 has node 99; nodes are 0 to 8
)");
  CHECK(refusal(replaced(ascii, "Name=\"Points\" NumberOfComponents = \"3\" format=\"ascii\">\n 0",
                         "Name=\"Points\" NumberOfComponents = \"3\" format=\"ascii\">\n nan")) ==
R"(mesh.vtu: error: the coordinates of point 0 are not finite numbers
)");
  CHECK(refusal(replaced(ascii, "Name=\"Points\" NumberOfComponents = \"3\" format=\"ascii\">\n 0",
                         "Name=\"Points\" NumberOfComponents = \"3\" format=\"ascii\">\n zero")) ==
R"(mesh.vtu: error: the array 'Points' has 'zero' in place of a number
)");
}

TEST_CASE("VTU files that are cut short or damaged are refused in every encoding") {
  for (const Way way : {Way::ascii, Way::base64, Way::zlib, Way::raw, Way::raw_zlib,
                        Way::appended_base64}) {
    const std::string good = grid_file<2>(Element::Q4, way);
    // In binary files what follows the last array does not matter.
    const std::size_t tail = way >= Way::raw ? 40 : 12;
    for (std::size_t n = 100; n + tail < good.size(); n += 11) {
      CAPTURE(static_cast<int>(way));
      CAPTURE(n);
      CHECK(refusal(good.substr(0, n)).find("error: ") != std::string::npos);
    }
  }
  std::string damaged = grid_file<2>(Element::Q4, Way::raw_zlib);
  const auto at = damaged.find("<AppendedData");
  for (std::size_t i = at + 80; i < damaged.size() - 40; i += 3) damaged[i] ^= 0x55;
  CHECK(refusal(damaged).find("is damaged or cut short") != std::string::npos);
  CHECK(refusal(replaced(grid_file<2>(Element::Q4, Way::base64), "AAAA", "AA*A")).find(
            "has a character that is not of base 64") != std::string::npos);
}
// clang-format on

namespace {

/// A file whose points are in compressed blocks with this header.
std::string compressed_points(std::size_t points, const std::vector<std::uint64_t>& header,
                              const std::string& blocks) {
  return fmt::format(
      R"(<VTKFile type="UnstructuredGrid" header_type="UInt64" compressor="vtkZLibDataCompressor">
<UnstructuredGrid><Piece NumberOfPoints="{}" NumberOfCells="1"><Points>
<DataArray type="Float64" Name="x" NumberOfComponents="3" format="binary">{}{}</DataArray>
</Points></Piece></UnstructuredGrid></VTKFile>
)",
      points, base64(bytes_of(header)), base64(blocks));
}

std::string packed(std::size_t bytes) {
  const std::string zeros(bytes, '\0');
  uLongf size = ::compressBound(bytes);
  std::string block(size, '\0');
  ::compress(reinterpret_cast<Bytef*>(block.data()), &size,
             reinterpret_cast<const Bytef*>(zeros.data()), bytes);
  return block.substr(0, size);
}

}  // namespace

TEST_CASE("blocks of VTU files have as many bytes as their array, whatever they claim") {
  constexpr std::uint64_t n = 24000;
  const std::string block = packed(n);
  const auto refused = [](const std::string& text) {
    return refusal(text) == "mesh.vtu: error: the compressed array 'x' is damaged or cut short\n";
  };
  CHECK(refusal(compressed_points(n / 24, {1, n, 0, block.size()}, block)) ==
        "mesh.vtu: error: the cells have no array 'types'\n");
  // 39 blocks and a last one whose size makes the sum right in 64 bits.
  std::vector<std::uint64_t> header{40, n, n - 39 * n};
  header.insert(header.end(), 40, block.size());
  std::string blocks;
  for (int i = 0; i < 40; ++i) blocks += block;
  CHECK(refused(compressed_points(n / 24, header, blocks)));
  // Products are beyond 64 bits, too.
  CHECK(refused(compressed_points(n / 24, {(1ULL << 60) + 1, 16, n - 16}, block)));
  // None at all, and more than zlib makes of the file.
  CHECK(refused(compressed_points(n / 24, {0, 0, n}, "")));
  CHECK(refused(compressed_points(200000, {1, 4800000, 0, block.size()}, block)));
}

TEST_CASE("comments of VTU files, in any number, are skipped") {
  std::string many;
  for (int i = 0; i < 200000; ++i) many += "<!-- > -->";
  CHECK(refusal(replaced(grid_file<2>(Element::Q4, Way::ascii), "<UnstructuredGrid>",
                         many + "<UnstructuredGrid>")) == "accepted");
}

TEST_CASE("numbers of VTU files beyond what they may be are refused") {
  const std::string raw = grid_file<2>(Element::Q4, Way::raw);
  for (const char* offset : {"9223372036854775807", "5000"})
    CHECK(refusal(replaced(raw, "offset=\"0\"", fmt::format("offset=\"{}\"", offset))) ==
          "mesh.vtu: error: the array 'left' begins behind the end of the file\n");
  const std::string ascii = grid_file<2>(Element::Q4, Way::ascii);
  // In 32 bits it is a quadrilateral.
  CHECK(refusal(replaced(ascii, "9\n9\n9\n9", "9\n9\n9\n4294967305")) ==
        "mesh.vtu: error: cell 3 is of type 4294967305, which is not read\n");
  CHECK(refusal(replaced(ascii, "4\n8\n12\n16", "4\n-9223372036854775808\n12\n16")) ==
        "mesh.vtu: error: cell 1 ends with node -9223372036854775808 of 16, and the one before "
        "with 4\n");
}
