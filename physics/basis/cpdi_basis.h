/// \file CPDI: functions of a particle whose domain has corners, from which they are interpolated
/// (cpdi_domain.h): parallelograms and parallelepipeds that deform with the particle (CPDI), or
/// quadrilaterals and hexahedra whose corners move one by one (CPDI2).
#pragma once

#include <array>
#include <cstdint>

#include "physics/basis/cpdi_domain.h"
#include "physics/basis/tensor_basis.h"

namespace lahar {

/// N_i = sum_c w_c N_i(x_c), grad N_i = sum_c slope_c N_i(x_c) with the linear functions of the
/// grid. A domain that reaches beyond the cells around the particle's is taken smaller, about the
/// particle, so that it fits.
template <int Dim, template <int, class> class Domain>
struct CpdiBasis {
  static constexpr int nodes = tensor_nodes<Dim>;
  static constexpr bool volume_at_centre = false;
  static constexpr int vectors = Domain<Dim, Scalar>::vectors;
  template <class Real>
  using DomainOf = Domain<Dim, Real>;
  using Rows = std::array<const double*, static_cast<std::size_t>(vectors) * Dim>;

  CartesianMap<Dim> map;
  unsigned border;  ///< PatchTopology::support_border
  Rows rows;        ///< Dim k + d: component d of the domain's vector k [m]

  template <class Real>
  LAHAR_INLINE void functions(Local p, Real (&N)[nodes]) const {
    Real s[Dim], w[corners<Dim>];
    Domain<Dim, Real> domain;
    find_domain(p, s, domain);
    domain.weights(w);
    if constexpr (Dim == 2) {  // see CornerNodes
      for (Real& n : N) n = Real(0.0);
      for (int c = 0; c < corners<Dim>; ++c) {
        Real hat[Dim][axis_nodes];
        const Real weight = no_domain_is_zero(w[c]);
        hats(s, domain, c, hat);
        for (int i = 0; i < nodes; ++i) N[i] += weight * product(hat, i);
      }
      return;
    }
    alignas(64) double sum[nodes][lanes<Real>] = {};
    for (int c = 0; c < corners<Dim>; ++c) {
      alignas(64) double weight[lanes<Real>];
      store(no_domain_is_zero(w[c]), weight);
      const CornerNodes<Real> at(*this, s, domain, c);
      for (int j = 0; j < lanes<Real>; ++j)
        at.for_each(j, [&](int i, double N_c) { sum[i][j] += weight[j] * N_c; });
    }
    for (int i = 0; i < nodes; ++i) N[i] = load<Real>(sum[i]);
  }
  template <class Real>
  LAHAR_INLINE void gradients(Local p, Real (&dN)[Dim][nodes]) const {
    Real s[Dim], slope[corners<Dim>][Dim];
    Domain<Dim, Real> domain;
    find_domain(p, s, domain);
    domain.slopes(slope);
    if constexpr (Dim == 2) {
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d)
        for (int i = 0; i < nodes; ++i) dN[d][i] = Real(0.0);
      for (int c = 0; c < corners<Dim>; ++c) {
        Real hat[Dim][axis_nodes];
        hats(s, domain, c, hat);
        LAHAR_UNROLL
        for (int d = 0; d < Dim; ++d)
          slope[c][d] = no_domain_is_zero(Real(slope[c][d] * map.per_length[d]));
        for (int i = 0; i < nodes; ++i) {
          const Real N = product(hat, i);
          LAHAR_UNROLL
          for (int d = 0; d < Dim; ++d) dN[d][i] += slope[c][d] * N;
        }
      }
      return;
    }
    alignas(64) double sum[Dim][nodes][lanes<Real>] = {};
    for (int c = 0; c < corners<Dim>; ++c) {
      alignas(64) double slope_c[Dim][lanes<Real>];
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d)
        store(no_domain_is_zero(Real(slope[c][d] * map.per_length[d])), slope_c[d]);
      const CornerNodes<Real> at(*this, s, domain, c);
      for (int j = 0; j < lanes<Real>; ++j)
        at.for_each(j, [&](int i, double N_c) {
          LAHAR_UNROLL
          for (int d = 0; d < Dim; ++d) sum[d][i][j] += slope_c[d][j] * N_c;
        });
    }
    for (int d = 0; d < Dim; ++d)
      for (int i = 0; i < nodes; ++i) dN[d][i] = load<Real>(sum[d][i]);
  }

  /// Places of the nodes from the particle, in lengths of the cell, are i_d - 1 - s_d with the
  /// node's numbers i_d along the axes and s from 0 to 1 across the cell.
  template <class Real>
  LAHAR_INLINE void place(Local p, Real (&s)[Dim]) const {
    map.natural(p, s);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) s[d] = 0.5 + 0.5 * s[d];
  }
  static constexpr int number(int i, int d) { return i >> (2 * d) & 3; }
  double cell_length(int d) const { return 1.0 / map.per_length[d]; }

  /// Velocities of the domain's corners less that of the particle: those of the nodes `v` where the
  /// corners are. Where the domain is taken smaller, the velocity is continued linearly to its
  /// corners.
  template <class Real>
  LAHAR_INLINE void corner_velocities(Local p, const double* v, const Local* node,
                                      const Real (&v_p)[Dim],
                                      Real (&relative)[corners<Dim>][Dim]) const {
    Real s[Dim];
    Domain<Dim, Real> domain;
    const Real larger = 1.0 / find_domain(p, s, domain);
    if constexpr (Dim == 2) {
      for (int c = 0; c < corners<Dim>; ++c) {
        Real hat[Dim][axis_nodes];
        hats(s, domain, c, hat);
        LAHAR_UNROLL
        for (Real& sum : relative[c]) sum = Real(0.0);
        for (int i = 0; i < nodes; ++i) {
          const Real N = product(hat, i);
          const double* at = v + static_cast<std::ptrdiff_t>(node[i]) * node_width;
          LAHAR_UNROLL
          for (int d = 0; d < Dim; ++d) relative[c][d] = multiply_add(relative[c][d], N, at + d);
        }
        LAHAR_UNROLL
        for (int d = 0; d < Dim; ++d) relative[c][d] = larger * (relative[c][d] - v_p[d]);
      }
      return;
    }
    for (int c = 0; c < corners<Dim>; ++c) {
      alignas(64) double velocity[node_width][lanes<Real>];
      const CornerNodes<Real> at(*this, s, domain, c);
      for (int j = 0; j < lanes<Real>; ++j) {
        NodeVector sum(0.0);
        at.for_each(j, [&](int i, double N_c) {
          sum += N_c * load<NodeVector>(v + static_cast<std::ptrdiff_t>(node[i]) * node_width);
        });
        for (int d = 0; d < Dim; ++d) velocity[d][j] = sum[d];
      }
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) relative[c][d] = larger * (load<Real>(velocity[d]) - v_p[d]);
    }
  }

  /// Place of the particle and its domain, in lengths of the cell from its low corner. Returns by
  /// which factor the domain is smaller than its own.
  template <class Real>
  LAHAR_INLINE Real find_domain(Local p, Real (&s)[Dim], Domain<Dim, Real>& domain) const {
    place(p, s);
    Real scale(1.0);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      LAHAR_UNROLL
      for (int k = 0; k < vectors; ++k)
        domain.r[k][d] =
            map.per_length[d] * load<Real>(rows[static_cast<std::size_t>(Dim * k + d)] + p);
      const Real extent = domain.extent(d);
      const Real reach = -max(-(1.0 + s[d]), s[d] - 2.0);
      scale = -max(-scale, -(reach / max(extent, Real(1e-9))));
    }
    LAHAR_UNROLL
    for (int k = 0; k < vectors; ++k) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) domain.r[k][d] *= scale;
    return scale;
  }

  /// How many cells from the particle's along axis d the one is in which x lies, from 0 to 1 across
  /// the particle's: -1, 0 or 1. Where such a cell does not exist, the one beside it is continued,
  /// as fold_at_border() does.
  template <class Real>
  LAHAR_INLINE Real cells_away(const Real& x, int d) const {
    const bool begins = border >> (2 * d) & 1, ends = border >> (2 * d + 1) & 1;
    const unsigned before = begins ? 0u : greater(Real(0.0), x),
                   beyond = ends ? 0u : greater(x, Real(1.0));
    return select(before, Real(-1.0), select(beyond, Real(1.0), Real(0.0)));
  }

 private:
  /// Lanes without a particle have no domain: they must not spoil sums.
  template <class Real>
  LAHAR_INLINE static Real no_domain_is_zero(const Real& value) {
    return select(outside(value, 1e200, lanes<Real>), Real(0.0), value);
  }
  template <class Real>
  LAHAR_INLINE static Real product(const Real (&w)[Dim][axis_nodes], int i) {
    Real value = w[0][number(i, 0)] * w[1][number(i, 1)];
    if constexpr (Dim == 3) value *= w[2][number(i, 2)];
    return value;
  }

  /// Linear functions of the nodes along each axis at corner c of the domain.
  template <class Real>
  LAHAR_INLINE void hats(const Real (&s)[Dim], const Domain<Dim, Real>& domain, int c,
                         Real (&hat)[Dim][axis_nodes]) const {
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      const Real x = s[d] + domain.corner(c, d);
      LAHAR_UNROLL
      for (int k = 0; k < axis_nodes; ++k) {
        const Real away = x - (k - 1.0);
        hat[d][k] = max(Real(0.0), 1.0 - max(away, -away));
      }
    }
    fold_at_border<Dim>(border, hat);
  }

  /// The nodes of the cell that a corner of the domain is in, and their functions there. Where that
  /// cell does not exist, those of the one beside it are continued, as fold_at_border() does. For
  /// 3D: 8 of 64 nodes matter. In 2D to add to all 16 in packs takes less time.
  template <class Real>
  struct CornerNodes {
    alignas(64) double weight[Dim][2][lanes<Real>];  ///< by axis, of the first and second node
    int first[lanes<Real>];                          ///< number of the first node

    LAHAR_INLINE CornerNodes(const CpdiBasis& basis, const Real (&s)[Dim],
                             const Domain<Dim, Real>& domain, int c) {
      Real number(0.0);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) {
        Real x = s[d] + domain.corner(c, d);
        const Real away = basis.cells_away(x, d);
        x -= away;
        store(1.0 - x, weight[d][0]);
        store(x, weight[d][1]);
        number += (1 << 2 * d) * (1.0 + away);
      }
      for (int j = 0; j < lanes<Real>; ++j) first[j] = static_cast<int>(number[j]);
    }
    /// Call body(i, N) with the numbers and functions of the nodes, for lane j.
    template <class Body>
    LAHAR_INLINE void for_each(int j, Body body) const {
      LAHAR_UNROLL
      for (int k = 0; k < corners<Dim>; ++k) {
        double N = weight[0][k & 1][j];
        int i = first[j];
        LAHAR_UNROLL
        for (int d = 1; d < Dim; ++d) N *= weight[d][k >> d & 1][j];
        LAHAR_UNROLL
        for (int d = 0; d < Dim; ++d) i += (k >> d & 1) << (2 * d);
        body(i, N);
      }
    }
  };
};

/// Makes the bases of a patch's cells; `column` has the vectors of the domains.
template <int Dim, template <int, class> class Domain, Column column>
class CpdiCells {
 public:
  using Basis = CpdiBasis<Dim, Domain>;
  explicit CpdiCells(const Patch<Dim>& patch)
      : cells_(patch),
        border_(patch.topology.support_border.data()),
        rows_(patch.particles.template rows<Dim * Basis::vectors>(column)) {}
  LAHAR_INLINE Basis operator[](Local cell) const { return {cells_[cell], border_[cell], rows_}; }

 private:
  CartesianCells<Dim> cells_;
  const std::uint8_t* border_;
  typename Basis::Rows rows_;
};

/// Whether a basis is one of a particle's domain, and whether the domain's corners move one by one.
template <class Basis>
concept DomainBasis = requires(Basis basis, double* v) {
  basis.rows;
  Basis::vectors;
};
template <int Dim, class Basis>
inline constexpr bool moves_corners = false;
template <int Dim>
inline constexpr bool moves_corners<Dim, CpdiBasis<Dim, Hexahedron>> = true;

}  // namespace lahar
