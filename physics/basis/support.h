/// \file Which nodes the functions in a cell belong to, where they are more than its corners.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Layers of cells around a patch whose nodes its particles reach.
int support_rings(ShapeFunctions functions);

/// The basis that patches need on a mesh whose elements are Q4 or H8, and on any.
BasisKind basis_kind(const Analysis& analysis);
template <int Dim>
BasisKind basis_kind(const Mesh<Dim>& mesh, const Analysis& analysis);

/// Whether kernels take the positions of nodes even where cells are boxes: those of affine
/// velocities, with functions that are given one by one, of contact, and of rings (ring.h).
bool needs_node_positions(const Analysis& analysis);

/// Whether update_particles() can find velocity gradients on its way over the nodes: where
/// functions are products of those of one axis, or follow from those at corners of a domain, most
/// of the work is the same.
bool gives_gradients(const Analysis& analysis);

/// Fill support_nodes, support_border and support_follows of a topology that was made with at least
/// support_rings() rings. Nothing for the functions of Q4 and H8 themselves. Throws InputError
/// where functions that reach beyond a cell meet a mesh whose cells are not equal boxes.
template <int Dim>
void add_support(const Mesh<Dim>& mesh, const Analysis& analysis, PatchTopology<Dim>& topology);

namespace general {

/// Whether kernels use a basis (basis.h) for the particles of a patch.
template <int Dim>
LAHAR_INLINE bool is(const Patch<Dim>& patch) {
  return patch.basis != BasisKind::linear;
}

}  // namespace general

}  // namespace lahar
