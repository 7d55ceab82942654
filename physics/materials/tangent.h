#pragma once
#include "physics/materials/law.h"
#include "physics/materials/law_input.h"
namespace lahar {
template <int Dim, class Real>
LAHAR_INLINE LawInput<Dim, Real> increment_of(const Real (&H)[Dim][Dim], double dt, bool linear) {
  LawInput<Dim, Real> in;
  in.dt = dt;
  Real F[Dim][Dim], M[Dim][Dim];
  const Real per_dt(1.0 / dt);
  for (int a = 0; a < Dim; ++a) for (int b = 0; b < Dim; ++b) {
    in.gradient[a][b] = H[a][b] * per_dt;
    F[a][b] = Real(0.5) * H[a][b] + Real(a == b ? 1.0 : 0.0);
    M[a][b] = in.gradient[a][b];
  }
  Real J(1.0);
  if (!linear) {
    Real inv[Dim][Dim];
    if constexpr (Dim == 2) {
      const Real det = F[0][0]*F[1][1] - F[0][1]*F[1][0];
      inv[0][0] = F[1][1]/det; inv[1][1] = F[0][0]/det; inv[0][1] = Real(0.0)-F[0][1]/det; inv[1][0] = Real(0.0)-F[1][0]/det;
      J = (Real(1.0)+H[0][0])*(Real(1.0)+H[1][1]) - H[0][1]*H[1][0];
    } else {
      Real c[3][3];
      for (int a=0;a<3;++a) for (int b=0;b<3;++b) { const int a1=(a+1)%3,a2=(a+2)%3,b1=(b+1)%3,b2=(b+2)%3; c[a][b]=F[a1][b1]*F[a2][b2]-F[a1][b2]*F[a2][b1]; }
      const Real det = F[0][0]*c[0][0]+F[0][1]*c[0][1]+F[0][2]*c[0][2];
      for (int a=0;a<3;++a) for (int b=0;b<3;++b) inv[b][a]=c[a][b]/det;
      Real G[3][3];
      for (int a=0;a<3;++a) for (int b=0;b<3;++b) G[a][b]=H[a][b]+Real(a==b?1.0:0.0);
      J = G[0][0]*(G[1][1]*G[2][2]-G[1][2]*G[2][1]) - G[0][1]*(G[1][0]*G[2][2]-G[1][2]*G[2][0]) + G[0][2]*(G[1][0]*G[2][1]-G[1][1]*G[2][0]);
    }
    for (int a=0;a<Dim;++a) for (int b=0;b<Dim;++b) { M[a][b]=Real(0.0); for (int k=0;k<Dim;++k) M[a][b]+=in.gradient[a][k]*inv[k][b]; }
  }
  in.rate[0] = M[0][0]; in.rate[1] = M[1][1];
  if constexpr (Dim == 2) { in.rate[2] = Real(0.0); in.rate[3] = M[0][1]+M[1][0]; }
  else { in.rate[2]=M[2][2]; in.rate[3]=M[0][1]+M[1][0]; in.rate[4]=M[1][2]+M[2][1]; in.rate[5]=M[0][2]+M[2][0]; }
  Real trace = H[0][0]+H[1][1]; if constexpr (Dim==3) trace += H[2][2];
  in.volumetric = linear ? trace : J - Real(1.0);
  return in;
}
template <int Dim> struct StressChange {
  std::array<double, stress_components<Dim>> stress;
  std::array<double, most_state> state;
  double tangent[stress_components<Dim>][Dim * Dim];
};
template <int Dim> Failures stress_change(const Law& law, const double (&H)[Dim][Dim], double dt, bool linear_strain, const double* stress, const double* state, StressChange<Dim>& to);
}
