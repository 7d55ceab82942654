#include "physics/materials/tangent_across.h"

#include "physics/materials/free_strain.h"

namespace lahar {

namespace {

/// H[2][2] for which the stress across the plane is zero. `modulus` and `scale` as
/// strain_without_stress() takes them.
template <class LawType>
double free_gradient(const LawType& law, double modulus, double scale, const double (&H)[3][3],
                     double dt, Kinematics kinematics, const double* stress, const double* state) {
  const auto across = [&](const Scalar& strain, unsigned) {
    Scalar all[3][3], s[6], q[LawType::state.size() + 1];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) all[a][b] = Scalar(H[a][b]);
    all[2][2] = strain;
    update_by<3>(law, all, dt, kinematics, stress, state, s, q);
    return s[2];
  };
  return strain_without_stress<Scalar>(1u, Scalar(modulus), Scalar(scale), across)[0];
}

}  // namespace

Failures stress_change_across(const Law& law, bool free, double (&H)[3][3], double dt,
                              Kinematics kinematics, const double* stress, const double* state,
                              StressChange<3>& to) {
  const Voigt all{stress[0], stress[1], stress[2], stress[3], 0.0, 0.0};
  return std::visit(
      [&](const auto& given) {
        const auto prepared = prepare(free ? with_free_faces(given) : given);
        double scale = 0;
        if (free) {
          const double modulus = compression_modulus(given, all, state);
          for (std::size_t k = 0; k < 4; ++k)
            scale += std::abs(all[k]) + modulus * std::abs(H[k / 2][k % 2]);
          H[2][2] = free_gradient(prepared, modulus, scale, H, dt, kinematics, all.data(), state);
        }
        Failures failures = stress_change<3>(prepared, H, dt, kinematics, all.data(), state, to);
        if (free)
          failures.failed |=
              stress_is_left(Scalar(to.stress[2]), Scalar(scale), given.wave_modulus());
        return failures;
      },
      law);
}

}  // namespace lahar
