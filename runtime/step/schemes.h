/// \file Schemes whose steps begin with a solve.
#pragma once

#include "runtime/step/stages.h"

namespace lahar {

/// What an implicit step does before its time step (timestep()) moves particles.
template <int Dim>
struct ImplicitStages {
  Stages<Dim> begin;      ///< once: particles to nodes
  Stages<Dim> linearize;  ///< before each linear solve
};
template <int Dim>
ImplicitStages<Dim> implicit_stages(const Analysis& analysis);
/// What a projection does before its time step: velocities without the change of the pressure, and
/// the linear system for it.
template <int Dim>
Stages<Dim> projection_stages(const Analysis& analysis);
/// All of them and those of linear solves, for message_of_sums().
template <int Dim>
void append_solver_stages(const Analysis& analysis, Stages<Dim>& all);

}  // namespace lahar
