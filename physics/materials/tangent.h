/// \file Stress at the end of a finite increment, and its exact derivative, as implicit steps take
/// them.
#pragma once

#include <algorithm>

#include "physics/materials/increment.h"
#include "physics/materials/law.h"

namespace lahar {

/// What a law makes of a finite increment of displacement.
template <int Dim, std::size_t States = most_state>
struct StressChange {
  std::array<double, stress_components<Dim>> stress;  ///< [Pa] at the end
  /// At the end; those that follow from the stress are not set (derive_state()).
  std::array<double, States> state;
  double tangent[stress_components<Dim>][Dim * Dim];  ///< d stress_k / d H_ab, column Dim*a+b [Pa]
};

/// update() of a law, or what prepare() makes of it, with numbers of any kind.
template <int Dim, class Real, class LawType>
Failures update_by(const LawType& law, const Real (&H)[Dim][Dim], double dt, Kinematics kinematics,
                   const double* stress, const double* state, Real* new_stress, Real* new_state) {
  for (std::size_t k = 0; k < stress_components<Dim>; ++k) new_stress[k] = Real(stress[k]);
  for (std::size_t k = 0; k < LawType::state.size(); ++k)
    new_state[k] = Real(LawType::state[k].of_stress ? 0.0 : state[k]);
  return update<Dim>(law, increment_of<Dim, Real>(H, dt, kinematics), new_stress, new_state);
}

/// The increment H = d(delta u)/dx, at the beginning of the step, of a particle with some stress
/// [Pa] and state; `law` is what prepare() gives. Stress and state are those of update(); the
/// tangent is its derivative by dual numbers, through every branch and part of an increment. Where
/// the law has a kink, it is that of one side. Without a tangent an increment has failed.
template <int Dim, class LawType, std::size_t States>
Failures stress_change(const LawType& law, const double (&H)[Dim][Dim], double dt,
                       Kinematics kinematics, const double* stress, const double* state,
                       StressChange<Dim, States>& to) {
  constexpr std::size_t rows = stress_components<Dim>, n = LawType::state.size();
  static_assert(States >= n);
  using D = Dual<static_cast<std::size_t>(Dim) * Dim>;
  Scalar values[Dim][Dim], s[rows], q[n + 1];
  D unknowns[Dim][Dim], ds[rows], dq[n + 1];
  for (int a = 0; a < Dim; ++a)
    for (int b = 0; b < Dim; ++b) {
      values[a][b] = Scalar(H[a][b]);
      unknowns[a][b] = D::unknown(H[a][b], static_cast<std::size_t>(Dim * a + b));
    }
  Failures failures = update_by<Dim>(law, values, dt, kinematics, stress, state, s, q);
  failures.failed |= update_by<Dim>(law, unknowns, dt, kinematics, stress, state, ds, dq).failed;
  for (std::size_t k = 0; k < rows; ++k) {
    to.stress[k] = s[k][0];
    std::copy(ds[k].d.begin(), ds[k].d.end(), to.tangent[k]);
  }
  for (std::size_t k = 0; k < n; ++k)
    if (!LawType::state[k].of_stress) to.state[k] = q[k][0];
  return failures;
}

/// The same for any law.
template <int Dim>
Failures stress_change(const Law& law, const double (&H)[Dim][Dim], double dt,
                       Kinematics kinematics, const double* stress, const double* state,
                       StressChange<Dim>& to);

}  // namespace lahar
