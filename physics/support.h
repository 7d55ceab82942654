/// \file Which nodes the functions in a cell belong to, where they are more than its corners.
#pragma once

#include "physics/patch.h"

namespace lahar {

/// Layers of cells around a patch whose nodes its particles reach.
int support_rings(ShapeFunctions functions);

/// The basis that a patch needs for these functions.
BasisKind basis_kind(ShapeFunctions functions);

template <int Dim>
BasisKind basis_kind(const Mesh<Dim>& mesh, ShapeFunctions functions);

/// Fill support_nodes and support_border of a topology that was made with at least support_rings()
/// rings. Nothing for the functions of Q4 and H8 themselves. Throws InputError unless the mesh
/// is structured, or the functions are those of its elements.
template <int Dim>
void add_support(const Mesh<Dim>& mesh, ShapeFunctions functions, PatchTopology<Dim>& topology);

}  // namespace lahar
