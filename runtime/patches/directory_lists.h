/// \file What a scenario says of nodes and cells: each rank keeps some of it (directory_rank()),
/// and patches get theirs when they are made.
#pragma once

#include <vector>

#include "physics/model/model.h"
#include "runtime/comm/communicator.h"

namespace lahar {

/// Keep what this rank is to keep of what it has, in the order in which it is looked for. No rank
/// needs more than that, and each may have more.
template <int Dim>
void keep_directory_lists(Model<Dim>& model, const Communicator& ranks);

/// Constraints and loads of some nodes (ascending), in order; other lists stay where they are.
/// Collective.
template <int Dim>
NodeConditions<Dim> conditions_at(const std::vector<Index>& nodes, const NodeConditions<Dim>& kept,
                                  const Communicator& ranks);

/// Cells into which particles are injected, with these particles.
template <int Dim>
struct InjectedCells {
  struct Entry {
    Index cell;
    std::size_t generator;  ///< index into Model::injections
    Index event;            ///< physics/model/injection.h
    double volume;          ///< [m^3] of each particle
    std::size_t first_point;
  };
  std::vector<Entry> cells;  ///< ascending cells and events
  std::vector<Vec<Dim>> x;   ///< [m] Injection::per_cell for each
};

/// Those that this rank keeps.
template <int Dim>
InjectedCells<Dim> kept_injections(const std::vector<Injection<Dim>>& injections);

/// Those among some cells (ascending). Collective.
template <int Dim>
InjectedCells<Dim> injections_at(const std::vector<Index>& cells, const InjectedCells<Dim>& kept,
                                 const std::vector<Injection<Dim>>& injections,
                                 const Communicator& ranks);

#define LAHAR_DECLARE(Dim)                                                                      \
  extern template void keep_directory_lists(Model<Dim>&, const Communicator&);                  \
  extern template NodeConditions<Dim> conditions_at(                                            \
      const std::vector<Index>&, const NodeConditions<Dim>&, const Communicator&);              \
  extern template InjectedCells<Dim> kept_injections(const std::vector<Injection<Dim>>&);       \
  extern template InjectedCells<Dim> injections_at(                                             \
      const std::vector<Index>&, const InjectedCells<Dim>&, const std::vector<Injection<Dim>>&, \
      const Communicator&);
LAHAR_DECLARE(2)
LAHAR_DECLARE(3)
#undef LAHAR_DECLARE

}  // namespace lahar
