/// \file Linear functions of Q4 and H8 as a basis, for what their own kernels do not do.
#pragma once

#include "physics/basis/cell_map.h"

namespace lahar {

template <int Dim, class Map>
struct LinearBasis {
  static constexpr int nodes = corners<Dim>;
  static constexpr bool volume_at_centre = true;

  Map map;

  template <class Real>
  LAHAR_INLINE void functions(Local p, Real (&N)[nodes]) const {
    const auto w = weights_at<Dim, Real>(map, p);
    LAHAR_UNROLL
    for (int i = 0; i < nodes; ++i) N[i] = w.N(i);
  }
  template <class Real>
  LAHAR_INLINE void gradients(Local p, Real (&dN)[Dim][nodes]) const {
    Real one[Dim][Dim], ds[Dim][Dim];  // ds[k][d] = ds_k/dx_d
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) one[k][d] = Real(k == d ? 1.0 : 0.0);
    map.to_physical(p, one, ds);
    to_gradients(weights_at<Dim, Real>(map, p), ds, dN);
  }
  LAHAR_INLINE void centre_gradients(double (&dN)[Dim][nodes]) const {
    lahar::centre_gradients(map, dN);
  }

 private:
  template <class Real>
  LAHAR_INLINE static void to_gradients(const Weights<Dim, Real>& w, const Real (&ds)[Dim][Dim],
                                        Real (&dN)[Dim][nodes]) {
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) LAHAR_UNROLL
    for (int i = 0; i < nodes; ++i) dN[d][i] = Real(0.0);
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
    for (int c = 0; c < face_corners<Dim>; ++c) {
      const Real face = w.face(k, c);
      const int i = face_to_corner(k, c);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) {
        dN[d][i] -= face * ds[k][d];
        dN[d][i | (1 << k)] += face * ds[k][d];
      }
    }
  }
};

/// Makes the bases of a patch's cells; `Cells` makes their maps.
template <int Dim, class Cells>
class LinearCells {
 public:
  explicit LinearCells(const Patch<Dim>& patch) : cells_(patch) {}
  LAHAR_INLINE auto operator[](Local cell) const {
    return LinearBasis<Dim, std::decay_t<decltype(cells_[cell])>>{cells_[cell]};
  }

 private:
  Cells cells_;
};

}  // namespace lahar
