/// \file CPDI: functions of a particle whose domain is a parallelogram or parallelepiped,
/// interpolated linearly from its corners (Sadeghirad, Brannon & Burghardt 2011).
#pragma once

#include <array>
#include <cstdint>

#include "physics/tensor_basis.h"

namespace lahar {

/// N_i = sum_c N_i(x_c) / corners, grad N_i = the mean over the domain of the gradient of what is
/// interpolated from its corners, both with the linear functions of the grid. The edges' halves are
/// the vectors Column::vectors. A domain that reaches beyond the cells around the particle's is
/// taken smaller, about its middle, so that it fits.
template <int Dim>
struct CpdiBasis {
  static constexpr int nodes = tensor_nodes<Dim>;
  static constexpr bool volume_at_centre = false;

  CartesianMap<Dim> map;
  unsigned border;  ///< PatchTopology::support_border
  std::array<const double*, static_cast<std::size_t>(Dim) * Dim> vectors;

  template <class Real>
  LAHAR_INLINE void functions(Local p, Real (&N)[nodes]) const {
    Real s[Dim], r[Dim][Dim];
    domain(p, s, r);
    for (Real& n : N) n = Real(0.0);
    for (int c = 0; c < corners<Dim>; ++c) {
      Real hat[Dim][axis_nodes];
      hats(s, r, c, hat);
      for (int i = 0; i < nodes; ++i) N[i] += (1.0 / corners<Dim>)*product(hat, i);
    }
  }
  template <class Real>
  LAHAR_INLINE void gradients(Local p, Real (&dN)[Dim][nodes]) const {
    Real s[Dim], r[Dim][Dim], J[Dim][Dim], inv[Dim][Dim];
    domain(p, s, r);
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) J[d][k] = r[k][d] * (1.0 / map.per_length[d]);
    inverse(J, inv, 1.0 / corners<Dim>);
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      // Lanes without a particle have no domain: they must not spoil sums.
      const unsigned bad = outside(inv[k][d], 1e200, lanes<Real>);
      inv[k][d] = select(bad, Real(0.0), inv[k][d]);
      LAHAR_UNROLL
      for (int i = 0; i < nodes; ++i) dN[d][i] = Real(0.0);
    }
    for (int c = 0; c < corners<Dim>; ++c) {
      Real hat[Dim][axis_nodes], slope[Dim];
      hats(s, r, c, hat);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) {
        slope[d] = Real(0.0);
        LAHAR_UNROLL
        for (int k = 0; k < Dim; ++k) slope[d] += sign(c, k) * inv[k][d];
      }
      for (int i = 0; i < nodes; ++i) {
        const Real N = product(hat, i);
        LAHAR_UNROLL
        for (int d = 0; d < Dim; ++d) dN[d][i] += slope[d] * N;
      }
    }
  }

 private:
  static constexpr double sign(int c, int k) { return c >> k & 1 ? 1.0 : -1.0; }
  template <class Real>
  LAHAR_INLINE static Real product(const Real (&w)[Dim][axis_nodes], int i) {
    Real value = w[0][i & 3] * w[1][i >> 2 & 3];
    if constexpr (Dim == 3) value *= w[2][i >> 4 & 3];
    return value;
  }

  /// Place of the particle and vectors of its domain, in lengths of the cell from its low corner.
  template <class Real>
  LAHAR_INLINE void domain(Local p, Real (&s)[Dim], Real (&r)[Dim][Dim]) const {
    map.natural(p, s);
    Real scale(1.0);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      s[d] = 0.5 + 0.5 * s[d];
      Real extent(0.0);
      LAHAR_UNROLL
      for (int k = 0; k < Dim; ++k) {
        r[k][d] =
            map.per_length[d] * load<Real>(vectors[static_cast<std::size_t>(Dim * k + d)] + p);
        extent += max(r[k][d], -r[k][d]);
      }
      const Real reach = -max(-(1.0 + s[d]), s[d] - 2.0);
      scale = -max(-scale, -(reach / max(extent, Real(1e-9))));
    }
    LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) r[k][d] *= scale;
  }

  /// Linear functions of the nodes along each axis at corner c of the domain.
  template <class Real>
  LAHAR_INLINE void hats(const Real (&s)[Dim], const Real (&r)[Dim][Dim], int c,
                         Real (&hat)[Dim][axis_nodes]) const {
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      Real x = s[d];
      LAHAR_UNROLL
      for (int k = 0; k < Dim; ++k) x += sign(c, k) * r[k][d];
      LAHAR_UNROLL
      for (int k = 0; k < axis_nodes; ++k) {
        const Real away = x - (k - 1.0);
        hat[d][k] = max(Real(0.0), 1.0 - max(away, -away));
      }
    }
    fold_at_border<Dim>(border, hat);
  }
};

template <int Dim>
class CpdiCells {
 public:
  explicit CpdiCells(const Patch<Dim>& patch)
      : cells_(patch),
        border_(patch.topology.support_border.data()),
        vectors_(patch.particles.template rows<Dim * Dim>(Column::vectors)) {}
  LAHAR_INLINE CpdiBasis<Dim> operator[](Local cell) const {
    return {cells_[cell], border_[cell], vectors_};
  }

 private:
  CartesianCells<Dim> cells_;
  const std::uint8_t* border_;
  std::array<const double*, static_cast<std::size_t>(Dim) * Dim> vectors_;
};

}  // namespace lahar
