// Increments of many times the yield strain, as implicit steps take them.
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <cmath>

#include "physics/materials/tangent.h"
#include "tests/physics/materials/material_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

using Tensor = Eigen::Matrix3d;
constexpr std::size_t voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

Tensor deviator(const Tensor& a) {
  return a - a.trace() / 3 * Tensor::Identity();
}

double angle(const Tensor& a, const Tensor& b) {
  const Tensor unit = deviator(b).normalized(), other = deviator(a);
  const double along = other.cwiseProduct(unit).sum();
  return std::atan2((other - along * unit).norm(), along);
}

/// Tresca's clay, which yields at a shear strain of c / G.
constexpr double G = 1e9, c = 1e3;
const MohrCoulomb clay{.youngs_modulus = 2.9 * G,
                       .poisson_ratio = 0.45,
                       .friction = 0,
                       .dilation = 0,
                       .cohesion = c,
                       .tension_cutoff = 1e12};

struct ClayPoint {
  Scalar stress[6], state[MohrCoulomb::state.size()];
  ClayPoint() {
    for (Scalar& s : stress) s = Scalar(0.0);
    double begin[MohrCoulomb::state.size()] = {};
    clay.initial_state(nullptr, begin);
    for (std::size_t k = 0; k < MohrCoulomb::state.size(); ++k) state[k] = Scalar(begin[k]);
  }
  void strain(const Tensor& strain) {
    Scalar H[3][3];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) H[a][b] = Scalar(strain(a, b));
    REQUIRE(update<3>(prepare(clay), increment_of<3>(H, 0.5, {}), stress, state).failed == 0);
  }
  Tensor tensor() const {
    Tensor s;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) s(a, b) = stress[voigt[a][b]][0];
    return s;
  }
};

/// A symmetric strain without change of volume, of `size` times the yield strain.
Tensor random_strain(std::mt19937& random, double size) {
  const Tensor any = random_matrix(random, 1.0);
  return size * c / G * deviator(0.5 * (any + any.transpose())).normalized();
}

}  // namespace

TEST_CASE("Tresca in large increments: the stress returns along the deviator of the trial stress") {
  std::mt19937 random(11);
  for (const double size : {2.0, 20.0, 200.0})
    for (int trial = 0; trial < 20; ++trial) {
      CAPTURE(size);
      ClayPoint point;
      point.strain(random_strain(random, 5));  // to the surface
      const Tensor strain = random_strain(random, size);
      const Tensor elastic = point.tensor() + 2 * G * strain;
      point.strain(strain);
      CHECK(angle(point.tensor(), elastic) < 1e-3);  // but for H^2 in the strain
      const auto principal = Eigen::SelfAdjointEigenSolver<Tensor>(point.tensor()).eigenvalues();
      CHECK(principal[2] - principal[0] == doctest::Approx(2 * c).epsilon(1e-9));
    }
}

TEST_CASE("Tresca in large increments: the stress turns into the direction of flow, not beyond") {
  std::mt19937 random(12);
  for (const double size : {3.0, 10.0, 50.0})
    for (int trial = 0; trial < 20; ++trial) {
      CAPTURE(size);
      ClayPoint point;
      point.strain(random_strain(random, 5));
      const Tensor strain = random_strain(random, size);
      double before = angle(point.tensor(), strain);
      for (int step = 0; step < 6; ++step) {
        point.strain(strain);
        const double now = angle(point.tensor(), strain);
        CHECK(now < std::max(0.7 * before, 1e-3));
        before = now;
      }
    }
}
