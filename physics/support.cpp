#include "physics/support.h"

#include <algorithm>

#include "physics/error.h"
#include "physics/tensor_basis.h"

namespace lahar {

int support_rings(ShapeFunctions functions) {
  return functions == ShapeFunctions::element ? 0 : 1;
}

BasisKind basis_kind(ShapeFunctions functions) {
  switch (functions) {
    case ShapeFunctions::element:
      break;
    case ShapeFunctions::gimp:
    case ShapeFunctions::uniform_gimp:
      return BasisKind::gimp;
    case ShapeFunctions::quadratic_spline:
      return BasisKind::quadratic_spline;
    case ShapeFunctions::cubic_spline:
      return BasisKind::cubic_spline;
  }
  return BasisKind::linear;
}

template <int Dim>
BasisKind basis_kind(const Mesh<Dim>& mesh, ShapeFunctions functions) {
  const bool other = functions == ShapeFunctions::element && !mesh.is_multilinear();
  return other ? BasisKind::element : basis_kind(functions);
}

namespace {

/// The nodes of the cells themselves.
template <int Dim>
void add_nodes_of_cells(const Mesh<Dim>& mesh, PatchTopology<Dim>& topology) {
  const auto begin = topology.nodes.begin(), end = topology.nodes.end();
  topology.support_size = info(mesh.element()).nodes;
  topology.support_nodes.reserve(topology.cells.size() *
                                 static_cast<std::size_t>(topology.support_size));
  for (const Index cell : topology.cells)
    for (const Index node : mesh.element_nodes(cell))
      topology.support_nodes.push_back(
          static_cast<Local>(std::lower_bound(begin, end, node) - begin));
}

}  // namespace

template <int Dim>
void add_support(const Mesh<Dim>& mesh, ShapeFunctions functions, PatchTopology<Dim>& topology) {
  if (functions == ShapeFunctions::element) {
    if (!mesh.is_multilinear()) add_nodes_of_cells(mesh, topology);
    return;
  }
  if (!mesh.is_structured())
    throw InputError("GIMP and B-splines need a structured mesh, of equal boxes.");
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

template BasisKind basis_kind<2>(const Mesh<2>&, ShapeFunctions);
template BasisKind basis_kind<3>(const Mesh<3>&, ShapeFunctions);
template void add_support<2>(const Mesh<2>&, ShapeFunctions, PatchTopology<2>&);
template void add_support<3>(const Mesh<3>&, ShapeFunctions, PatchTopology<3>&);

}  // namespace lahar
