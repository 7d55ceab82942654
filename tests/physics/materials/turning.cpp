// Stresses turn with the material.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "physics/kernels/strain_rate.h"
#include "physics/materials/tangent.h"
#include "tests/physics/materials/material_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr std::size_t row_of[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

/// The components in the plane of a tensor of 2D alone; all in 3D.
template <int Dim>
Eigen::Matrix3d in_plane_tensor(const double* s) {
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      if (row_of[a][b] < static_cast<std::size_t>(stress_components<Dim>))
        tensor(a, b) = s[row_of[a][b]];
  return tensor;
}

template <int Dim>
Eigen::Matrix3d about_an_axis(double angle) {
  const Eigen::Vector3d axis = Dim == 2 ? Eigen::Vector3d(0, 0, 1) : Eigen::Vector3d(1, 2, -1);
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

/// R - 1 in the space of a model.
template <int Dim>
void rigid_increment(const Eigen::Matrix3d& R, double (&H)[Dim][Dim]) {
  for (int a = 0; a < Dim; ++a)
    for (int b = 0; b < Dim; ++b) H[a][b] = R(a, b) - (a == b ? 1.0 : 0.0);
}

constexpr double stress_before[6] = {-5e3, -7e3, -6e3, 500, -300, 200};

template <int Dim, class LawType>
void check_rigid_rotation(const LawType& law, double angle) {
  double state[most_state] = {}, H[Dim][Dim];
  Voigt begin;
  std::copy_n(stress_before, 6, begin.begin());
  if (Dim == 2) begin[4] = begin[5] = 0;
  if constexpr (requires { law.initial_state(begin.data(), state); })
    law.initial_state(begin.data(), state);
  const Eigen::Matrix3d R = about_an_axis<Dim>(angle);
  rigid_increment<Dim>(R, H);
  StressChange<Dim> to{};
  REQUIRE(stress_change<Dim>(prepare(law), H, 0.5, {.turns_stress = true}, begin.data(), state, to)
              .failed == 0);
  const Eigen::Matrix3d expected = R * in_plane_tensor<Dim>(begin.data()) * R.transpose();
  CHECK((in_plane_tensor<Dim>(to.stress.data()) - expected).norm() < 1e-9 * expected.norm());
}

template <int Dim>
void check_turn(double angle) {
  double s[6], spin[spins<Dim>];
  std::copy_n(stress_before, 6, s);
  const Eigen::Matrix3d before = in_plane_tensor<Dim>(s);
  // The rotation of a step of the rate w has the angle 2 atan(w dt / 2).
  const double dt = 0.1, w = 2 * std::tan(angle / 2) / dt;
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -1).normalized();
  if (Dim == 2)
    spin[0] = w;
  else
    for (int d = 0; d < spins<Dim>; ++d) spin[d] = w * axis[d];
  turn<Dim>(spin, dt, s);
  const Eigen::Matrix3d R = about_an_axis<Dim>(angle);
  CHECK((in_plane_tensor<Dim>(s) - R * before * R.transpose()).norm() < 1e-12 * before.norm());
}

}  // namespace

TEST_CASE(
    "stresses turn by the rotation of a step, however large, and stay to the bit without one") {
  for (const double angle : {1e-6, 0.1, -2.5}) {
    check_turn<2>(angle);
    check_turn<3>(angle);
  }
  double s[6];
  std::copy_n(stress_before, 6, s);
  turn<3>({0.0, 0.0, 0.0}, 1.0, s);
  turn<2>({0.0}, 1.0, s);
  for (int k = 0; k < 6; ++k) CHECK(s[k] == stress_before[k]);
}

TEST_CASE("the spin of a velocity gradient is the rate at which lines turn in the mean") {
  double plane[1], space[3];
  spin_of<2>({{0.0, -0.3}, {0.5, 0.0}}, plane);
  CHECK(plane[0] == doctest::Approx(0.4));
  // v = w x r
  spin_of<3>({{0.0, -3.0, 2.0}, {3.0, 0.0, -1.0}, {-2.0, 1.0, 0.0}}, space);
  for (int d = 0; d < 3; ++d) CHECK(space[d] == doctest::Approx(d + 1.0));
}

TEST_CASE(
    "an explicit step takes no strain from a rotation, to the fourth order, and all from a "
    "stretch") {
  static constexpr double dt = 0.1;
  const auto check = []<int Dim>(std::integral_constant<int, Dim>, double angle, bool at_end) {
    // x' = R x: the gradient of the displacement at the beginning, or at the end.
    const Eigen::Matrix3d R = about_an_axis<Dim>(angle);
    const Eigen::Matrix3d H = at_end ? Eigen::Matrix3d(Eigen::Matrix3d::Identity() - R.transpose())
                                     : Eigen::Matrix3d(R - Eigen::Matrix3d::Identity());
    LawInput<Dim, Scalar> in;
    in.dt = dt;
    for (int a = 0; a < Dim; ++a)
      for (int b = 0; b < Dim; ++b) in.gradient[a][b] = Scalar(H(a, b) / dt);
    in.volumetric = H.trace();
    strain_rate<Dim>(in.gradient, in.rate);
    spin_of<Dim>(in.gradient, in.spin);
    take_rotation_out(in, at_end ? -dt / 2 : dt / 2);
    for (const Scalar& rate : in.rate) CHECK(dt * std::abs(rate[0]) < std::pow(angle, 4));
    CHECK(std::abs(in.volumetric[0]) < std::pow(angle, 4));
  };
  for (const double angle : {0.1, 0.01})
    for (const bool at_end : {false, true}) {
      check(std::integral_constant<int, 2>(), angle, at_end);
      check(std::integral_constant<int, 3>(), angle, at_end);
    }
  LawInput<2, Scalar> stretch;
  stretch.dt = dt;
  for (auto& row : stretch.gradient)
    for (Scalar& value : row) value = Scalar(0.3);
  stretch.volumetric = Scalar(0.06);
  strain_rate<2>(stretch.gradient, stretch.rate);
  spin_of<2>(stretch.gradient, stretch.spin);
  take_rotation_out(stretch, dt / 2);
  CHECK(stretch.rate[0][0] == 0.3);
  CHECK(stretch.rate[3][0] == 0.6);
  CHECK(stretch.volumetric[0] == 0.06);
}

TEST_CASE("a rigid rotation of a stressed material turns its stress and does nothing else") {
  for (const Law& law : sample_laws())
    std::visit(
        []<class LawType>(const LawType& of) {
          CAPTURE(LawType::name);
          if constexpr (!pressure_is_state<LawType>) {
            for (const double angle : {1e-3, 0.7}) {
              check_rigid_rotation<2>(of, angle);
              check_rigid_rotation<3>(of, angle);
            }
          }
        },
        law);
}
