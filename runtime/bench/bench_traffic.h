/// \file Bytes of particle data that a time step cannot avoid to move.
#pragma once

#include <vector>

#include "physics/model/model.h"
#include "physics/particles/columns.h"

namespace lahar {

/// The work between two exchanges. A patch's particles pass through the cache once in it.
struct TrafficPhase {
  const char* what;
  std::vector<Column> reads, writes;
};

// clang-format off
/// Phases of one step of linear elastic material, from one exchange to the next, cyclic:
///
///     scheme  phase                                    reads                       writes
///     USL     integrate stress G2P locate P2G force    x v u stress volume mass    x v u stress volume
///     USF     velocity stress force                    x stress volume             stress volume
///             integrate G2P locate P2G                 x v u mass                  x v u
///     MUSL    integrate G2P P2G remap                  x xi v u mass               x v u
///             velocity stress locate P2G force         x xi v stress volume mass   xi stress volume
///
/// A mesh of general cells keeps the natural coordinates xi: read instead of x where x stays, read
/// and written where x changes. What can be computed from these columns (strain, natural
/// coordinates in a box) or is per bin (cell, material) is not counted. Affine parts of velocities
/// are read with v and written where it is. A liquid in pores has its velocity where x changes and
/// its pressure where stress does, both read and written. Domains of particles are read in every phase, and those
/// that stretch are written with stress and with x.
// clang-format on
std::vector<TrafficPhase> traffic_phases(const Analysis& analysis, bool cartesian);

/// [B] per particle-step: every column of a phase moves once for reading and once for writing. All
/// written columns are read before, so no line is fetched only to be overwritten. Nodal values
/// (about a tenth of this) are left out: the true traffic is higher.
template <int Dim>
double bytes_per_particle_step(const Analysis& analysis, bool cartesian);

}  // namespace lahar
