/// \file A mesh file that a team reads together.
#pragma once

#include <optional>
#include <vector>

#include "io/base/side_files.h"
#include "io/base/team.h"
#include "physics/mesh/mesh.h"

namespace lahar {

/// What one member keeps of the nodes and cells of a mesh.
template <int Dim>
struct MeshRows {
  Index n_nodes = 0, n_cells = 0;
  std::vector<Vec<Dim>> nodes;    ///< [m] of Team::part() of the nodes
  std::vector<Local> cell_nodes;  ///< ids, of Team::part() of the cells, one cell after the other
};

/// As read_mesh_file(), every member a part of the lines, some at a time; nothing if anything is
/// wrong, and then `problems` does not say what. Collective.
template <int Dim>
std::optional<MeshRows<Dim>> read_mesh_rows(const SideFile& file, int nodes_per_cell,
                                            const Team& team, ProblemList& problems);

/// Where some nodes are [m], which any member may have. Collective.
template <int Dim>
std::vector<Vec<Dim>> find_nodes(const MeshRows<Dim>& rows, const std::vector<Local>& nodes,
                                 const Team& team);

/// The share with a member's rows: it gets the nodes of its cells. Throws InputError if a cell is
/// not as it should be. Collective; cell_nodes are taken.
template <int Dim>
Mesh<Dim> make_share(MeshRows<Dim>& rows, Element element, bool isoparametric, const Team& team);

#define LAHAR_DECLARE(Dim)                                                                       \
  extern template std::optional<MeshRows<Dim>> read_mesh_rows(const SideFile&, int, const Team&, \
                                                              ProblemList&);                     \
  extern template std::vector<Vec<Dim>> find_nodes(const MeshRows<Dim>&,                         \
                                                   const std::vector<Local>&, const Team&);      \
  extern template Mesh<Dim> make_share(MeshRows<Dim>&, Element, bool, const Team&);
LAHAR_DECLARE(2)
LAHAR_DECLARE(3)
#undef LAHAR_DECLARE

}  // namespace lahar
