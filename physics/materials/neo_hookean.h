/// \file Compressible neo-Hookean elasticity.
#pragma once

#include <cmath>
#include <string>

#include "physics/materials/law_input.h"
#include "physics/materials/table.h"

namespace lahar {

/// Compressible neo-Hookean elasticity for large strains and rotations; 2D is plane strain.
struct NeoHookean {
  double youngs_modulus, poisson_ratio;  ///< at small strains

  static constexpr std::string_view name = "NeoHookean";
  static constexpr std::string_view help =
      "neo-Hookean elasticity for large strains and rotations; 2D is plane strain";
  static constexpr bool native = true;
  static constexpr bool knows_rotation = true;  ///< law_input.h
  static constexpr auto parameters = std::to_array<Parameter<NeoHookean>>({
      {"youngs_modulus", "Pa", "Young's modulus", &NeoHookean::youngs_modulus, Bound::positive},
      {"poisson_ratio", "-", "Poisson's ratio", &NeoHookean::poisson_ratio, Bound::poisson},
  });
  static constexpr auto state = std::to_array<StateVariable>({
      {"b_xx", "-", "left Cauchy-Green tensor F F^T"},
      {"b_yy", "-", "left Cauchy-Green tensor"},
      {"b_zz", "-", "left Cauchy-Green tensor"},
      {"b_xy", "-", "left Cauchy-Green tensor"},
      {"b_yz", "-", "left Cauchy-Green tensor"},
      {"b_xz", "-", "left Cauchy-Green tensor"},
  });

  std::string problem() const { return ""; }
  double mu() const { return youngs_modulus / (2.0 * (1.0 + poisson_ratio)); }
  double lambda() const {
    return youngs_modulus * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
  }
  double wave_modulus() const { return lambda() + 2.0 * mu(); }
  double viscosity() const { return 0; }

  /// The b that belongs to a stress: b = I + (J sigma - lambda ln(J) I) / mu with J^2 = det b, a
  /// scalar equation for ln J that is solved by Newton's method from the linear solution.
  void initial_state(const double* stress, double* b) const {
    double log_J = (stress[0] + stress[1] + stress[2]) / (3.0 * lambda() + 2.0 * mu());
    for (int step = 0; step < 50; ++step) {
      const double g = mismatch(stress, log_J, b), h = 1e-7;
      double unused[6];
      const double slope = (mismatch(stress, log_J + h, unused) - g) / h;
      if (!(std::abs(g) > 1e-14)) return;
      log_J -= g / slope;
    }
  }

  /// b = f b f^T with f = I + dt L, the deformation of the step; sigma = (lambda ln(J) I + mu (b -
  /// I)) / J, J = sqrt(det b) (Simo and Hughes 1998, with U = lambda/2 ln(J)^2). Rigid rotations
  /// rotate the stress and do nothing else. Fails where the deformation turns a volume inside out.
  template <int Dim, class Real>
  LAHAR_INLINE Failures update(const LawInput<Dim, Real>& in, Real* stress, Real* state) const {
    constexpr int voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    Real f[3][3], fb[3][3];
    LAHAR_UNROLL
    for (int a = 0; a < 3; ++a) LAHAR_UNROLL
    for (int d = 0; d < 3; ++d) {
      f[a][d] = Real(a == d ? 1.0 : 0.0);
      if (a < Dim && d < Dim) f[a][d] += in.dt * in.gradient[a % Dim][d % Dim];
    }
    LAHAR_UNROLL
    for (int a = 0; a < 3; ++a) LAHAR_UNROLL
    for (int d = 0; d < 3; ++d)
      fb[a][d] = f[a][0] * state[voigt[0][d]] + f[a][1] * state[voigt[1][d]] +
                 f[a][2] * state[voigt[2][d]];
    constexpr int row[6] = {0, 1, 2, 0, 1, 0}, column[6] = {0, 1, 2, 1, 2, 2};
    Real b[6];
    LAHAR_UNROLL
    for (int k = 0; k < 6; ++k)
      b[k] = fb[row[k]][0] * f[column[k]][0] + fb[row[k]][1] * f[column[k]][1] +
             fb[row[k]][2] * f[column[k]][2];
    const Real turned = f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1]) -
                        f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0]) +
                        f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0]);
    const Real J = sqrt(max(determinant(b), Real(0.0)));
    Failures failures;
    failures.failed = in.active & ~(greater(turned, Real(0.0)) & greater(J, Real(0.0)));
    const Real spherical = lambda() * log(J) - mu();
    LAHAR_UNROLL
    for (int k = 0; k < 6; ++k) state[k] = b[k];
    LAHAR_UNROLL
    for (int k = 0; k < in.rows; ++k)
      stress[k] = (mu() * b[k] + (k < 3 ? spherical : Real(0.0))) / J;
    return failures;
  }

 private:
  template <class Real>
  LAHAR_INLINE static Real determinant(const Real* b) {
    return b[0] * (b[1] * b[2] - b[4] * b[4]) - b[3] * (b[3] * b[2] - b[4] * b[5]) +
           b[5] * (b[3] * b[4] - b[1] * b[5]);
  }
  double mismatch(const double* stress, double log_J, double* b) const {
    const double J = std::exp(log_J);
    for (int k = 0; k < 6; ++k)
      b[k] = (J * stress[k] - (k < 3 ? lambda() * log_J : 0.0)) / mu() + (k < 3 ? 1.0 : 0.0);
    return determinant(b) / (J * J) - 1.0;
  }
};

}  // namespace lahar
