/// \file Partitions by Scotch: fewer shared nodes between ranks than chunks of the curve.
#pragma once

#include <span>
#include <vector>

#include "runtime/patches/rank_partition.h"

namespace lahar {

/// Owner of every patch, by multilevel partitioning: ranks about equally heavy, few nodes shared
/// between them. One thread; equal results for equal input.
/// F. Pellegrini, J. Roman, "Scotch: a software package for static mapping by dual recursive
/// bipartitioning of process and architecture graphs", HPCN 1996.
/// Throws std::invalid_argument unless ranks > 0, std::runtime_error with Scotch's words if it
/// fails.
std::vector<int> scotch_partition(const PatchGraph& graph, int ranks);

/// The same near the present owners (-1 = a patch that is new): a patch that moves counts as
/// `migration_weight` shared nodes per byte.
/// S. Fourestier, F. Pellegrini, "Adaptation au repartitionnement de graphes d'une methode
/// d'optimisation globale par diffusion", RenPar 2011.
std::vector<int> scotch_repartition(const PatchGraph& graph, std::span<const int> owner,
                                    std::span<const Index> bytes, int ranks,
                                    double migration_weight);

}  // namespace lahar
