/// \file Values of a pack of particles, particle by particle: for kernels whose lanes are
/// components of nodes.
#pragma once

#include "physics/base/simd.h"
#include "physics/basis/basis.h"
#include "physics/particles/patch.h"

namespace lahar::general {

/// The components of two nodes.
using NodePair = PackOf<2 * node_width>;

/// Four values of each particle of a pack.
template <class Real>
struct RowsOfFour {
  static_assert(node_width == 4 && axis_nodes == 4);
  alignas(64) double row[lanes<Real>][4];

  LAHAR_INLINE void set(const Real (&value)[4]) {
    if constexpr (lanes<Real> == 8) {
      NodeVector rows[8];
      transpose(value, rows);
      LAHAR_UNROLL
      for (int j = 0; j < 8; ++j) store(rows[j], row[j]);
    } else {
      for (int j = 0; j < lanes<Real>; ++j)
        for (int k = 0; k < 4; ++k) row[j][k] = value[k][j];
    }
  }
};

/// Components of each particle of a pack.
template <class Real>
struct ParticleRows : RowsOfFour<Real> {
  /// Values of particle j, for both nodes of a pair.
  LAHAR_INLINE NodePair operator[](Local j) const { return broadcast_four(this->row[j]); }
};

}  // namespace lahar::general
