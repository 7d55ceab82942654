/// \file Stress paths of one soil particle, as tests of soil laws drive them.
#pragma once

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <random>

#include "physics/materials/law_input.h"
#include "physics/materials/soil_stress.h"

namespace soil {

using lahar::Voigt;

inline Voigt isotropic(double pressure) {
  return {-pressure, -pressure, -pressure, 0, 0, 0};
}

inline Voigt scaled(Voigt v, double factor) {
  for (double& component : v) component *= factor;
  return v;
}

/// A particle of a law: its stress and its state.
template <class Law>
struct Particle {
  const Law& law;
  Voigt stress;
  std::array<double, Law::state.size()> state{};
  int most_parts = 1;  ///< into which an increment had to be divided

  Particle(const Law& of, const Voigt& initial) : law(of), stress(initial) {
    law.initial_state(stress.data(), state.data());
  }
  Particle& operator=(const Particle& other) {
    stress = other.stress;
    state = other.state;
    most_parts = other.most_parts;
    return *this;
  }
  Particle(const Particle&) = default;

  void strain(const Voigt& increment) {
    const int parts = lahar::update_in_parts(law, {increment, 1, 0}, stress, state.data());
    REQUIRE(parts > 0);
    most_parts = std::max(most_parts, parts);
    law.derive(stress.data(), state.data());
  }
  /// The path to `total` in n equal increments.
  void strain(const Voigt& total, int n) {
    for (int i = 0; i < n; ++i) strain(scaled(total, 1.0 / n));
  }
  lahar::SoilStress invariants() const {
    return lahar::with_lode_angle(lahar::soil_stress(stress));
  }
  double p() const { return invariants().p; }
  double q() const { return invariants().q; }
};

/// Axial compression by `axial` in n increments at a constant lateral stress; the lateral strain of
/// each is found by the secant method. `after` is called with the particle before and after each.
template <class Law, class After>
void drained(Particle<Law>& particle, double axial, int n, const After& after) {
  const double lateral_stress = particle.stress[1];
  double lateral = axial / n / 2;
  for (int i = 0; i < n; ++i) {
    const Particle<Law> before = particle;
    const auto miss = [&](double strain) {
      particle = before;
      particle.strain({-axial / n, strain, strain, 0, 0, 0});
      return particle.stress[1] - lateral_stress;
    };
    double other = 0.9 * lateral - 1e-9, error_other = miss(other), error = miss(lateral);
    for (int k = 0; k < 50 && std::abs(error) > 1e-9 * std::abs(lateral_stress); ++k) {
      const double next = lateral - error * (lateral - other) / (error - error_other);
      other = lateral;
      error_other = error;
      lateral = next;
      error = miss(lateral);
    }
    REQUIRE(std::abs(error) <= 1e-9 * std::abs(lateral_stress));
    after(before, particle);
  }
}
template <class Law>
void drained(Particle<Law>& particle, double axial, int n) {
  drained(particle, axial, n, [](const auto&, const auto&) {});
}

inline Eigen::Matrix3d tensor(const Voigt& v, double shear = 1) {
  Eigen::Matrix3d m;
  m << v[0], shear * v[3], shear * v[5], shear * v[3], v[1], shear * v[4], shear * v[5],
      shear * v[4], v[2];
  return m;
}
inline Voigt voigt(const Eigen::Matrix3d& m, double shear = 1) {
  return {m(0, 0), m(1, 1), m(2, 2), m(0, 1) / shear, m(1, 2) / shear, m(0, 2) / shear};
}

/// Random numbers that are the same wherever the tests run.
struct Random {
  std::mt19937_64 engine{20};
  double between(double low, double high) {
    return low + (high - low) * 0x1p-53 * static_cast<double>(engine() >> 11);
  }
  Voigt strain(double size) {
    Voigt v;
    for (double& component : v) component = between(-size, size);
    return v;
  }
  Eigen::Matrix3d rotation() {
    Eigen::Quaterniond q(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1));
    return q.normalized().toRotationMatrix();
  }
};

/// Both of one path of random increments, the other with stress and increments rotated: what the
/// stresses differ by, rotated back, relative to the pressure `scale`.
template <class Law>
double rotation_error(const Law& law, const Voigt& start, double size, int n, double scale) {
  Random random;
  double worst = 0;
  for (int trial = 0; trial < 10; ++trial) {
    const Eigen::Matrix3d R = random.rotation();
    Particle<Law> a(law, start), b(law, voigt(R * tensor(start) * R.transpose()));
    for (int i = 0; i < n; ++i) {
      const Voigt increment = random.strain(size);
      a.strain(increment);
      b.strain(voigt(R * tensor(increment, 0.5) * R.transpose(), 0.5));
    }
    const Voigt back = voigt(R.transpose() * tensor(b.stress) * R);
    worst = std::max(worst, lahar::distance(a.stress, back) / scale);
  }
  return worst;
}

/// Order of convergence of a path as its increments are split: log2 of the ratio of differences of
/// single implicit steps, n, 2 n and 4 n of them.
template <class Law>
double order_when_split(const Particle<Law>& start, const Voigt& total, int n) {
  std::array<Voigt, 3> ends;
  for (std::size_t k = 0; k < 3; ++k) {
    Particle<Law> particle = start;
    const int steps = n << k;
    for (int i = 0; i < steps; ++i)
      REQUIRE(
          particle.law.step(scaled(total, 1.0 / steps), particle.stress, particle.state.data()));
    ends[k] = particle.stress;
  }
  return std::log2(lahar::distance(ends[0], ends[1]) / lahar::distance(ends[1], ends[2]));
}

}  // namespace soil
