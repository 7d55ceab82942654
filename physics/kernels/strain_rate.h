/// \file Strain rates of velocity gradients.
#pragma once

#include <array>

#include "physics/base/simd.h"
#include "physics/particles/columns.h"

namespace lahar {

/// Rows of a stress of the components that the column of strains has.
template <int Dim>
inline constexpr std::array<int, strain_components<Dim>> strain_voigt = [] {
  if constexpr (Dim == 2)
    return std::array<int, 3>{0, 1, 3};
  else
    return std::array<int, 6>{0, 1, 2, 3, 4, 5};
}();

/// Strain rate with engineering shear from the velocity gradient; Voigt rows of a stress.
template <int Dim, class Real>
LAHAR_INLINE void strain_rate(const Real (&L)[Dim][Dim], Real (&rate)[stress_components<Dim>]) {
  rate[0] = L[0][0];
  rate[1] = L[1][1];
  if constexpr (Dim == 2) {
    rate[2] = Real(0.0);
    rate[3] = L[0][1] + L[1][0];
  } else {
    rate[2] = L[2][2];
    rate[3] = L[0][1] + L[1][0];
    rate[4] = L[1][2] + L[2][1];
    rate[5] = L[0][2] + L[2][0];
  }
}

}  // namespace lahar
