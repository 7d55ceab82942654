#include "physics/materials/tangent_across.h"

#include "physics/materials/free_strain.h"

namespace lahar {

namespace {

/// H[2][2] for which the stress across the plane is zero.
template <class LawType>
double free_gradient(const LawType& law, double modulus, const double (&H)[3][3], double dt,
                     Kinematics kinematics, const double* stress, const double* state) {
  double scale = 0;
  for (int k = 0; k < 4; ++k) scale += std::abs(stress[k]) + modulus * std::abs(H[k / 2][k % 2]);
  const auto across = [&](const Scalar& strain, unsigned) {
    Scalar all[3][3], s[6], q[LawType::state.size() + 1];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) all[a][b] = Scalar(H[a][b]);
    all[2][2] = strain;
    update_by<3>(law, all, dt, kinematics, stress, state, s, q);
    return s[2];
  };
  return strain_without_stress<Scalar>(1u, modulus, Scalar(scale), across)[0];
}

}  // namespace

Failures stress_change_across(const Law& law, bool free, double (&H)[3][3], double dt,
                              Kinematics kinematics, const double* stress, const double* state,
                              StressChange<3>& to) {
  const double all[6] = {stress[0], stress[1], stress[2], stress[3], 0.0, 0.0};
  return std::visit(
      [&](const auto& given) {
        const auto prepared = prepare(free ? with_free_faces(given) : given);
        if (free)
          H[2][2] = free_gradient(prepared, given.wave_modulus(), H, dt, kinematics, all, state);
        return stress_change<3>(prepared, H, dt, kinematics, all, state, to);
      },
      law);
}

}  // namespace lahar
