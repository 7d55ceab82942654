#include "physics/materials/strength.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lahar {

namespace {

constexpr double radian = std::numbers::pi / 180.0;

double reduced_angle(double degrees, double factor) {
  return std::atan(std::tan(degrees * radian) / factor) / radian;
}

void reduce(MohrCoulomb& law, double factor) {
  for (double* angle : {&law.friction, &law.residual_friction})
    *angle = reduced_angle(*angle, factor);
  for (double* stress : {&law.cohesion, &law.residual_cohesion, &law.tension_cutoff})
    *stress /= factor;
  law.dilation = std::min(law.dilation, law.friction);
  law.residual_dilation = std::min(law.residual_dilation, law.residual_friction);
}

void reduce(DruckerPrager& law, double factor) {
  law.friction = reduced_angle(law.friction, factor);
  law.cohesion /= factor;
  law.tension_cutoff /= factor;
  law.dilation = std::min(law.dilation, law.friction);
}

void reduce(VonMises& law, double factor) {
  law.yield_stress /= factor;
  law.hardening_modulus /= factor;
}

}  // namespace

bool reduce_strength(Law& law, double factor) {
  return std::visit(
      [&](auto& own) {
        if constexpr (requires { reduce(own, factor); }) {
          reduce(own, factor);
          return true;
        } else {
          return false;
        }
      },
      law);
}

}  // namespace lahar
