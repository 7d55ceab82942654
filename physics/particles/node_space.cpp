#include "physics/particles/node_space.h"

namespace lahar {

namespace {

/// Depth where the function of a node has its middle in a cell: exact for boxes.
double depth_of_share(const Model<2>& model, const CellNodes<2>& nodes, int a) {
  if (model.analysis.plane != Plane::axisymmetric) return 1.0;
  double centre = 0;
  for (const Index node : nodes) centre += model.mesh->node(node).x() / nodes.count;
  return depth_at(model.analysis, (model.mesh->node(nodes.begin()[a]).x() + 2.0 * centre) / 3.0);
}
double depth_of_share(const Model<3>&, const CellNodes<3>&, int) {
  return 1.0;
}

/// space_around_cells() in a grid of equal cells: along each axis the two nodes of a cell stand for
/// two cells, at an end of the grid for half of one less.
template <int Dim>
std::vector<double> space_in_grid(const std::vector<Index>& cells, const Mesh<Dim>& mesh) {
  const auto counts = mesh.counts();
  const double volume = mesh.cell_volume(0);
  std::vector<double> space;
  space.reserve(cells.size());
  for (Index cell : cells) {
    double times = 1;
    for (std::size_t d = 0; d < Dim; ++d) {
      const Index at = cell % counts[d];
      cell /= counts[d];
      times *= 2.0 - 0.5 * (at == 0) - 0.5 * (at == counts[d] - 1);
    }
    space.push_back(times * volume);
  }
  return space;
}

}  // namespace

template <int Dim>
std::vector<double> space_around_cells(const PatchTopology<Dim>& topology,
                                       const Model<Dim>& model) {
  const Mesh<Dim>& mesh = *model.mesh;
  if (mesh.is_structured() && model.analysis.plane != Plane::axisymmetric)
    return space_in_grid(topology.cells, mesh);
  const Element element = mesh.element();
  const bool positive = !model.analysis.lagrange_functions && !is_serendipity(element);
  const auto means = means_of_functions<Dim>(element);
  const auto of_node =
      space_of_nodes(topology, mesh, [&](Index cell, const CellNodes<Dim>& nodes, int a) {
        const double mean = positive ? 1.0 / nodes.count : means[static_cast<std::size_t>(a)];
        return mesh.cell_volume(cell) * mean * depth_of_share(model, nodes, a);
      });
  std::vector<double> space;
  space.reserve(topology.cells.size());
  for (std::size_t c = 0; c < topology.cells.size(); ++c) {
    double sum = 0;
    for (const Local node : nodes_with_mass(topology, element, c))
      sum += of_node[static_cast<std::size_t>(node)];
    space.push_back(sum);
  }
  return space;
}

template std::vector<double> space_around_cells(const PatchTopology<2>&, const Model<2>&);
template std::vector<double> space_around_cells(const PatchTopology<3>&, const Model<3>&);

}  // namespace lahar
