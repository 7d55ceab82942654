/// \file Which nodes the functions in a cell belong to, where they are more than its corners.
#pragma once

#include "physics/patch.h"

namespace lahar {

/// Layers of cells around a patch whose nodes its particles reach.
int support_rings(ShapeFunctions functions);

/// The basis that patches need.
BasisKind basis_kind(const Analysis& analysis);

/// Give a patch its basis, whose topology was made with at least support_rings() rings. Throws
/// InputError where functions that reach beyond a cell meet a mesh that is not structured.
template <int Dim>
void set_basis(const Mesh<Dim>& mesh, const Analysis& analysis, Patch<Dim>& patch);

}  // namespace lahar
