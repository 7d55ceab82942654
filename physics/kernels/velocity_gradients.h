/// \file Velocity gradients of the particles of some bins, from one kernel for another.
#pragma once

#include <array>
#include <vector>

#include "physics/base/simd.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Laws take gradients from here where functions are not those of Q4 and H8: they are compiled for
/// one kind of cell more, not for every basis.
template <int Dim>
struct VelocityGradients {
  std::vector<Local> first;  ///< by position of the bin: where its particles begin, in whole packs
  std::array<NodeArray, static_cast<std::size_t>(Dim) * Dim> L;  ///< Dim a + b: dv_a/dx_b [1/s]
  NodeArray trace;  ///< [1/s] at the particle, or that of the cell (Analysis::volume_as_cbgeo)
  NodeArray hoop;   ///< [1/s] v_r / r of axisymmetric models (ring.h)

  /// Room for the particles of these bins, in packs of so many lanes.
  void make_room(ParticleBins bins, int lanes) {
    first.clear();
    Local size = 0;
    for (const ParticleBin& bin : bins) {
      first.push_back(size);
      size += (bin.end - bin.begin + lanes - 1) / lanes * lanes;
    }
    const auto room = static_cast<std::size_t>(size);
    if (trace.size() >= room) return;
    for (NodeArray& row : L) row.resize(room);
    trace.resize(room);
  }
  void make_room_for_hoop() {
    if (hoop.size() < trace.size()) hoop.resize(trace.size());
  }
  /// Where those of a bin begin.
  LAHAR_INLINE std::size_t begin(const ParticleBin& bin, ParticleBins bins) const {
    return static_cast<std::size_t>(first[static_cast<std::size_t>(&bin - bins.data())]);
  }
  template <class Real>
  LAHAR_INLINE void put(std::size_t at, const Real (&gradient)[Dim][Dim], const Real& trace_there) {
    LAHAR_UNROLL
    for (std::size_t k = 0; k < L.size(); ++k) store(gradient[k / Dim][k % Dim], &L[k][at]);
    store(trace_there, &trace[at]);
  }
};

/// Fill `gradients` with those of the nodal velocities at particles, with any functions.
template <int Dim, class Real = Pack>
void find_particle_gradients(const Patch<Dim>& patch, const StepContext<Dim>& step,
                             ParticleBins bins, VelocityGradients<Dim>& gradients);

}  // namespace lahar
