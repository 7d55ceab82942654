// Constitutive laws against independent transcriptions of their equations, on random values.
#include <doctest/doctest.h>

#include <cmath>

#include "physics/materials/law.h"
#include "tests/physics/materials/material_samples.h"
#include "tests/physics/mesh/mesh_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

using Tensor = Eigen::Matrix3d;

/// Tensor of Voigt rows (2D xx yy zz xy); `shear` is the share of a shear row in the tensor.
template <int Dim>
Tensor tensor(const double* v, double shear) {
  Tensor t = Tensor::Zero();
  for (int k = 0; k < 3; ++k) t(k, k) = v[k];
  t(0, 1) = t(1, 0) = shear * v[3];
  if constexpr (Dim == 3) {
    t(1, 2) = t(2, 1) = shear * v[4];
    t(0, 2) = t(2, 0) = shear * v[5];
  }
  return t;
}

template <int Dim>
struct Random {
  static constexpr int rows = stress_components<Dim>;
  double rate[6], stress[6], pressure, dt, volumetric;

  explicit Random(std::mt19937& random) {
    for (int k = 0; k < rows; ++k) {
      rate[k] = uniform(random, -1, 1);
      stress[k] = uniform(random, -100, 100);
    }
    if (Dim == 2) rate[2] = 0;  // plane strain
    pressure = uniform(random, -50, 50);
    dt = uniform(random, 0.01, 0.1);
    volumetric = uniform(random, -0.1, 0.1);
  }

  /// Stress after the law, by the kernel's code.
  template <class Law>
  Tensor after(const Law& law, double& p) const {
    LawInput<Dim, Scalar> in;
    Scalar s[rows], state = p;
    for (int k = 0; k < rows; ++k) in.rate[k] = rate[k], s[k] = stress[k];
    in.dt = dt;
    in.volumetric = volumetric;
    update(law, in, s, &state);
    p = state[0];
    double plain[rows];
    for (int k = 0; k < rows; ++k) plain[k] = s[k][0];
    return tensor<Dim>(plain, 1);
  }
};

template <int Dim>
void check_hooke(std::mt19937& random) {
  const Random<Dim> r(random);
  const double E = uniform(random, 1, 1000), nu = uniform(random, -0.4, 0.45);
  const Tensor de = tensor<Dim>(r.rate, 0.5) * r.dt;
  const double K = E / 3 / (1 - 2 * nu), G = E / 2 / (1 + nu);
  const Tensor deviator = de - de.trace() / 3 * Tensor::Identity();
  const Tensor expected =
      tensor<Dim>(r.stress, 1) + K * de.trace() * Tensor::Identity() + 2 * G * deviator;
  double unused = 0;
  const Tensor found = r.after(LinearElastic{.youngs_modulus = E, .poisson_ratio = nu}, unused);
  CHECK((found - expected).norm() < 1e-12 * expected.norm());
}

template <int Dim>
void check_newton(std::mt19937& random, bool incompressible) {
  const Random<Dim> r(random);
  const double K = uniform(random, 1, 1000), mu = uniform(random, 0, 10);
  const Tensor D = tensor<Dim>(r.rate, 0.5);
  const double p = r.pressure - (incompressible ? 0 : K * r.volumetric);
  Tensor expected = 2 * mu * D;
  if (!incompressible) expected -= (p + 2.0 / 3 * mu * D.trace()) * Tensor::Identity();
  double pressure = r.pressure;
  const Tensor found = r.after(
      Newtonian{.bulk_modulus = K, .dynamic_viscosity = mu, .incompressible = incompressible},
      pressure);
  CHECK((found - expected).norm() < 1e-12 * (1 + expected.norm()));
  CHECK(pressure == doctest::Approx(p).epsilon(1e-13));
}

/// Strain by increments beside the stress that the law makes of them.
template <int Dim>
void check_strain_of(std::mt19937& random) {
  const LinearElastic law{.youngs_modulus = std::pow(10.0, uniform(random, 0, 10)),
                          .poisson_ratio = uniform(random, -0.9, 0.49)};
  std::array<double, stress_components<Dim>> strain{}, sigma;
  Scalar stress[stress_components<Dim>];
  for (auto& s : stress) s = Scalar(0.0);
  for (int increment = 0; increment < 20; ++increment) {
    const Random<Dim> r(random);
    LawInput<Dim, Scalar> in;
    for (int k = 0; k < r.rows; ++k) {
      in.rate[k] = 1e-3 * r.rate[k];
      strain[static_cast<std::size_t>(k)] += r.dt * 1e-3 * r.rate[k];
    }
    in.dt = r.dt;
    in.volumetric = r.volumetric;
    Scalar unused(0.0);
    update(law, in, stress, &unused);
  }
  for (std::size_t k = 0; k < sigma.size(); ++k) sigma[k] = stress[k][0];
  const auto found = strain_of<Dim>(law, sigma);
  double largest = 0;
  for (const double e : strain) largest = std::max(largest, std::abs(e));
  // Near incompressibility the trace of the strain is lost in the pressure's rounding.
  const double condition = 1 / (1 - 2 * law.poisson_ratio) + 1 / (1 + law.poisson_ratio);
  for (std::size_t k = 0; k < found.size(); ++k)
    CHECK(std::abs(found[k] - strain[k]) < 1e-14 * condition * largest);
}

}  // namespace

TEST_CASE("the strain of linear elasticity follows from its stress, in plane strain and in space") {
  std::mt19937 random(14);
  for (int trial = 0; trial < 500; ++trial) {
    check_strain_of<2>(random);
    check_strain_of<3>(random);
  }
  CHECK(strain_follows_from_stress(LinearElastic{}));
  CHECK(!strain_follows_from_stress(Newtonian{}));
}

TEST_CASE("linear elasticity is Hooke's law in rate form, in plane strain and in space") {
  std::mt19937 random(11);
  for (int trial = 0; trial < 500; ++trial) {
    check_hooke<2>(random);
    check_hooke<3>(random);
  }
}

TEST_CASE("a Newtonian fluid has pressure from the change of volume and viscous shear") {
  std::mt19937 random(12);
  for (int trial = 0; trial < 500; ++trial)
    for (const bool incompressible : {false, true}) {
      check_newton<2>(random, incompressible);
      check_newton<3>(random, incompressible);
    }
}

TEST_CASE("every lane of a pack gets what a single particle gets") {
  std::mt19937 random(13);
  const LinearElastic solid{.youngs_modulus = 100, .poisson_ratio = 0.3};
  const Newtonian fluid{.bulk_modulus = 50, .dynamic_viscosity = 2};
  std::vector<Random<3>> all;
  for (int k = 0; k < lanes<Pack>; ++k) all.emplace_back(random);
  LawInput<3, Pack> in;
  in.dt = all[0].dt;
  in.volumetric = all[0].volumetric;
  Pack elastic[6], viscous[6], pressure;
  std::vector<double> lane(lanes<Pack>);
  const auto gather = [&](auto value) {
    for (int k = 0; k < lanes<Pack>; ++k) lane[static_cast<std::size_t>(k)] = value(k);
    return load<Pack>(lane.data());
  };
  const auto of = [&](int k) -> Random<3>& { return all[static_cast<std::size_t>(k)]; };
  for (int c = 0; c < 6; ++c) {
    in.rate[c] = gather([&](int k) { return of(k).rate[c]; });
    elastic[c] = viscous[c] = gather([&](int k) { return of(k).stress[c]; });
  }
  pressure = gather([&](int k) { return of(k).pressure; });
  Pack unused(0.0);
  update(solid, in, elastic, &unused);
  update(fluid, in, viscous, &pressure);
  for (int k = 0; k < lanes<Pack>; ++k) {
    of(k).dt = in.dt;
    of(k).volumetric = in.volumetric[0];
    double p = of(k).pressure, none = 0;
    const Tensor s = of(k).after(solid, none), f = of(k).after(fluid, p);
    const int row[6] = {0, 1, 2, 0, 1, 0}, column[6] = {0, 1, 2, 1, 2, 2};
    for (int c = 0; c < 6; ++c) {
      CHECK(elastic[c][k] == doctest::Approx(s(row[c], column[c])).epsilon(1e-13));
      CHECK(viscous[c][k] == doctest::Approx(f(row[c], column[c])).epsilon(1e-13));
    }
    CHECK(pressure[k] == doctest::Approx(p).epsilon(1e-13));
  }
}

TEST_CASE("waves have the moduli of the stress in soils whose stiffness follows it") {
  int follow = 0;
  for (const Law& law : sample_laws()) {
    const double most = wave_modulus(law);
    const auto at = [&](double pressure) {
      const Voigt stress{-pressure, -pressure, -pressure, 0, 0, 0};
      double state[most_state] = {};
      initial_state(law, stress, state);
      return wave_moduli(law, stress, state);
    };
    if (!stiffness_follows_stress(law)) {
      CHECK(at(1000).compression == most);
      CHECK(at(1000).shear == shear_wave_modulus(law));
      continue;
    }
    ++follow;
    const WaveModuli one = at(1000), two = at(2000);
    CHECK(one.compression < most);
    CHECK(one.shear > 0);
    if (const auto* clay = std::get_if<ModifiedCamClay>(&law); clay && !clay->bonding) {
      const double nu = clay->poisson_ratio,
                   K = (1 + clay->initial_void_ratio()) / clay->kappa * 1000;
      CHECK(std::abs(one.compression / (3 * K * (1 - nu) / (1 + nu)) - 1) < 1e-12);
      CHECK(std::abs(one.shear / (1.5 * K * (1 - 2 * nu) / (1 + nu)) - 1) < 1e-12);
      CHECK(std::abs(two.compression / one.compression - 2) < 1e-12);
    }
    // The bound that the time step has, however large the pressure; some stiffness without any.
    CHECK(at(1e9).compression <= most * (1 + 1e-14));
    CHECK(at(0).compression > 0);
  }
  CHECK(follow >= 2);
}

TEST_CASE("wave moduli: K + 4/3 G of the solid, K of the fluid, none if it is incompressible") {
  const double E = 200, nu = 0.3, K = E / 3 / (1 - 2 * nu), G = E / 2 / (1 + nu);
  CHECK(wave_modulus(LinearElastic{.youngs_modulus = E, .poisson_ratio = nu}) ==
        doctest::Approx(K + 4 * G / 3).epsilon(1e-14));
  CHECK(wave_modulus(Newtonian{.bulk_modulus = 70, .dynamic_viscosity = 1}) == 70);
  CHECK(wave_modulus(
            Newtonian{.bulk_modulus = 70, .dynamic_viscosity = 1, .incompressible = true}) == 0);
  CHECK(viscosity(Newtonian{.bulk_modulus = 70, .dynamic_viscosity = 3}) ==
        doctest::Approx(4).epsilon(1e-15));
  CHECK(viscosity(LinearElastic{.youngs_modulus = E, .poisson_ratio = nu}) == 0);
}
