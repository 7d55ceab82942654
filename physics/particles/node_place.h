/// \file Which nodes of the mesh the local nodes of a patch are, and where.
#pragma once

#include "physics/mesh/mesh.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Number in the mesh of a node, which is the same for every body.
template <int Dim>
Index node_of_mesh(const Patch<Dim>& patch, const Mesh<Dim>& mesh, Local node) {
  return patch.topology.nodes[static_cast<std::size_t>(node)] % mesh.n_nodes();
}

/// Where a node is [m].
template <int Dim>
Vec<Dim> place_of(const Patch<Dim>& patch, const Mesh<Dim>& mesh, Local node) {
  return mesh.node(node_of_mesh(patch, mesh, node));
}

}  // namespace lahar
