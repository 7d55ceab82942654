/// \file A field of quadratic B-splines in one cell of a 3D grid as the polynomials that it is.
///
/// Along an axis the four nodes of a cell give, with t = s - 1/2 from -1/2 to 1/2 across it,
///
///     q(t) = a + b t + c min(t, 0)^2 / 2 + d max(t, 0)^2 / 2
///     a = (q_0 + q_1) / 2, b = q_1 - q_0, c = q_-1 - 2 q_0 + q_1, d = q_0 - 2 q_1 + q_2
///
/// where q_0 and q_1 belong to the cell's own nodes. Of the 64 products that a particle needs in
/// space with these, many have the factors 1 and 0, where all functions of nodes would have to be
/// multiplied; and what turns nodal values into coefficients is done once for a cell. Beyond a wall
/// of the mesh q goes on straight (fold_first()): c or d is zero.
///
/// The moments of APIC, sum_k q_k w_k (k - s) / D, are the slope of the same polynomials with
/// other weights of c and d. On the three nodes that a particle reaches moments and slopes sum to
/// zero and have the same first moment, so they differ by a multiple of (1, -2, 1); at a wall,
/// where only two nodes are reached, they are the same.
#pragma once

#include "physics/support_fields.h"
#include "physics/tensor_basis.h"

namespace lahar::supported {

/// A place along an axis of a cell.
template <class Real>
struct PolynomialWeights {
  Real t, c, d;             ///< of b, c and d in q; that of a is 1
  Real slope_c, slope_d;    ///< in dq/dt; those of a and b are 0 and 1
  Real moment_c, moment_d;  ///< in moments, likewise

  /// From the natural coordinate.
  LAHAR_INLINE explicit PolynomialWeights(const Real& xi) : t(0.5 * xi) {
    slope_d = max(Real(0.0), t);
    slope_c = t - slope_d;
    c = 0.5 * slope_c * slope_c;
    d = 0.5 * slope_d * slope_d;
    // From t' of a particle to the middle one of its nodes: t' (1 - 4 t'^2) / 2, and t' = t +- 1/2.
    moment_c = slope_c - 2.0 * slope_c * (slope_c + 0.5) * (1.0 + slope_c);
    moment_d = slope_d + 2.0 * slope_d * (slope_d - 0.5) * (1.0 - slope_d);
  }
};

/// Nodal velocities of one cell after the other as coefficients.
class SplinePolynomials {
 public:
  LAHAR_INLINE explicit SplinePolynomials(const double* velocity) : v_(velocity) {}

  /// Go to the cell with these nodes and border (PatchTopology::support_nodes, support_border).
  /// Where it follows on the last one along the first axis, three planes of nodes stay.
  LAHAR_INLINE void move_to(const Local* nodes, unsigned border) {
    if (nodes == nodes_) return;
    const bool next = nodes_ != nullptr && follows(nodes, nodes_) && border >> 2 == border_ >> 2;
    turned_ = next ? turned_ + 1 : 0;
    nodes_ = nodes;
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
      for (int l = 0; l < axis_nodes; ++l) {
        Real sum, sum_x, sum_y, sum_of_x, sum_of_y;
        LAHAR_UNROLL
        for (int k = 0; k < axis_nodes; ++k) {
          const double* q = &coefficient_[0][axis_nodes * l + k][a];
          constexpr int next = n_rows * node_width;
          Real along = broadcast<Real>(q), slope = broadcast<Real>(q + next), moment = slope;
          along = multiply_add(along, x.t, q + next);
          along = multiply_add(along, x.c, q + 2 * next);
          along = multiply_add(along, x.d, q + 3 * next);
          slope = multiply_add(slope, x.slope_c, q + 2 * next);
          slope = multiply_add(slope, x.slope_d, q + 3 * next);
          add(k, along, y, sum);
          add(k, slope, y, sum_x);
          add_slope(k, along, y.slope_c, y.slope_d, sum_y);
          if constexpr (Moments) {
            moment = multiply_add(moment, x.moment_c, q + 2 * next);
            moment = multiply_add(moment, x.moment_d, q + 3 * next);
            add(k, moment, y, sum_of_x);
            add_slope(k, along, y.moment_c, y.moment_d, sum_of_y);
          }
        }
        add(l, sum, z, v);
        add(l, sum_x, z, by_x);
        add(l, sum_y, z, by_y);
        add_slope(l, sum, z.slope_c, z.slope_d, by_z);
        if constexpr (Moments) {
          add(l, sum_of_x, z, of_x);
          add(l, sum_of_y, z, of_y);
          add_slope(l, sum, z.moment_c, z.moment_d, of_z);
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

  /// Add what coefficient number k contributes.
  template <class Real>
  LAHAR_INLINE static void add(int k, const Real& q, const PolynomialWeights<Real>& at, Real& sum) {
    sum = k == 0 ? q : fma(k == 1 ? at.t : k == 2 ? at.c : at.d, q, sum);
  }
  template <class Real>
  LAHAR_INLINE static void add_slope(int k, const Real& q, const Real& c, const Real& d,
                                     Real& sum) {
    if (k > 0) sum = k == 1 ? q : fma(k == 2 ? c : d, q, sum);
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
    for (int m = 0; m < axis_nodes; ++m) {
      NodeVector column[axis_nodes] = {q[0][m], q[1][m], q[2][m], q[3][m]};
      to_coefficients(column);
      if (border_ & 1u << 4) column[2] = NodeVector(0.0);
      if (border_ & 1u << 5) column[3] = NodeVector(0.0);
      LAHAR_UNROLL
      for (int l = 0; l < axis_nodes; ++l) store(column[l], plane[axis_nodes * l + m]);
    }
  }

  /// From the planes the coefficients along the first axis.
  LAHAR_INLINE void along_first() {
    using Pair = PackOf<2 * node_width>;
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
  LAHAR_INLINE int slot(int k) const { return (k + turned_) % axis_nodes; }

  /// [number along the first axis][those along the third and second][component]
  alignas(64) double plane_[axis_nodes][n_rows][node_width];
  alignas(64) double coefficient_[axis_nodes][n_rows][node_width];
  const double* v_;
  const Local* nodes_ = nullptr;
  unsigned border_ = 0;
  int turned_ = 0;
};

}  // namespace lahar::supported
