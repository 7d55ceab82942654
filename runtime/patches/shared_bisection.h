/// \file Recursive coordinate bisection of cells that ranks have shares of.
#pragma once

#include <vector>

#include "io/base/team.h"
#include "physics/mesh/mesh.h"

namespace lahar {

/// The patch of each cell of a share, with ids as Partition gives them. Ranks cut together
/// while there is more than a rank's share to cut; each then cuts some of the pieces alone.
/// Collective.
template <int Dim>
std::vector<Local> bisect(const Mesh<Dim>& share, Index parts, const Team& team);

extern template std::vector<Local> bisect(const Mesh<2>&, Index, const Team&);
extern template std::vector<Local> bisect(const Mesh<3>&, Index, const Team&);

}  // namespace lahar
