#include "physics/materials/tangent.h"

namespace lahar {

template <int Dim>
Failures stress_change(const Law& law, const double (&H)[Dim][Dim], double dt,
                       Kinematics kinematics, const double* stress, const double* state,
                       StressChange<Dim>& to) {
  return std::visit(
      [&](const auto& m) {
        return stress_change<Dim>(prepare(m), H, dt, kinematics, stress, state, to);
      },
      law);
}

template Failures stress_change(const Law&, const double (&)[2][2], double, Kinematics,
                                const double*, const double*, StressChange<2>&);
template Failures stress_change(const Law&, const double (&)[3][3], double, Kinematics,
                                const double*, const double*, StressChange<3>&);

}  // namespace lahar
