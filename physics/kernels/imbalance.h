/// \file How far a patch is from equilibrium: forces that are not in balance, and loads.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Whether equilibrium of an explicit run is tested when so many steps are done: after the first
/// step, and then once in a hundred. Each test drains the graph.
inline constexpr Index rest_steps = 100;
constexpr bool tests_rest(Index done) {
  return done == 1 || (done > 0 && done % rest_steps == 0);
}

/// In a step that a test follows, set Patch::unbalanced from the accelerations that integration
/// gave nodes: sum of |m a|, of the liquid in pores too. What holds nodes and walls balances its
/// part of the forces. Local damping takes its share of the others, which is given back. A node is
/// shared among patches as its mass is.
template <int Dim>
void find_unbalanced(Patch<Dim>& patch, const StepContext<Dim>& step);

/// The same of an implicit step whose system is known, for its increment [N].
template <int Dim>
double unbalanced_in_system(const Patch<Dim>& patch);

/// Sum of the magnitudes of loads: weights, tractions and forces at nodes [N].
template <int Dim>
double loads_on(const Patch<Dim>& patch, const StepContext<Dim>& step);

#define LAHAR_DECLARE(Dim)                                                         \
  extern template void find_unbalanced<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  extern template double unbalanced_in_system<Dim>(const Patch<Dim>&);             \
  extern template double loads_on<Dim>(const Patch<Dim>&, const StepContext<Dim>&);
LAHAR_DECLARE(2)
LAHAR_DECLARE(3)
#undef LAHAR_DECLARE

}  // namespace lahar
