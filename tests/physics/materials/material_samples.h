/// \file A law of every kind, random states that it allows, and one increment of it.
#pragma once

#include <Eigen/Geometry>
#include <stdexcept>
#include <variant>
#include <vector>

#include "physics/materials/law.h"
#include "tests/physics/mesh/mesh_fixtures.h"

namespace lahar::test {

/// At least one of every member of Law; all are used by the tests of what holds for any law.
inline std::vector<Law> sample_laws() {
  MohrCoulomb soil{.youngs_modulus = 1e7,
                   .poisson_ratio = 0.3,
                   .friction = 32,
                   .dilation = 8,
                   .cohesion = 2000,
                   .tension_cutoff = 500};
  MohrCoulomb softening = soil;
  softening.softening = true;
  softening.residual_friction = 25;
  softening.residual_dilation = 2;
  softening.residual_cohesion = 500;
  softening.peak_pdstrain = 1e-4;
  softening.residual_pdstrain = 5e-3;
  ModifiedCamClay clay{};
  clay.youngs_modulus = 1e7;
  clay.poisson_ratio = 0.3;
  clay.p_ref = 1e5;
  clay.e_ref = 1.1362;
  clay.pc0 = 1.5e4;
  clay.ocr = 1.5;
  clay.m = 1.2;
  clay.lambda = 0.1;
  clay.kappa = 0.03;
  NorSand sand{};
  sand.poisson_ratio = 0.3;
  sand.reference_pressure = 1000;
  sand.friction_cs = 30;
  sand.N = 0.3;
  sand.lambda = 0.1;
  sand.kappa = 0.03;
  sand.gamma = 1.3;
  sand.chi = 3.5;
  sand.hardening_modulus = 200;
  sand.void_ratio_initial = 0.85;
  sand.p_image_initial = 8000;
  return {LinearElastic{.youngs_modulus = 1e7, .poisson_ratio = 0.3},
          Newtonian{.bulk_modulus = 2e6, .dynamic_viscosity = 50},
          Bingham{.youngs_modulus = 1e6,
                  .poisson_ratio = 0.3,
                  .tau0 = 200,
                  .mu = 30,
                  .critical_shear_rate = 0.01},
          soil,
          softening,
          clay,
          sand,
          DruckerPrager{.youngs_modulus = 1e7,
                        .poisson_ratio = 0.3,
                        .friction = 30,
                        .dilation = 5,
                        .cohesion = 2000,
                        .tension_cutoff = 1000},
          VonMises{.youngs_modulus = 1e7,
                   .poisson_ratio = 0.3,
                   .yield_stress = 4000,
                   .hardening_modulus = 2e5},
          NeoHookean{.youngs_modulus = 1e7, .poisson_ratio = 0.3}};
}

/// The first of sample_laws() of a kind.
template <class LawType>
LawType sample_of() {
  for (const Law& law : sample_laws())
    if (const auto* found = std::get_if<LawType>(&law)) return *found;
  throw std::logic_error("sample_laws() does not have this law");
}

inline std::string_view name_of(const Law& law) {
  return std::visit([](const auto& m) { return m.name; }, law);
}

/// A particle in space: stress [Pa] and state variables.
struct PointState {
  Voigt stress{};
  std::vector<double> state;
};

/// Before the first step, with a pressure [Pa] that every law bears.
inline PointState fresh_point(const Law& law, double pressure = 1e4) {
  PointState point{{-pressure, -pressure, -pressure, 0, 0, 0}, {}};
  point.state.resize(std::max<std::size_t>(1, state_variables(law).size()));
  initial_state(law, point.stress, point.state.data());
  return point;
}

/// One step with a velocity gradient [1/s], by the code of one lane.
inline Failures apply(const Law& law, const Eigen::Matrix3d& gradient, double dt,
                      PointState& point) {
  LawInput<3, Scalar> in;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) in.gradient[a][b] = Scalar(gradient(a, b));
  const Eigen::Matrix3d D = gradient + gradient.transpose();
  const double rate[6] = {D(0, 0) / 2, D(1, 1) / 2, D(2, 2) / 2, D(0, 1), D(1, 2), D(0, 2)};
  for (int k = 0; k < 6; ++k) in.rate[k] = Scalar(rate[k]);
  in.dt = dt;
  in.volumetric = gradient.trace() * dt;
  Scalar stress[6];
  std::vector<Scalar> state;
  for (int k = 0; k < 6; ++k) stress[k] = Scalar(point.stress[static_cast<std::size_t>(k)]);
  for (const double q : point.state) state.emplace_back(q);
  const Failures failures =
      std::visit([&](const auto& m) { return update(prepare(m), in, stress, state.data()); }, law);
  for (std::size_t k = 0; k < 6; ++k) point.stress[k] = stress[k][0];
  for (std::size_t k = 0; k < state.size(); ++k) point.state[k] = state[k][0];
  return failures;
}

inline Eigen::Matrix3d random_matrix(std::mt19937& random, double size) {
  Eigen::Matrix3d m;
  for (int k = 0; k < 9; ++k) m.data()[k] = uniform(random, -size, size);
  return m;
}

/// A state that `steps` random increments lead to.
inline PointState random_point(const Law& law, std::mt19937& random, int steps, double size) {
  PointState point = fresh_point(law);
  for (int i = 0; i < steps; ++i) apply(law, random_matrix(random, size), 1, point);
  return point;
}

inline Eigen::Matrix3d tensor_of(const double* v) {
  Eigen::Matrix3d t;
  t << v[0], v[3], v[5], v[3], v[1], v[4], v[5], v[4], v[2];
  return t;
}

inline void voigt_of(const Eigen::Matrix3d& t, double* v) {
  v[0] = t(0, 0), v[1] = t(1, 1), v[2] = t(2, 2), v[3] = t(0, 1), v[4] = t(1, 2), v[5] = t(0, 2);
}

}  // namespace lahar::test
