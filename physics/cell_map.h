/// \file Natural to physical gradients in one cell, for a pack of particles. Cartesian cells scale
/// by 2 / length per axis; isoparametric cells invert the Jacobian dx/dxi of each lane.
#pragma once

#include "physics/cell_polynomial.h"
#include "physics/patch.h"
#include "physics/shape.h"
#include "physics/simd.h"

namespace lahar {

template <int Dim>
struct CartesianMap {
  double scale[Dim];  ///< dxi/dx [1/m]

  CartesianMap(const Patch<Dim>& patch, Local cell) {
    for (int d = 0; d < Dim; ++d) scale[d] = 2.0 / patch.box[cell][Dim + d];
  }
  /// L[a][d] = dq_a/dx_d from G[a][k] = dq_a/dxi_k.
  template <class Real>
  void to_physical(const Weights<Dim, Real>&, const Real (&G)[Dim][Dim],
                   Real (&L)[Dim][Dim]) const {
    for (int a = 0; a < Dim; ++a)
      for (int d = 0; d < Dim; ++d) L[a][d] = G[a][d] * scale[d];
  }
  void to_physical_centre(const double (&G)[Dim][Dim], double (&L)[Dim][Dim]) const {
    for (int a = 0; a < Dim; ++a)
      for (int d = 0; d < Dim; ++d) L[a][d] = G[a][d] * scale[d];
  }
  /// T[a][k] = sum_d S[a][d] dxi_k/dx_d: a stress seen by natural gradients.
  template <class Real>
  void pull_back(const Weights<Dim, Real>&, const Real (&S)[Dim][Dim], Real (&T)[Dim][Dim]) const {
    for (int a = 0; a < Dim; ++a)
      for (int k = 0; k < Dim; ++k) T[a][k] = S[a][k];  // scaled once per run by finish()
  }
  double finish(int k) const { return scale[k]; }
};

template <int Dim>
struct IsoparametricMap {
  CellPolynomial<Dim> x;

  IsoparametricMap(const Patch<Dim>& patch, Local cell)
      : x(patch.node_position.data(), patch.topology.corner_nodes[cell]) {}

  template <class Real>
  void inverse_jacobian(const Weights<Dim, Real>& w, Real (&inv)[Dim][Dim]) const {
    Real xi[Dim], J[Dim][Dim];
    for (int d = 0; d < Dim; ++d) xi[d] = w.w[d][1] - w.w[d][0];
    x.jacobian(xi, J);
    inverse(J, inv);
  }
  template <class Real>
  void to_physical(const Weights<Dim, Real>& w, const Real (&G)[Dim][Dim],
                   Real (&L)[Dim][Dim]) const {
    Real inv[Dim][Dim];
    inverse_jacobian(w, inv);
    multiply(G, inv, L);
  }
  void to_physical_centre(const double (&G)[Dim][Dim], double (&L)[Dim][Dim]) const {
    double J[Dim][Dim], inv[Dim][Dim];
    for (int a = 0; a < Dim; ++a)
      for (int k = 0; k < Dim; ++k) J[a][k] = x.c[1 << k][a];
    inverse(J, inv);
    multiply(G, inv, L);
  }
  template <class Real>
  void pull_back(const Weights<Dim, Real>& w, const Real (&S)[Dim][Dim],
                 Real (&T)[Dim][Dim]) const {
    Real inv[Dim][Dim];
    inverse_jacobian(w, inv);
    for (int a = 0; a < Dim; ++a)
      for (int k = 0; k < Dim; ++k) {
        T[a][k] = S[a][0] * inv[k][0];
        for (int d = 1; d < Dim; ++d) T[a][k] += S[a][d] * inv[k][d];
      }
  }
  double finish(int) const { return 1.0; }

 private:
  template <class Real>
  static void multiply(const Real (&A)[Dim][Dim], const Real (&B)[Dim][Dim], Real (&C)[Dim][Dim]) {
    for (int a = 0; a < Dim; ++a)
      for (int d = 0; d < Dim; ++d) {
        C[a][d] = A[a][0] * B[0][d];
        for (int k = 1; k < Dim; ++k) C[a][d] += A[a][k] * B[k][d];
      }
  }
};

}  // namespace lahar
