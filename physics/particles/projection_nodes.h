/// \file What nodes keep while velocities are made free of divergence
/// (physics/kernels/projection.h).
#pragma once

#include <cstdint>
#include <vector>

#include "physics/particles/patch_work.h"

namespace lahar {

/// By local node; vectors are complete: all copies of a node have the same bits.
struct ProjectionNodes {
  std::vector<double> space;       ///< [m^3] of the mesh's cells around the node
  std::vector<std::uint8_t> ends;  ///< bit per axis: a mesh of boxes ends there
  std::vector<double> volume;      ///< [m^3] sum_p N_i V_p
  /// [-] by axis, shares of the discharge of light nodes whose v* lack what forces gave them; only
  /// with a liquid in pores.
  std::vector<double> unforced;
  std::vector<double> change;  ///< [Pa] of the pressure in the step; before the solve what is given
  /// [Pa] at the end of the step, by means of particles; only with a liquid in pores of whose
  /// pressure all is kept.
  std::vector<double> level;
  std::vector<double> filled;  ///< [-] by local cell, share that particles fill at the beginning
  PatchWork work;              ///< before the step
  bool begins = false;         ///< in the first step, with pressures that drain_surfaces() left
};

}  // namespace lahar
