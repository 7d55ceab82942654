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

}  // namespace lahar
