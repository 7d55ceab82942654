/// \file The cells of many points of which nothing is known.
#pragma once

#include <span>

#include "physics/mesh/mesh.h"

namespace lahar {

/// Fill those entries of `cell` that are negative with what Mesh::locate() finds for their points:
/// -1 where there is no cell. Points [m] may come in any order; many at once take a tenth of the
/// time in isoparametric Q4 and H8, whose inverse map is then found for packs of them.
template <int Dim>
void locate_all(const Mesh<Dim>& mesh, std::span<const Vec<Dim>> x, std::span<Index> cell);

}  // namespace lahar
