/// \file How many particles a stage changed when it began.
#pragma once

#include <array>
#include <vector>

#include "physics/base/types.h"

namespace lahar {

/// Particles, and their mass with the liquid in their pores.
struct ParticleCount {
  Index particles = 0;
  double mass = 0;  ///< [kg]
};

/// Cells that hold more than they have room for, since particles were placed where others are.
struct OccupiedCells {
  Index cells = 0;
  Index particles = 0;            ///< that were placed in them
  double most = 0;                ///< volume of the particles of a cell over its own [-]
  std::array<double, 3> place{};  ///< [m] a particle in that cell
};

/// Of all ranks. Lists are in the order of StageChanges; a particle counts where it was removed
/// first, and where it got its last material.
struct ChangedParticles {
  std::vector<ParticleCount> removed, materials;
  ParticleCount placed;
  OccupiedCells occupied;
  /// The stage before stored no strains: those of its particles begin at zero, though the stage
  /// does not reset them.
  bool lost_strains = false;
};

}  // namespace lahar
