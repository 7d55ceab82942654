/// \file A field of quadratic B-splines in one cell of a 3D grid as the polynomials that it is.
///
/// Along an axis the four nodes of a cell give, with t = s - 1/2 from -1/2 to 1/2 across it,
///
///     q(t) = a + b t + c min(t, 0)^2 / 2 + d max(t, 0)^2 / 2
///     a = (q_0 + q_1) / 2, b = q_1 - q_0, c = q_-1 - 2 q_0 + q_1, d = q_0 - 2 q_1 + q_2
///
/// where q_0 and q_1 belong to the cell's own nodes. A particle needs only the one of c and d that
/// is of its half: 27 of the 64 coefficients in space, and those of a have the factor 1. What turns
/// nodal values into coefficients is done once for a cell. Beyond a wall of the mesh q goes on
/// straight (fold_first()): c or d is zero.
///
/// The moments of APIC, sum_k q_k w_k (k - s) / D, are the slope of the same polynomials with
/// another weight of c or d. On the three nodes that a particle reaches moments and slopes sum to
/// zero and have the same first moment, so they differ by a multiple of (1, -2, 1); at a wall,
/// where only two nodes are reached, they are the same.
#pragma once

#include "physics/basis/nodal_fields.h"
#include "physics/basis/tensor_basis.h"

namespace lahar::general {

/// A place along an axis of a cell. In q, in dq/dt and in moments a has the weights 1, 0 and 0, and
/// b has t, 1 and 1.
template <class Real>
struct PolynomialWeights {
  Real t, bent;    ///< of b, and of c or d, in q; in dq/dt the latter is t
  Real moment;     ///< of c or d in moments
  unsigned upper;  ///< lanes that need d, not c

  /// From the natural coordinate.
  LAHAR_INLINE explicit PolynomialWeights(const Real& xi)
      : t(0.5 * xi), bent(0.5 * t * t), upper(greater(t, Real(0.0))) {
    // From t' of a particle to the middle one of its nodes: t' (1 - 4 t'^2) / 2, and t' = t +- 1/2.
    const Real h = abs(t);
    moment = t * h * (3.0 - 2.0 * h);
  }
};

/// Nodal velocities of one cell after the other as coefficients.
class SplinePolynomials {
 public:
  template <int Dim>
  LAHAR_INLINE SplinePolynomials(const PatchTopology<Dim>& topology, const double* velocity)
      : follows_(topology.support_follows.data()),
        all_nodes_(topology.support_nodes.data()),
        borders_(topology.support_border.data()),
        v_(velocity) {}

  /// Where a cell follows on the last one along the first axis, three planes of nodes stay.
  LAHAR_INLINE void move_to(Local cell) {
    if (cell == cell_) return;
    const unsigned border = borders_[cell];
    const bool next = cell == cell_ + 1 && follows_[cell] != 0 && border >> 2 == border_ >> 2;
    turned_ = next ? turned_ + 1 : 0;
    cell_ = cell;
    nodes_ = all_nodes_ + static_cast<std::ptrdiff_t>(cell) * tensor_nodes<3>;
    border_ = border;
    for (int k = next ? axis_nodes - 1 : 0; k < axis_nodes; ++k) take_plane(k);
    along_first();
  }

  /// v, L and, with moments, C of a pack of particles at these natural coordinates.
  template <bool Moments, class Real>
  LAHAR_INLINE void at(const Real (&xi)[3], const double (&per_length)[3],
                       Fields<3, Real>& fields) const {
    const PolynomialWeights<Real> x(xi[0]), y(xi[1]), z(xi[2]);
    for (int a = 0; a < 3; ++a) {
      Real v, by_x, by_y, by_z, of_x, of_y, of_z;
      LAHAR_UNROLL
      for (int l = 0; l < needed; ++l) {
        Real sum, sum_x, sum_y, sum_of_x, sum_of_y;
        LAHAR_UNROLL
        for (int k = 0; k < needed; ++k) {
          const Real b = coefficient<Real>(a, 1, k, l, y.upper, z.upper),
                     bent = select(x.upper, coefficient<Real>(a, 3, k, l, y.upper, z.upper),
                                   coefficient<Real>(a, 2, k, l, y.upper, z.upper));
          const Real along =
              fma(x.bent, bent, fma(x.t, b, coefficient<Real>(a, 0, k, l, y.upper, z.upper)));
          const Real slope = fma(x.t, bent, b);
          add(k, along, y, sum);
          add(k, slope, y, sum_x);
          add_slope(k, along, y.t, sum_y);
          if constexpr (Moments) {
            add(k, fma(x.moment, bent, b), y, sum_of_x);
            add_slope(k, along, y.moment, sum_of_y);
          }
        }
        add(l, sum, z, v);
        add(l, sum_x, z, by_x);
        add(l, sum_y, z, by_y);
        add_slope(l, sum, z.t, by_z);
        if constexpr (Moments) {
          add(l, sum_of_x, z, of_x);
          add(l, sum_of_y, z, of_y);
          add_slope(l, sum, z.moment, of_z);
        }
      }
      fields.v[a] = v;
      fields.L[a][0] = per_length[0] * by_x;
      fields.L[a][1] = per_length[1] * by_y;
      fields.L[a][2] = per_length[2] * by_z;
      if constexpr (Moments) {
        fields.C[a][0] = per_length[0] * of_x;
        fields.C[a][1] = per_length[1] * of_y;
        fields.C[a][2] = per_length[2] * of_z;
      }
    }
  }

 private:
  static constexpr int n_rows = axis_nodes * axis_nodes;
  static constexpr int needed = 3;  ///< coefficients along an axis: a, b, and c or d
  using Pair = PackOf<2 * node_width>;

  /// Component a of the coefficient of number i along the first axis, k and l along the second and
  /// third: numbers of PolynomialWeights, those of 2 along the latter being c or d.
  template <class Real>
  LAHAR_INLINE Real coefficient(int a, int i, int k, int l, unsigned upper_k,
                                unsigned upper_l) const {
    const auto at = [&](int k_, int l_) __attribute__((always_inline)) {
      return broadcast<Real>(&coefficient_[i][axis_nodes * l_ + k_][a]);
    };
    const auto along_second = [&](int l_) __attribute__((always_inline)) {
      return k < 2 ? at(k, l_) : select(upper_k, at(3, l_), at(2, l_));
    };
    return l < 2 ? along_second(l) : select(upper_l, along_second(3), along_second(2));
  }
  /// Add what coefficient number k contributes.
  template <class Real>
  LAHAR_INLINE static void add(int k, const Real& q, const PolynomialWeights<Real>& at, Real& sum) {
    sum = k == 0 ? q : fma(k == 1 ? at.t : at.bent, q, sum);
  }
  template <class Real>
  LAHAR_INLINE static void add_slope(int k, const Real& q, const Real& bent, Real& sum) {
    if (k > 0) sum = k == 1 ? q : fma(bent, q, sum);
  }

  /// Values at four nodes, in order, become a, b, c and d.
  template <class Vector>
  LAHAR_INLINE static void to_coefficients(Vector (&q)[axis_nodes]) {
    const Vector before = q[0] - q[1], b = q[2] - q[1], after = q[3] - q[2];
    q[0] = 0.5 * (q[1] + q[2]);
    q[1] = b;
    q[2] = before + b;
    q[3] = after - b;
  }

  /// The nodes of number k along the first axis: coefficients along the second and third.
  LAHAR_INLINE void take_plane(int k) {
    NodeVector q[axis_nodes][axis_nodes];
    LAHAR_UNROLL
    for (int l = 0; l < axis_nodes; ++l) {
      LAHAR_UNROLL
      for (int m = 0; m < axis_nodes; ++m)
        q[l][m] = load<NodeVector>(
            v_ + static_cast<std::ptrdiff_t>(nodes_[n_rows * l + axis_nodes * m + k]) * node_width);
      to_coefficients(q[l]);
      if (border_ & 1u << 2) q[l][2] = NodeVector(0.0);
      if (border_ & 1u << 3) q[l][3] = NodeVector(0.0);
    }
    auto& plane = plane_[slot(k)];
    LAHAR_UNROLL
    for (int m = 0; m < axis_nodes; m += 2) {
      Pair column[axis_nodes];
      LAHAR_UNROLL
      for (int l = 0; l < axis_nodes; ++l) column[l] = pair_of(q[l][m], q[l][m + 1]);
      to_coefficients(column);
      if (border_ & 1u << 4) column[2] = Pair(0.0);
      if (border_ & 1u << 5) column[3] = Pair(0.0);
      // As pairs, since along_first() is about to load them as such.
      LAHAR_UNROLL
      for (int l = 0; l < axis_nodes; ++l) store(column[l], plane[axis_nodes * l + m]);
    }
  }

  /// From the planes the coefficients along the first axis.
  LAHAR_INLINE void along_first() {
    for (int r = 0; r < n_rows; r += 2) {
      Pair q[axis_nodes];
      LAHAR_UNROLL
      for (int k = 0; k < axis_nodes; ++k) q[k] = load<Pair>(plane_[slot(k)][r]);
      to_coefficients(q);
      if (border_ & 1u << 0) q[2] = Pair(0.0);
      if (border_ & 1u << 1) q[3] = Pair(0.0);
      LAHAR_UNROLL
      for (int k = 0; k < axis_nodes; ++k) store(q[k], coefficient_[k][r]);
    }
  }
  LAHAR_INLINE unsigned slot(int k) const {
    return (static_cast<unsigned>(k) + turned_) % axis_nodes;
  }
  LAHAR_INLINE static Pair pair_of(const NodeVector& a, const NodeVector& b) {
    return Pair::of(__builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 4, 5, 6, 7));
  }

  /// [number along the first axis][those along the third and second][component]
  alignas(64) double plane_[axis_nodes][n_rows][node_width];
  alignas(64) double coefficient_[axis_nodes][n_rows][node_width];
  // PatchTopology::support_follows, support_nodes, support_border.
  const std::uint8_t* follows_;
  const Local* all_nodes_;
  const std::uint8_t* borders_;
  const double* v_;
  Local cell_ = -2;  ///< none; no cell follows it
  const Local* nodes_ = nullptr;
  unsigned border_ = 0, turned_ = 0;
};

}  // namespace lahar::general
