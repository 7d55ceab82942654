/// \file What is said of a linear system that was not solved.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "runtime/patches/patch_set.h"
#include "runtime/solve/solve_result.h"

namespace lahar {

/// What a message says of |b - A x| at a node.
template <int Dim>
using LeftOver = std::function<double(const Patch<Dim>& patch, std::size_t node, double left)>;

/// "conjugate gradients: too many iterations (12 iterations, relative residual 0.3); most is left
/// at node 5 (0.1, 0.2), 3.4 N", after SystemSolver::solve() of Patch::system. Where nodes have a
/// right side, but no equation, it is the largest of these. `in_unit` makes what is left of
/// |b - A x|. Collective.
template <int Dim>
std::string describe_unsolved(const SolveResult& result, const PatchSet<Dim>& patches,
                              const Mesh<Dim>& mesh, const Communicator& ranks,
                              std::string_view unit, const LeftOver<Dim>& in_unit);

}  // namespace lahar
