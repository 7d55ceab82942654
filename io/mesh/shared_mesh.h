/// \file A mesh from tables that a team has together: each member a share with an equal part of the
/// cells, in the order of their ids (Mesh::share()).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "io/base/team.h"
#include "physics/mesh/mesh.h"

namespace lahar {

/// The cells [first, second) that this member has of a mesh with n; nodes likewise, while it is
/// made.
inline std::pair<Index, Index> own_cells(Index n, const Team& team) {
  return {team.part(n, team.index()), team.part(n, team.index() + 1)};
}

/// Complete shares with what follows from all of them. Collective.
template <int Dim>
void complete_shares(Mesh<Dim>& share, const Team& team);

/// A member's share of a whole mesh that all have.
template <int Dim>
Mesh<Dim> share_of(const Mesh<Dim>& whole, const Team& team);

/// The smallest Mesh::cell_size() of all cells [m]. Collective, unless the mesh is structured or
/// this member has all of it.
template <int Dim>
double smallest_cell(const Mesh<Dim>& mesh, const Team& team);

/// Cells (ascending) with their nodes, in pieces for Mesh::part() and Mesh::share(). Collective;
/// each member asks for those that it wants.
template <int Dim>
std::vector<std::vector<std::byte>> fetch_cells(const Mesh<Dim>& share,
                                                const std::vector<Index>& cells, const Team& team);

/// To whom cells of a share belong: nodes, bins, or whatever else has a number. The lists are
/// spread over the members.
class CellIndex {
 public:
  /// Calls `owners(cell, add)`, which calls add(number), for each own cell of a mesh with n.
  /// Collective.
  using Add = std::function<void(Index number)>;
  CellIndex(Index n_cells, const Team& team,
            const std::function<void(Index cell, const Add& add)>& owners);

  /// All cells of some owners, ascending, each once. Collective.
  std::vector<Index> cells_of(const std::vector<Index>& owners) const;

 private:
  const Team& team_;
  std::vector<std::uint64_t> entries_;  ///< owner / members, then cell: ascending
};

/// The cells of the mesh that have some node, as a CellIndex. Collective.
template <int Dim>
CellIndex index_nodes(const Mesh<Dim>& share, const Team& team);
/// The cells that touch some bin.
template <int Dim>
CellIndex index_bins(const Mesh<Dim>& share, const Team& team);

/// As Mesh::widened(), of cells (ascending) that any member may have. Collective.
template <int Dim>
std::vector<Index> widened(const Mesh<Dim>& share, const CellIndex& of_nodes,
                           std::vector<Index> cells, int layers, const Team& team);

#define LAHAR_DECLARE(Dim)                                                       \
  extern template void complete_shares(Mesh<Dim>&, const Team&);                 \
  extern template Mesh<Dim> share_of(const Mesh<Dim>&, const Team&);             \
  extern template double smallest_cell(const Mesh<Dim>&, const Team&);           \
  extern template std::vector<std::vector<std::byte>> fetch_cells(               \
      const Mesh<Dim>&, const std::vector<Index>&, const Team&);                 \
  extern template CellIndex index_nodes(const Mesh<Dim>&, const Team&);          \
  extern template CellIndex index_bins(const Mesh<Dim>&, const Team&);           \
  extern template std::vector<Index> widened(const Mesh<Dim>&, const CellIndex&, \
                                             std::vector<Index>, int, const Team&);
LAHAR_DECLARE(2)
LAHAR_DECLARE(3)
#undef LAHAR_DECLARE

}  // namespace lahar
