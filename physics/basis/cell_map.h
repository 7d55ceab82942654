/// \file Natural to physical gradients in one cell, for a pack of particles. Cartesian cells scale
/// by 2 / length per axis; isoparametric cells invert the Jacobian dx/dxi of each lane.
#pragma once

#include <limits>

#include "physics/base/simd.h"
#include "physics/mesh/cell_polynomial.h"
#include "physics/mesh/shape.h"
#include "physics/particles/patch.h"

namespace lahar {

template <int Dim>
struct CartesianMap {
  double per_length[Dim];               ///< ds/dx [1/m], s = (1 + xi) / 2
  double origin[Dim], per_unit[Dim];    ///< natural coordinates are (row - origin) per_unit
  std::array<const double*, Dim> rows;  ///< positions, or natural coordinates where stored

  /// Natural coordinates of the particles from p on. Where positions do not change while they are
  /// needed they are not stored: computing is cheaper than moving them through memory. A particle
  /// on the very edge of its cell is inside by a few roundings: nodes across the cell then have
  /// mass, and with it a velocity.
  template <class Real>
  LAHAR_INLINE void natural(Local p, Real (&xi)[Dim]) const {
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d)
      xi[d] = (load<Real>(rows[d] + p) - origin[d]) * per_unit[d];
  }
  /// L[a][d] = dq_a/dx_d from G[a][k] = dq_a/ds_k of the particles from p on.
  template <class Real>
  LAHAR_INLINE void to_physical(Local, const Real (&G)[Dim][Dim], Real (&L)[Dim][Dim]) const {
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) L[a][d] = G[a][d] * per_length[d];
  }
  LAHAR_INLINE void to_physical_centre(const double (&G)[Dim][Dim], double (&L)[Dim][Dim]) const {
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) L[a][d] = G[a][d] * per_length[d];
  }
  /// T[a][k] = sum_d S[a][d] dxi_k/dx_d: a stress seen by natural gradients; the factors finish(k)
  /// are left for the sum over the bin.
  template <class Real>
  LAHAR_INLINE void pull_back(Local, const Real (&S)[Dim][Dim], Real (&T)[Dim][Dim]) const {
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) T[a][k] = S[a][k];
  }
  double finish(int k) const { return 2.0 * per_length[k]; }
};

template <int Dim>
struct IsoparametricMap {
  CellPolynomial<Dim> x;
  std::array<const double*, Dim> rows;  ///< natural coordinates

  /// Natural coordinates of the particles from p on, as locate() left them.
  template <class Real>
  LAHAR_INLINE void natural(Local p, Real (&xi)[Dim]) const {
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d) xi[d] = load<Real>(rows[d] + p);
  }
  /// dxi/dx of the particles from p on, times a factor.
  template <class Real>
  LAHAR_INLINE void inverse_jacobian(Local p, Real (&inv)[Dim][Dim], double factor = 1.0) const {
    Real xi[Dim], J[Dim][Dim];
    natural(p, xi);
    x.scaled_jacobian(xi, J);
    inverse(J, inv, corners<Dim> * factor);
  }
  template <class Real>
  LAHAR_INLINE void to_physical(Local p, const Real (&G)[Dim][Dim], Real (&L)[Dim][Dim]) const {
    Real inv[Dim][Dim];
    inverse_jacobian(p, inv, 0.5);
    multiply(G, inv, L);
  }
  LAHAR_INLINE void to_physical_centre(const double (&G)[Dim][Dim], double (&L)[Dim][Dim]) const {
    double J[Dim][Dim], inv[Dim][Dim];
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) J[a][k] = x.c[1 << k][a];
    inverse(J, inv, 0.5 * corners<Dim>);
    multiply(G, inv, L);
  }
  template <class Real>
  LAHAR_INLINE void pull_back(Local p, const Real (&S)[Dim][Dim], Real (&T)[Dim][Dim]) const {
    Real inv[Dim][Dim];
    inverse_jacobian(p, inv);
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int k = 0; k < Dim; ++k) {
      T[a][k] = S[a][0] * inv[k][0];
      LAHAR_UNROLL
      for (int d = 1; d < Dim; ++d) T[a][k] += S[a][d] * inv[k][d];
    }
  }
  double finish(int) const { return 1.0; }

 private:
  template <class Real>
  LAHAR_INLINE static void multiply(const Real (&A)[Dim][Dim], const Real (&B)[Dim][Dim],
                                    Real (&C)[Dim][Dim]) {
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {
      C[a][d] = A[a][0] * B[0][d];
      LAHAR_UNROLL
      for (int k = 1; k < Dim; ++k) C[a][d] += A[a][k] * B[k][d];
    }
  }
};

/// dN[d][i] = dN_i/dx_d [1/m] of linear functions at a cell's centre.
template <int Dim, class Map>
LAHAR_INLINE void centre_gradients(const Map& map, double (&dN)[Dim][corners<Dim>]) {
  double one[Dim][Dim], ds[Dim][Dim];  // ds[k][d] = ds_k/dx_d
  for (int k = 0; k < Dim; ++k)
    for (int d = 0; d < Dim; ++d) one[k][d] = k == d ? 1.0 : 0.0;
  map.to_physical_centre(one, ds);
  for (int i = 0; i < corners<Dim>; ++i)
    for (int d = 0; d < Dim; ++d) {
      dN[d][i] = 0.0;
      for (int k = 0; k < Dim; ++k)
        dN[d][i] += (i >> k & 1 ? 1.0 : -1.0) / face_corners<Dim> * ds[k][d];
    }
}

/// Keeps natural coordinates that are within [-1, 1] but for rounding below 1 in magnitude.
inline constexpr double pulled_inside = 1.0 - 4 * std::numeric_limits<double>::epsilon();

/// The maps of a patch's cells, made one by one from what is common to all.
template <int Dim>
class CartesianCells {
 public:
  explicit CartesianCells(const Patch<Dim>& patch)
      : box_(patch.box.data()),
        stored_(patch.particles.layout().has(Column::xi)),
        rows_(patch.particles.template rows<Dim>(stored_ ? Column::xi : Column::x)) {}

  LAHAR_INLINE CartesianMap<Dim> operator[](Local cell) const {
    CartesianMap<Dim> map;
    const auto& box = box_[cell];
    map.rows = rows_;
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d) {
      map.per_length[d] = 0.5 * box[Dim + d];
      map.origin[d] = stored_ ? 0.0 : box[d];
      map.per_unit[d] = stored_ ? 1.0 : box[Dim + d] * pulled_inside;
    }
    return map;
  }

 private:
  const std::array<double, 2 * static_cast<std::size_t>(Dim)>* box_;
  bool stored_;
  std::array<const double*, Dim> rows_;
};

template <int Dim>
class IsoparametricCells {
 public:
  explicit IsoparametricCells(const Patch<Dim>& patch)
      : position_(patch.node_position.data()),
        corners_(patch.topology.corner_nodes.data()),
        rows_(patch.particles.template rows<Dim>(Column::xi)) {}

  LAHAR_INLINE IsoparametricMap<Dim> operator[](Local cell) const {
    return {CellPolynomial<Dim>(position_, corners_[cell]), rows_};
  }

 private:
  const double* position_;
  const std::array<Local, corners<Dim>>* corners_;
  std::array<const double*, Dim> rows_;
};

/// Weights of the particles from p on.
template <int Dim, class Real, class Map>
LAHAR_INLINE Weights<Dim, Real> weights_at(const Map& map, Local p) {
  Real xi[Dim];
  map.natural(p, xi);
  return Weights<Dim, Real>(xi);
}

/// Call body(map, bin) for every bin that is not empty, with the map of its cell.
template <int Dim, class Body>
LAHAR_INLINE void for_each_bin(const Patch<Dim>& patch, ParticleBins bins, Body body) {
  const auto with = [&](const auto& cells) __attribute__((always_inline)) {
    for (ParticleBin& bin : bins)
      if (bin.begin < bin.end) body(cells[bin.cell], bin);
  };
  if (patch.cartesian)
    with(CartesianCells<Dim>(patch));
  else
    with(IsoparametricCells<Dim>(patch));
}

}  // namespace lahar
