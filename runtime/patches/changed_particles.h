/// \file How many particles a stage changed when it began.
#pragma once

#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Particles, and their mass with the liquid in their pores.
struct ParticleCount {
  Index particles = 0;
  double mass = 0;  ///< [kg]
};

/// Of all ranks. Lists are in the order of StageChanges; a particle counts where it was removed
/// first, and where it got its last material.
struct ChangedParticles {
  std::vector<ParticleCount> removed, materials;
  ParticleCount placed;
};

}  // namespace lahar
