/// \file The basis of Lagrange elements other than Q4 and H8: shape functions of the cell that a
/// particle is in, at its natural coordinates; and the inverse map for packs of particles. The
/// functions are those of the element or Bernstein's, which map to the same places.
#pragma once

#include <array>
#include <type_traits>

#include "physics/mesh/bernstein.h"
#include "physics/mesh/cell_polynomial.h"
#include "physics/mesh/element.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/mesh/shape.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Newton steps after which a lane counts as not converged; one or two are needed from anywhere
/// near.
inline constexpr int lagrange_max_steps = 8;
/// Corrections after each of them, with its Jacobian: one suffices where a particle moved 1e-4 of
/// its cell, or in a cell that is a parallelogram.
inline constexpr int lagrange_corrections = 3;

/// A basis (basis.h) that holds the positions of one cell's nodes, or its control points.
template <Element E, class Functions = Shape<E>>
class LagrangeBasis {
 public:
  static constexpr int dim = Shape<E>::dim, nodes = Shape<E>::nodes;
  static constexpr bool volume_at_centre = true;
  /// A triangle or tetrahedron with straight edges has the same gradients everywhere.
  static constexpr bool affine = info(E).simplex && info(E).order == 1;

  /// `position`: node_width doubles by local node; `node`: the local nodes of the cell; `rows`: the
  /// natural coordinates of particles.
  LAHAR_INLINE LagrangeBasis(const double* position, const Local* node,
                             const std::array<const double*, dim>& rows)
      : rows_(rows) {
    const auto at = [&](int a) {
      return load<NodeVector>(position + static_cast<std::ptrdiff_t>(node[a]) * node_width);
    };
    const NodeVector origin = at(0);
    store(origin, origin_);
    // Differences keep full precision far from the origin.
    for (int a = 0; a < nodes; ++a) store(at(a) - origin, x_[a]);
    if constexpr (!std::is_same_v<Functions, Shape<E>>) Functions::to_control_points(x_);
    if constexpr (affine) {
      const Scalar anywhere[dim] = {};
      Scalar slope[dim][nodes], to_natural[dim][dim];
      physical_gradients(anywhere, slope, to_natural);
      for (int d = 0; d < dim; ++d) {
        for (int a = 0; a < nodes; ++a) slope_[d][a] = slope[d][a][0];
        for (int k = 0; k < dim; ++k) to_natural_[k][d] = to_natural[k][d][0];
      }
    }
  }

  template <class Real>
  LAHAR_INLINE void functions(Local p, Real (&N)[nodes]) const {
    Real xi[dim];
    natural(p, xi);
    Functions::values(xi, N);
  }
  template <class Real>
  LAHAR_INLINE void gradients(Local p, Real (&dN)[dim][nodes]) const {
    if constexpr (affine) {
      LAHAR_UNROLL
      for (int d = 0; d < dim; ++d) LAHAR_UNROLL
      for (int a = 0; a < nodes; ++a) dN[d][a] = Real(slope_[d][a]);
    } else {
      Real xi[dim], to_natural[dim][dim];
      natural(p, xi);
      physical_gradients(xi, dN, to_natural);
    }
  }
  /// Trace of the gradient of a nodal field [1/m] at the mean of the corners' natural coordinates.
  LAHAR_INLINE double centre_trace(const double* v, const Local* node) const {
    const auto at = [&](int a) {
      return load<NodeVector>(v + static_cast<std::ptrdiff_t>(node[a]) * node_width);
    };
    double trace = 0.0;
    if constexpr (affine) {
      for (int a = 0; a < nodes; ++a) {
        const NodeVector v_a = at(a);
        for (int d = 0; d < dim; ++d) trace += slope_[d][a] * v_a[d];
      }
      return trace;
    }
    Scalar xi[dim], dN[nodes][dim], J[dim][dim], to_natural[dim][dim];
    for (int d = 0; d < dim; ++d) xi[d] = Scalar(info(E).simplex ? 1.0 / (dim + 1) : 0.0);
    Functions::gradients(xi, dN);
    NodeVector along[dim], change[dim];  // of place and field with each natural coordinate
    LAHAR_UNROLL
    for (int k = 0; k < dim; ++k) {
      along[k] = change[k] = NodeVector(0.0);
      LAHAR_UNROLL
      for (int a = 0; a < nodes; ++a) {
        along[k] = fma(NodeVector(dN[a][k][0]), load<NodeVector>(x_[a]), along[k]);
        change[k] = fma(NodeVector(dN[a][k][0]), at(a), change[k]);
      }
      for (int i = 0; i < dim; ++i) J[i][k] = Scalar(along[k][i]);
    }
    inverse(J, to_natural);
    for (int k = 0; k < dim; ++k)
      for (int d = 0; d < dim; ++d) trace += change[k][d] * to_natural[k][d][0];
    return trace;
  }

  /// dN_a/dxi_k and dxi_k/dx_d [1/m] at the particles from p on: sums over nodes with the former
  /// take fewer operations than with gradients().
  template <class Real>
  LAHAR_INLINE void natural_gradients(Local p, Real (&dN)[nodes][dim],
                                      Real (&to_natural)[dim][dim]) const requires(!affine) {
    Real xi[dim], J[dim][dim];
    natural(p, xi);
    Functions::gradients(xi, dN);
    jacobian(dN, J);
    inverse(J, to_natural);
  }

  /// Natural coordinates of the points x [m] of the first n lanes, from the start that xi holds.
  /// Returns a bit for each of these lanes that did not converge. A lane stops by its own
  /// criterion, so that its result does not depend on the others.
  template <class Real>
  LAHAR_INLINE unsigned inverse_map(const Real (&x)[dim], Real (&xi)[dim], Local n) const {
    Real offset[dim];
    LAHAR_UNROLL
    for (int d = 0; d < dim; ++d) offset[d] = Real(origin_[d]) - x[d];
    unsigned open = n >= lanes<Real> ? (1u << lanes<Real>)-1 : (1u << n) - 1;
    if constexpr (affine) {
      LAHAR_UNROLL
      for (int k = 0; k < dim; ++k) {
        xi[k] = Real(0.0);
        LAHAR_UNROLL
        for (int d = 0; d < dim; ++d) xi[k] -= to_natural_[k][d] * offset[d];
      }
      return 0;
    } else {
      for (int count = 0; count < lagrange_max_steps && open != 0; ++count) {
        Real step[dim], to_natural[dim][dim];
        newton_step(offset, xi, step, to_natural);
        const Real length = take_step(step, open, xi);
        open &= outside(length, newton_step_tolerance, n);
        // What a correction leaves is of the order of its length and of the step's, multiplied.
        for (int k = 0; k < lagrange_corrections && open != 0; ++k) {
          Real N[nodes];
          Functions::values(xi, N);
          solve(offset, N, to_natural, step);
          open &= outside(Real(length * take_step(step, open, xi)), pack_error_tolerance, n);
        }
      }
      return open;
    }
  }
  /// Bits of the first n lanes that are not clearly inside the cell: there the mesh's own map
  /// decides.
  template <class Real>
  LAHAR_INLINE static unsigned near_faces(const Real (&xi)[dim], Local n) {
    unsigned bits = 0;
    if constexpr (info(E).simplex) {
      Real first(1.0);
      LAHAR_UNROLL
      for (int d = 0; d < dim; ++d) {
        first -= xi[d];
        bits |= outside(1.0 - 2.0 * xi[d], pack_clear_of_faces, n);
      }
      return bits | outside(1.0 - 2.0 * first, pack_clear_of_faces, n);
    } else {
      LAHAR_UNROLL
      for (int d = 0; d < dim; ++d) bits |= outside(xi[d], pack_clear_of_faces, n);
      return bits;
    }
  }

 private:
  template <class Real>
  LAHAR_INLINE void natural(Local p, Real (&xi)[dim]) const {
    LAHAR_UNROLL
    for (std::size_t d = 0; d < dim; ++d) xi[d] = load<Real>(rows_[d] + p);
  }
  /// J[i][k] = dx_i/dxi_k [m].
  template <class Real>
  LAHAR_INLINE void jacobian(const Real (&dN)[nodes][dim], Real (&J)[dim][dim]) const {
    LAHAR_UNROLL
    for (int i = 0; i < dim; ++i) LAHAR_UNROLL
    for (int k = 0; k < dim; ++k) {
      J[i][k] = multiply(dN[1][k], &x_[1][i]);  // the first node is the origin
      LAHAR_UNROLL
      for (int a = 2; a < nodes; ++a) J[i][k] = multiply_add(J[i][k], dN[a][k], &x_[a][i]);
    }
  }
  /// dN/dx, and dxi_k/dx_d on the way.
  template <class Real>
  LAHAR_INLINE void physical_gradients(const Real (&xi)[dim], Real (&slope)[dim][nodes],
                                       Real (&to_natural)[dim][dim]) const {
    Real dN[nodes][dim], J[dim][dim];
    Functions::gradients(xi, dN);
    jacobian(dN, J);
    inverse(J, to_natural);
    LAHAR_UNROLL
    for (int a = 0; a < nodes; ++a) LAHAR_UNROLL
    for (int d = 0; d < dim; ++d) {
      slope[d][a] = dN[a][0] * to_natural[0][d];
      LAHAR_UNROLL
      for (int k = 1; k < dim; ++k) slope[d][a] += dN[a][k] * to_natural[k][d];
    }
  }
  /// Newton's step [natural coordinates] back to the point, and dxi_k/dx_d [1/m] on the way.
  template <class Real>
  LAHAR_INLINE void newton_step(const Real (&offset)[dim], const Real (&xi)[dim], Real (&step)[dim],
                                Real (&to_natural)[dim][dim]) const {
    Real N[nodes], dN[nodes][dim], J[dim][dim];
    Functions::values(xi, N);
    Functions::gradients(xi, dN);
    jacobian(dN, J);
    inverse(J, to_natural);
    solve(offset, N, to_natural, step);
  }
  /// `to_natural` times the distance between the point with functions N and that at -`offset`.
  template <class Real>
  LAHAR_INLINE void solve(const Real (&offset)[dim], const Real (&N)[nodes],
                          const Real (&to_natural)[dim][dim], Real (&step)[dim]) const {
    Real f[dim];
    LAHAR_UNROLL
    for (int d = 0; d < dim; ++d) {
      f[d] = offset[d];
      LAHAR_UNROLL
      for (int a = 1; a < nodes; ++a) f[d] = multiply_add(f[d], N[a], &x_[a][d]);
    }
    LAHAR_UNROLL
    for (int k = 0; k < dim; ++k) {
      step[k] = to_natural[k][0] * f[0];
      LAHAR_UNROLL
      for (int d = 1; d < dim; ++d) step[k] += to_natural[k][d] * f[d];
    }
  }
  /// xi - step in the lanes of `open`. Returns the step's largest component.
  template <class Real>
  LAHAR_INLINE static Real take_step(const Real (&step)[dim], unsigned open, Real (&xi)[dim]) {
    Real length(0.0);
    LAHAR_UNROLL
    for (int d = 0; d < dim; ++d) {
      xi[d] = select(open, xi[d] - step[d], xi[d]);
      length = max(length, abs(step[d]));
    }
    return length;
  }

  std::array<const double*, dim> rows_;
  double origin_[node_width];                                ///< [m] the first node
  alignas(sizeof(NodeVector)) double x_[nodes][node_width];  ///< [m] from there
  double slope_[dim][nodes];                                 ///< affine only: dN_a/dx_d [1/m]
  double to_natural_[dim][dim];                              ///< affine only: dxi_k/dx_d [1/m]
};

/// Makes the bases of a patch's cells.
template <Element E, class Functions = Shape<E>>
class LagrangeCells {
 public:
  static constexpr int dim = info(E).dim;

  explicit LagrangeCells(const Patch<dim>& patch)
      : position_(patch.node_position.data()),
        nodes_(patch.topology.support_nodes.data()),
        rows_(patch.particles.template rows<dim>(Column::xi)) {}
  LAHAR_INLINE LagrangeBasis<E, Functions> operator[](Local cell) const {
    return {position_, nodes_ + static_cast<std::ptrdiff_t>(cell) * info(E).nodes, rows_};
  }

 private:
  const double* position_;
  const Local* nodes_;
  std::array<const double*, dim> rows_;
};

/// Call body(cells) for a patch of BasisKind::element.
template <int Dim, class Body>
LAHAR_INLINE void with_lagrange(const Patch<Dim>& patch, Body body) {
  using enum Element;
  if constexpr (Dim == 2) {
    switch (patch.element) {
      case T3:
        return body(LagrangeCells<T3>(patch));
      case T6:
        return patch.lagrange_functions ? body(LagrangeCells<T6>(patch))
                                        : body(LagrangeCells<T6, Bernstein<T6>>(patch));
      case Q8:
        return body(LagrangeCells<Q8>(patch));
      case Q9:
        return patch.lagrange_functions ? body(LagrangeCells<Q9>(patch))
                                        : body(LagrangeCells<Q9, Bernstein<Q9>>(patch));
      case Q4:  // has kernels of its own
      case Tet4:
      case H8:
      case H20:
      case H27:
        break;
    }
  } else {
    switch (patch.element) {
      case Tet4:
        return body(LagrangeCells<Tet4>(patch));
      case H20:
        return body(LagrangeCells<H20>(patch));
      case H27:
        return patch.lagrange_functions ? body(LagrangeCells<H27>(patch))
                                        : body(LagrangeCells<H27, Bernstein<H27>>(patch));
      case H8:  // has kernels of its own
      case T3:
      case T6:
      case Q4:
      case Q8:
      case Q9:
        break;
    }
  }
  wrong_element(patch.element, Dim);
}

}  // namespace lahar
