#include "io/mesh/element_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace lahar {

const std::vector<ElementKind>& element_kinds() {
  static const std::vector<ElementKind> kinds{
      {"points", 0, 1, 15, 1, {}},
      {"2-node lines", 1, 2, 1, 3, {}},
      {"3-node lines", 1, 3, 8, 21, {}},
      {"3-node triangles", 2, 3, 2, 5, Element::T3},
      {"6-node triangles", 2, 6, 9, 22, Element::T6},
      {"4-node quadrilaterals", 2, 4, 3, 9, Element::Q4},
      {"8-node quadrilaterals", 2, 8, 16, 23, Element::Q8},
      {"9-node quadrilaterals", 2, 9, 10, 28, Element::Q9},
      {"4-node tetrahedra", 3, 4, 4, 10, Element::Tet4},
      {"10-node tetrahedra", 3, 10, 11, 24, {}},
      {"8-node hexahedra", 3, 8, 5, 12, Element::H8},
      {"20-node hexahedra", 3, 20, 17, 25, Element::H20},
      {"27-node hexahedra", 3, 27, 12, 29, Element::H27},
      {"6-node prisms", 3, 6, 6, 13, {}},
      {"15-node prisms", 3, 15, 18, 26, {}},
      {"18-node prisms", 3, 18, 13, 32, {}},
      {"5-node pyramids", 3, 5, 7, 14, {}},
      {"13-node pyramids", 3, 13, 19, 27, {}},
      {"14-node pyramids", 3, 14, 14, -1, {}},
  };
  return kinds;
}

namespace {

int find_kind(int ElementKind::*key, int number) {
  const auto& kinds = element_kinds();
  const auto it = std::find_if(kinds.begin(), kinds.end(),
                               [&](const ElementKind& kind) { return kind.*key == number; });
  return it == kinds.end() || number < 0 ? -1 : static_cast<int>(it - kinds.begin());
}

}  // namespace

int kind_of_gmsh(int number) {
  return find_kind(&ElementKind::gmsh, number);
}
int kind_of_vtk(int number) {
  return find_kind(&ElementKind::vtk, number);
}

std::vector<int> vtk_order(const ElementKind& kind) {
  // VTK goes around the bottom, around the top, then up the edges in between.
  static const std::vector<int> hexahedron{0,  1,  2,  3,  4,  5,  6,  7,  8,  11, 16, 9,  17, 10,
                                           18, 19, 12, 15, 13, 14, 24, 22, 20, 21, 23, 25, 26};
  std::vector<int> order(static_cast<std::size_t>(kind.nodes));
  std::iota(order.begin(), order.end(), 0);
  if (kind.element == Element::H20 || kind.element == Element::H27)
    std::copy_n(hexahedron.begin(), order.size(), order.begin());
  return order;
}

FileElements::FileElements() : kinds(element_kinds().size()) {}

namespace {

bool begins_with(const SideFile& file, std::string_view text) {
  std::string begin(std::size_t{1} << 12, '\0');
  begin.resize(file.read(0, begin.data(), begin.size()));
  return begin.find(text) != begin.npos;
}

}  // namespace

bool is_element_file(const SideFile& file) {
  return begins_with(file, "$MeshFormat") || begins_with(file, "<VTKFile");
}

double bytes_to_read(const SideFile& file) {
  return begins_with(file, "<VTKFile") ? vtu_bytes(file) : 0;
}

FileElements read_element_file(const SideFile& file) {
  return begins_with(file, "<VTKFile") ? read_vtu(file) : read_gmsh(file);
}

}  // namespace lahar
