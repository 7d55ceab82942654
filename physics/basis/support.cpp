#include "physics/basis/support.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "physics/base/error.h"
#include "physics/basis/tensor_basis.h"

namespace lahar {

int support_rings(ShapeFunctions functions) {
  return row_of(functions).rings;
}

BasisKind basis_kind(const Analysis& analysis) {
  const BasisKind basis = row_of(analysis.functions).basis;
  return basis == BasisKind::linear && analysis.affine != Affine::none ? BasisKind::corners : basis;
}

bool needs_node_positions(const Analysis& analysis) {
  if (analysis.contact.bodies > 1 || analysis.plane == Plane::axisymmetric) return true;
  const BasisKind basis = basis_kind(analysis);
  return analysis.affine != Affine::none &&
         (basis == BasisKind::corners || basis == BasisKind::cpdi || basis == BasisKind::cpdi2);
}

bool gives_gradients(const Analysis& analysis) {
  const ShapeFunctionsRow& row = row_of(analysis.functions);
  return row.products || row.domain != ParticleDomain::none;
}

template <int Dim>
BasisKind basis_kind(const Mesh<Dim>& mesh, const Analysis& analysis) {
  const bool other = analysis.functions == ShapeFunctions::element && !mesh.is_multilinear();
  return other ? BasisKind::element : basis_kind(analysis);
}

namespace {

template <int Dim>
void support_of_corners(PatchTopology<Dim>& topology) {
  topology.support_size = corners<Dim>;
  for (const auto& nodes : topology.corner_nodes)
    topology.support_nodes.insert(topology.support_nodes.end(), nodes.begin(), nodes.end());
}

[[noreturn]] void no_grid(Index cell) {
  throw InputError("GIMP and B-splines need a mesh of equal boxes that fill a box; cell " +
                   std::to_string(cell) + " does not fit in one.");
}

/// Nodes at the places of a grid around a cell, four per axis with the first fastest: corners of
/// the cells that share a node with it; -1 = none there.
template <int Dim>
std::array<Index, tensor_nodes<Dim>> nodes_around_box(const Mesh<Dim>& mesh, Index cell) {
  constexpr double place_tolerance = 1e-5;  // boxes are such to six digits
  std::array<Index, tensor_nodes<Dim>> nodes;
  nodes.fill(-1);
  const CellGeometry<Dim> box = mesh.geometry(cell);
  std::vector<Index> cells = mesh.neighbours(cell);
  cells.push_back(cell);
  for (const Index near : cells)
    for (const Index node : mesh.cell_nodes_tensor(near)) {
      int at = 0;
      for (int d = Dim - 1; d >= 0; --d) {
        const double place = (mesh.node(node)[d] - box.centre[d]) / box.length[d] + 1.5;
        const double nearest = std::round(place);
        if (!(std::abs(place - nearest) < place_tolerance) || nearest < 0 || nearest > 3)
          no_grid(cell);
        at = axis_nodes * at + static_cast<int>(nearest);
      }
      nodes[static_cast<std::size_t>(at)] = node;
    }
  return nodes;
}

/// Sides of a cell, as bits of PatchTopology::support_border, on which the mesh ends.
template <int Dim>
std::uint8_t border_of(const std::array<Index, tensor_nodes<Dim>>& nodes, Index cell) {
  const auto along = [](std::size_t i, std::size_t d) { return i >> (2 * d) & 3; };
  unsigned border = 0;
  for (std::size_t d = 0; d < Dim; ++d)
    for (const unsigned side : {0u, 1u}) {
      bool any = false;
      for (std::size_t i = 0; i < nodes.size(); ++i)
        any = any || (nodes[i] >= 0 && along(i, d) == 3 * side);
      if (!any) border |= 1u << (2 * d + side);
    }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    bool beyond = false;
    for (std::size_t d = 0; d < Dim; ++d)
      beyond = beyond || (along(i, d) == 0 && border >> (2 * d) & 1) ||
               (along(i, d) == 3 && border >> (2 * d + 1) & 1);
    if (!beyond && nodes[i] < 0) no_grid(cell);
  }
  return static_cast<std::uint8_t>(border);
}

/// For a mesh from tables whose cells are those of a grid.
template <int Dim>
void support_of_boxes(const Mesh<Dim>& mesh, PatchTopology<Dim>& topology) {
  if (!mesh.is_cartesian()) no_grid(topology.cells.front());
  const auto begin = topology.nodes.begin(), end = topology.nodes.end();
  topology.support_size = tensor_nodes<Dim>;
  for (std::size_t c = 0; c < topology.cells.size(); ++c) {
    const auto nodes = nodes_around_box(mesh, topology.cells[c]);
    topology.support_border.push_back(border_of<Dim>(nodes, topology.cells[c]));
    for (const Index node : nodes)  // beyond the mesh: any other
      topology.support_nodes.push_back(
          node < 0 ? topology.corner_nodes[c][0]
                   : static_cast<Local>(std::lower_bound(begin, end, node) - begin));
  }
}

/// The nodes of the cells themselves.
template <int Dim>
void support_of_elements(const Mesh<Dim>& mesh, PatchTopology<Dim>& topology) {
  const auto begin = topology.nodes.begin(), end = topology.nodes.end();
  topology.support_size = info(mesh.element()).nodes;
  topology.support_nodes.reserve(topology.cells.size() *
                                 static_cast<std::size_t>(topology.support_size));
  for (const Index cell : topology.cells)
    for (const Index node : mesh.element_nodes(cell))
      topology.support_nodes.push_back(
          static_cast<Local>(std::lower_bound(begin, end, node) - begin));
}

template <int Dim>
void support_of_grid(const Mesh<Dim>& mesh, PatchTopology<Dim>& topology) {
  if (!mesh.is_structured()) return support_of_boxes(mesh, topology);
  const auto counts = mesh.counts();
  const auto begin = topology.nodes.begin(), end = topology.nodes.end();
  topology.support_size = tensor_nodes<Dim>;
  topology.support_nodes.reserve(topology.cells.size() * tensor_nodes<Dim>);
  for (const Index cell : topology.cells) {
    std::array<Index, Dim> at;
    Index rest = cell;
    std::uint8_t border = 0;
    for (std::size_t d = 0; d < Dim; ++d) {
      at[d] = rest % counts[d];
      rest /= counts[d];
      if (at[d] == 0) border = static_cast<std::uint8_t>(border | 1u << (2 * d));
      if (at[d] == counts[d] - 1) border = static_cast<std::uint8_t>(border | 2u << (2 * d));
    }
    topology.support_border.push_back(border);
    for (int i = 0; i < tensor_nodes<Dim>; ++i) {
      Index id = 0, stride = 1;
      for (std::size_t d = 0; d < Dim; ++d) {
        const Index k = at[d] - 1 + (i >> (2 * d) & 3);
        id += stride * std::clamp<Index>(k, 0, counts[d]);  // beyond the mesh: any other
        stride *= counts[d] + 1;
      }
      topology.support_nodes.push_back(
          static_cast<Local>(std::lower_bound(begin, end, id) - begin));
    }
  }
}

void find_followers(PatchTopology<2>&) {}

void find_followers(PatchTopology<3>& topology) {
  topology.support_follows.assign(topology.cells.size(), 0);
  for (std::size_t c = 1; c < topology.cells.size(); ++c) {
    const auto nodes = topology.support(c), before = topology.support(c - 1);
    bool follows = true;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (i % axis_nodes < axis_nodes - 1) follows = follows && nodes[i] == before[i + 1];
    topology.support_follows[c] = follows;
  }
}

}  // namespace

template <int Dim>
void add_support(const Mesh<Dim>& mesh, const Analysis& analysis, PatchTopology<Dim>& topology) {
  switch (basis_kind(mesh, analysis)) {
    case BasisKind::linear:
      return;
    case BasisKind::corners:
      return support_of_corners(topology);
    case BasisKind::element:
      return support_of_elements(mesh, topology);
    case BasisKind::gimp:
    case BasisKind::cpdi:
    case BasisKind::cpdi2:
    case BasisKind::quadratic_spline:
    case BasisKind::cubic_spline:
      support_of_grid(mesh, topology);
      return find_followers(topology);
  }
}

template BasisKind basis_kind<2>(const Mesh<2>&, const Analysis&);
template BasisKind basis_kind<3>(const Mesh<3>&, const Analysis&);
template void add_support<2>(const Mesh<2>&, const Analysis&, PatchTopology<2>&);
template void add_support<3>(const Mesh<3>&, const Analysis&, PatchTopology<3>&);

}  // namespace lahar
