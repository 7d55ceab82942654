/// \file Small systems: one rank gets all of the matrix and solves it directly.
#pragma once

#include "runtime/comm/communicator.h"
#include "runtime/patches/patch_set.h"
#include "runtime/solve/solve_result.h"

namespace lahar {

/// Finds NodalSystem::solution on all patches. Unknowns that are held, or whose row is zero, are
/// left out. Parts of the matrix are added in ascending patch id, so that bits do not depend on
/// ranks. Where it finds none, SolverVectors::r is what is left, and SolverVectors::inverse is not
/// zero where there is a row. Collective, between rounds.
template <int Dim>
SolveResult solve_directly(PatchSet<Dim>& patches, const Communicator& ranks, bool symmetric,
                           double tolerance);

}  // namespace lahar
