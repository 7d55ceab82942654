/// \file Where particles start: Gauss points, regions, and the cell and volume of each.
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "io/base/row_shares.h"
#include "io/scenario/regions.h"
#include "physics/mesh/mesh.h"
#include "physics/model/model.h"

namespace lahar {

/// Positions sum_i N_i(xi) X_i in one cell, nodes in file order.
template <int Dim>
Vec<Dim> cell_point(const Mesh<Dim>& mesh, Index cell, const Vec<Dim>& xi);

/// Particles that know their cell and perhaps their volume.
template <int Dim>
struct NewParticles {
  std::vector<Vec<Dim>> x;
  std::vector<Index> cell;     ///< -1 = not yet known
  std::vector<double> volume;  ///< 0 = not yet known
  int parts = 0;               ///< GeneratorRows::parts
};

/// Particles at the Gauss points (physics/mesh/element.h) of the cells, in the order given.
template <int Dim>
NewParticles<Dim> fill_cells(const Mesh<Dim>& mesh, std::span<const Index> cells, int n);

/// So many particles may be held by each member of a team; `too_many(n)` is called where there are
/// n or more of all members instead, and throws.
struct ParticleLimit {
  Index of_member = std::numeric_limits<Index>::max();
  std::function<void(Index)> too_many = {};
};

/// Which part of a cell that a region cuts gets a particle, and of which volume: all of a part
/// whose centre is inside; or what of a part lies inside, for Q4 and H8.
enum class CutCells { centres, exact };

/// Each cell is cut into n^Dim equal parts of the natural coordinates; those that lie in the region
/// (io/scenario/region_parts.h) get a particle with their volume. The first axis runs fastest. Of a
/// team, each member gets its part of the particles, equal to the others' but for one. Collective.
template <int Dim>
NewParticles<Dim> fill_region(const Mesh<Dim>& mesh, const Region<Dim>& region, int n,
                              const Team& team = Team(), const ParticleLimit& limit = {},
                              CutCells cut = CutCells::centres);

/// Fill in the cells that are not known: the suggested one (-1 = none) if it contains the particle,
/// else the lowest that does. Returns the particles that no cell contains.
template <int Dim>
std::vector<Index> place(const Mesh<Dim>& mesh, const std::vector<Index>& suggested,
                         ParticleTable<Dim>& particles);

/// Fill in the volumes that are not known (0): cell volume / number of particles in the cell, those
/// of all members of the team. Collective.
template <int Dim>
void share_volumes(const Mesh<Dim>& mesh, const Team& team, ParticleTable<Dim>& particles);

/// Two points at exactly the same place; {-1, -1} if there are none. Of several pairs, the one with
/// the lowest numbers.
template <int Dim>
std::pair<Index, Index> find_coincident(const std::vector<Vec<Dim>>& points);

/// The same among the points of all members of a team. Collective.
template <int Dim>
std::pair<Index, Index> find_coincident(const std::vector<Vec<Dim>>& points,
                                        const RowShares& shares, const Team& team);

}  // namespace lahar
