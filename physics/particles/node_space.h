/// \file Space of the mesh around nodes: what the mass of nodes is spread over.
#pragma once

#include <span>
#include <vector>

#include "physics/mesh/partition.h"
#include "physics/model/model.h"

namespace lahar {

/// By local node of a patch, the sum over the cells around it of `share(cell, nodes, a)`, for the
/// node at position a in element_nodes(cell).
template <int Dim, class Share>
std::vector<double> space_of_nodes(const PatchTopology<Dim>& topology, const Mesh<Dim>& mesh,
                                   Share share) {
  std::vector<double> space;
  space.reserve(topology.nodes.size());
  for (const Index local : topology.nodes) {
    const Index node = local % mesh.n_nodes();  // bodies in contact have nodes of their own
    double sum = 0;
    for (const Index cell : mesh.node_cells(node)) {
      const CellNodes<Dim> nodes = mesh.element_nodes(cell);
      for (int a = 0; a < nodes.count; ++a)
        if (nodes.begin()[a] == node) sum += share(cell, nodes, a);
    }
    space.push_back(sum);
  }
  return space;
}

/// The nodes of a local cell at which material has a positive mass wherever it is: of Q8 and H20
/// those within edges.
template <int Dim>
std::span<const Local> nodes_with_mass(const PatchTopology<Dim>& topology, Element element,
                                       std::size_t cell) {
  const auto nodes = topology.element_nodes(cell);
  return nodes.subspan(is_serendipity(element) ? static_cast<std::size_t>(info(element).corners)
                                               : 0);
}

/// [m^3] by local cell of a patch: the integral of the functions of nodes_with_mass() over the
/// whole mesh. Mass at these nodes over it is the mean density around the cell.
template <int Dim>
std::vector<double> space_around_cells(const PatchTopology<Dim>& topology, const Model<Dim>& model);

}  // namespace lahar
