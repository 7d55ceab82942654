/// \file Stresses of implicit steps with respect to their beginning, and their derivatives.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "physics/materials/tangent.h"

namespace lahar {

/// Stress of a particle with respect to the beginning of the step, and its derivative.
template <int Dim>
struct StressOfStep {
  static constexpr int n = Dim * Dim;
  double P[n];     ///< [Pa] Dim a + b
  double A[n][n];  ///< dP / dH [Pa]

  StressOfStep() = default;
  StressOfStep(const double (&H)[Dim][Dim], const StressChange<Dim>& change, bool as_cbgeo) {
    constexpr std::size_t voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    Eigen::Matrix<double, Dim, Dim> F, sigma;
    for (int a = 0; a < Dim; ++a)
      for (int b = 0; b < Dim; ++b) {
        F(a, b) = (a == b ? 1.0 : 0.0) + H[a][b];
        sigma(a, b) = change.stress[voigt[a][b]];
      }
    // P = J sigma G^T, G = F^-1: dJ = J tr(G dH), dG = -G dH G. As CB-Geo: J = 1 + tr H, G = 1.
    const double J = as_cbgeo ? 1.0 + F.trace() - Dim : F.determinant();
    Eigen::Matrix<double, Dim, Dim> G = Eigen::Matrix<double, Dim, Dim>::Identity();
    if (!as_cbgeo) G = F.inverse();
    const Eigen::Matrix<double, Dim, Dim> S = sigma * G.transpose();
    for (int a = 0; a < Dim; ++a)
      for (int d = 0; d < Dim; ++d) P[Dim * a + d] = J * S(a, d);
    for (int c = 0; c < Dim; ++c)
      for (int e = 0; e < Dim; ++e) {
        Eigen::Matrix<double, Dim, Dim> change_of;
        for (int a = 0; a < Dim; ++a)
          for (int b = 0; b < Dim; ++b) change_of(a, b) = change.tangent[voigt[a][b]][Dim * c + e];
        const double trace = as_cbgeo ? (c == e ? 1.0 : 0.0) : J * G(e, c);
        const Eigen::Matrix<double, Dim, Dim> T = change_of * G.transpose();
        for (int a = 0; a < Dim; ++a)
          for (int d = 0; d < Dim; ++d) {
            double value = J * T(a, d) + trace * S(a, d);
            if (!as_cbgeo) value -= J * S(a, e) * G(d, c);
            A[Dim * a + d][Dim * c + e] = value;
          }
      }
  }

  /// Apart from rounding.
  bool is_symmetric() const {
    double largest = 0, difference = 0;
    for (int k = 0; k < n; ++k)
      for (int l = 0; l < n; ++l) {
        largest = std::max(largest, std::abs(A[k][l]));
        difference = std::max(difference, std::abs(A[k][l] - A[l][k]));
      }
    return difference <= 1e-11 * largest;
  }
};

/// The same of a model in two dimensions that deforms across its plane: H has a fifth component,
/// which in axisymmetric models is u_r / r.
struct StressAcross : StressOfStep<2> {
  double P_across;      ///< [Pa]
  double by_across[n];  ///< dP / dH_across [Pa]
  double across[n];     ///< dP_across / dH [Pa]
  double own;           ///< dP_across / dH_across [Pa]

  StressAcross(const double (&H)[3][3], const StressChange<3>& change, bool as_cbgeo) {
    constexpr int place[n] = {0, 1, 3, 4}, zz = 8;  // of rows 3 a + b
    const StressOfStep<3> all(H, change, as_cbgeo);
    for (int k = 0; k < n; ++k) {
      P[k] = all.P[place[k]];
      for (int l = 0; l < n; ++l) A[k][l] = all.A[place[k]][place[l]];
      by_across[k] = all.A[place[k]][zz];
      across[k] = all.A[zz][place[k]];
    }
    P_across = all.P[zz];
    own = all.A[zz][zz];
  }

  /// In plane stress H_across follows from P_across = 0: dH_across = -across dH / own. A law that
  /// does not resist there (`own` is small beside `modulus` [Pa]) leaves the plane as it is.
  void condense(double modulus) {
    constexpr double least = 1e-6;
    if (own > least * modulus)
      for (int k = 0; k < n; ++k)
        for (int l = 0; l < n; ++l) A[k][l] -= by_across[k] * across[l] / own;
    P_across = own = 0;
    std::fill_n(by_across, n, 0.0);
    std::fill_n(across, n, 0.0);
  }

  bool is_symmetric() const {
    double largest = std::abs(own), difference = 0;
    for (int k = 0; k < n; ++k) {
      largest = std::max(largest, std::abs(across[k]));
      difference = std::max(difference, std::abs(across[k] - by_across[k]));
    }
    return difference <= 1e-11 * largest && StressOfStep<2>::is_symmetric();
  }
};

}  // namespace lahar
