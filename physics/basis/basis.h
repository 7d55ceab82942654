/// \file Shape functions of any support, for kernels: what a *basis* is, and which one a patch has.
///
/// Linear functions on Q4 and H8 have kernels of their own (shape.h, cell_map.h). All others give
/// kernels a basis: an object made for one cell, with
///
///     static constexpr int nodes;               functions that may not be zero in the cell
///     template <class Real>                     N_i at the particles from p on,
///     void functions(Local p, Real (&N)[nodes]) const;
///     template <class Real>                     and dN[d][i] = dN_i/dx_d there [1/m]
///     void gradients(Local p, Real (&dN)[Dim][nodes]) const;
///     static constexpr bool volume_at_centre;   with Analysis::volume_as_cbgeo the volumetric
///                                               strain increment is that of
///     void centre_gradients(double (&dN)[Dim][nodes]) const;      the gradients at the centre, or
///     double centre_trace(const double* v, const Local* node) const;   of those of a field
///
/// Particles come in packs of one bin, whose lanes beyond its end may hold anything. Function i
/// belongs to node PatchTopology::support_nodes[support_size * cell + i]. Where volume_at_centre is
/// false, the increment is that at each particle, and there is no centre_gradients(); nor has a
/// tensor basis one.
///
/// A tensor basis has functions that are products of one function per axis, and also
///
///     static constexpr int per_axis = 4;        nodes = per_axis^Dim, first axis fastest
///     static constexpr int per_particle;        4, or 3 where functions of one particle are other
///                                               than zero at nodes 0 to 2 (s <= 1/2) or 1 to 3
///                                               only
///     template <class Real>                     w[d][k] and dw[d][k] = dw/dx_d [1/m]
///     void weights(Local p, Real (&w)[Dim][per_axis]) const;
///     void weights(Local p, Real (&w)[Dim][per_axis], Real (&dw)[Dim][per_axis]) const;
///
///     template <class Real>                     s[d], 0 to 1 across the cell
///     void place(Local p, Real (&s)[Dim]) const;
///     template <class Real>                     for APIC w_k (x_k - x_p) / D_dd [1/m]
///     void moments(Local p, const Real (&w)[Dim][per_axis], const Real (&dw)[Dim][per_axis],
///                  Real (&m)[Dim][per_axis]) const;
///     double cell_length(int d) const;          [m]
///
/// for which kernels take fewer operations; at the centre gradients are those of linear functions.
/// A new kind is a row of BasisKind and of with_bases().
#pragma once

#include <cstddef>

#include "physics/basis/cpdi_basis.h"
#include "physics/basis/lagrange_basis.h"
#include "physics/basis/linear_basis.h"
#include "physics/basis/tensor_basis.h"
#include "physics/particles/patch.h"

namespace lahar {

template <class B>
concept TensorBasis = requires {
  B::per_axis;
};

/// Bases whose gradients are those with natural coordinates, turned: natural_gradients().
template <class B>
concept NaturalBasis = requires(const B& basis, Scalar (&dN)[B::nodes][B::dim],
                                Scalar (&to_natural)[B::dim][B::dim]) {
  basis.natural_gradients(Local(), dN, to_natural);
};

/// Call body(cells) with what makes the bases of a patch's cells: cells[local cell] is a basis.
/// Only for patches with support_nodes.
template <int Dim, class Body>
LAHAR_INLINE void with_bases(const Patch<Dim>& patch, Body body) {
  switch (patch.basis) {
    case BasisKind::linear:
      break;  // has kernels of its own
    case BasisKind::element:
      return with_lagrange(patch, body);
    case BasisKind::corners:
      return patch.cartesian ? body(LinearCells<Dim, CartesianCells<Dim>>(patch))
                             : body(LinearCells<Dim, IsoparametricCells<Dim>>(patch));
    case BasisKind::quadratic_spline:
      return body(SplineCells<Dim, QuadraticSpline>(patch));
    case BasisKind::cubic_spline:
      return body(SplineCells<Dim, CubicSpline>(patch));
    case BasisKind::cpdi:
      return body(CpdiCells<Dim, Parallelepiped, Column::vectors>(patch));
    case BasisKind::cpdi2:
      return body(CpdiCells<Dim, Hexahedron, Column::corners>(patch));
    case BasisKind::gimp:
      return body(GimpCells<Dim>(patch));
  }
}

/// Call body(basis, bin, nodes) for every bin that is not empty, with the local nodes of the basis.
template <int Dim, class Body>
LAHAR_INLINE void for_each_general_bin(const Patch<Dim>& patch, ParticleBins bins, Body body) {
  const Local* nodes = patch.topology.support_nodes.data();
  const auto stride = static_cast<std::ptrdiff_t>(patch.topology.support_size);
  // A function for each basis: in one for all, GCC 12 keeps less in registers.
  with_bases(
      patch, [&](const auto& cells) __attribute__((noinline)) {
        for (ParticleBin& bin : bins)
          if (bin.begin < bin.end) body(cells[bin.cell], bin, nodes + stride * bin.cell);
      });
}

/// The same for patches whose basis is a tensor basis.
template <int Dim, class Body>
LAHAR_INLINE void for_each_tensor_bin(const Patch<Dim>& patch, ParticleBins bins, Body body) {
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            if constexpr (TensorBasis<std::decay_t<decltype(basis)>>) body(basis, bin, nodes);
          });
}

}  // namespace lahar
