/// \file An elastic block on a rigid plane with friction, by finite elements: what theory says of
/// the blocks of rigid_incline.h, by another method. It has no part of the program's code.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace lahar::verification {

/// Rectangles with linear functions, lumped masses and explicit steps, in axes of the plane (x down
/// along it). Rotations of an element may be large, its strains are small. Corners on the plane
/// have springs with Coulomb's friction, as particles have on rigid bodies.
struct ElasticBlock {
  double angle, friction;
  int nx = 12, ny = 3;
  double viscosity = 0;  ///< [s] stress of a strain rate over that of a strain
  double ramp = 0;       ///< [s] in which gravity grows
  double end_time = 0.3;
  static constexpr double length = 0.6, height = 0.15, density = 2000, young = 1e8, poisson = 0.2;

  struct Motion {
    double velocity = 0;  ///< [m/s] along the plane, in the mean
    double flight = 0;    ///< share of the time in which nothing touches
  };
  Motion run();

  // What run() works with.
  using Matrix = std::array<std::array<double, 8>, 8>;
  std::size_t node(int i, int j) const { return static_cast<std::size_t>(i + (nx + 1) * j); }
  Matrix stiffness() const;
  void add_element(const Matrix& K, const std::array<std::size_t, 4>& corner);
  bool add_contact(double dt);

  double hx = 0, hy = 0, modulus = 0;  ///< [m], [Pa]
  std::vector<double> mass = {}, x = {}, start = {}, v = {}, f = {},
                      shear = {};  ///< two components per node
};

inline ElasticBlock::Matrix ElasticBlock::stiffness() const {
  const double lame = modulus * poisson / (1 - poisson);
  const double G = 0.5 * young / (1 + poisson), gauss = 1 / std::sqrt(3.0);
  Matrix K{};
  for (const double xi : {-gauss, gauss})
    for (const double eta : {-gauss, gauss}) {
      const double dx[4] = {-(1 - eta) / 2 / hx, (1 - eta) / 2 / hx, (1 + eta) / 2 / hx,
                            -(1 + eta) / 2 / hx};
      const double dy[4] = {-(1 - xi) / 2 / hy, -(1 + xi) / 2 / hy, (1 + xi) / 2 / hy,
                            (1 - xi) / 2 / hy};
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = 0; b < 4; ++b) {
          const double share = hx * hy / 4;
          K[2 * a][2 * b] += share * (modulus * dx[a] * dx[b] + G * dy[a] * dy[b]);
          K[2 * a][2 * b + 1] += share * (lame * dx[a] * dy[b] + G * dy[a] * dx[b]);
          K[2 * a + 1][2 * b] += share * (lame * dy[a] * dx[b] + G * dx[a] * dy[b]);
          K[2 * a + 1][2 * b + 1] += share * (modulus * dy[a] * dy[b] + G * dx[a] * dx[b]);
        }
    }
  return K;
}

/// Forces of an element at its corners, in the axes to which its mean gradient has turned it.
inline void ElasticBlock::add_element(const Matrix& K, const std::array<std::size_t, 4>& corner) {
  const double sx[4] = {-0.5 / hx, 0.5 / hx, 0.5 / hx, -0.5 / hx};
  const double sy[4] = {-0.5 / hy, -0.5 / hy, 0.5 / hy, 0.5 / hy};
  double cosine = 0, sine = 0;
  for (std::size_t a = 0; a < 4; ++a) {
    cosine += sx[a] * x[2 * corner[a]] + sy[a] * x[2 * corner[a] + 1];
    sine += sx[a] * x[2 * corner[a] + 1] - sy[a] * x[2 * corner[a]];
  }
  const double size = std::hypot(cosine, sine);
  cosine /= size;
  sine /= size;
  double moved[8];
  for (std::size_t a = 0; a < 4; ++a) {
    const double* at = &x[2 * corner[a]];
    const double* w = &v[2 * corner[a]];
    const double* from = &start[2 * corner[a]];
    moved[2 * a] =
        cosine * at[0] + sine * at[1] - from[0] + viscosity * (cosine * w[0] + sine * w[1]);
    moved[2 * a + 1] =
        cosine * at[1] - sine * at[0] - from[1] + viscosity * (cosine * w[1] - sine * w[0]);
  }
  for (std::size_t a = 0; a < 4; ++a) {
    double along = 0, across = 0;
    for (std::size_t b = 0; b < 8; ++b) {
      along -= K[2 * a][b] * moved[b];
      across -= K[2 * a + 1][b] * moved[b];
    }
    f[2 * corner[a]] += cosine * along - sine * across;
    f[2 * corner[a] + 1] += sine * along + cosine * across;
  }
}

/// Whether anything touches the plane.
inline bool ElasticBlock::add_contact(double dt) {
  bool touches = false;
  for (int i = 0; i <= nx; ++i) {
    const std::size_t n = node(i, 0), at = static_cast<std::size_t>(i);
    const double area = i == 0 || i == nx ? hx / 2 : hx, k = 2 * modulus * area / hy;
    const double c = 0.6 * std::sqrt(k * density * area * hy / 2);
    const double gap = x[2 * n + 1];
    const double push = gap < 0 ? std::max(0.0, -k * gap - c * v[2 * n + 1]) : 0.0;
    const double most = friction * push;
    shear[at] = std::clamp(shear[at] - k * dt * v[2 * n], -most, most);
    f[2 * n] += std::clamp(shear[at] - c * v[2 * n], -most, most);
    f[2 * n + 1] += push;
    touches = touches || push > 0;
  }
  return touches;
}

inline ElasticBlock::Motion ElasticBlock::run() {
  hx = length / nx;
  hy = height / ny;
  modulus = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));
  const auto nodes = static_cast<std::size_t>((nx + 1) * (ny + 1));
  mass.assign(nodes, 0);
  x.assign(2 * nodes, 0);
  v.assign(2 * nodes, 0);
  shear.assign(static_cast<std::size_t>(nx) + 1, 0);
  std::vector<std::array<std::size_t, 4>> elements;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      elements.push_back({node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)});
  for (const auto& corners : elements)
    for (const std::size_t n : corners) mass[n] += density * hx * hy / 4;
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) {
      x[2 * node(i, j)] = i * hx;
      x[2 * node(i, j) + 1] = j * hy;
    }
  start = x;
  const Matrix K = stiffness();
  const double dt = 0.4 * std::min(hx, hy) / std::sqrt(modulus / density);
  const int steps = static_cast<int>(end_time / dt);
  int flying = 0;
  for (int step = 0; step < steps; ++step) {
    const double load = 9.81 * (ramp > 0 ? std::min(1.0, step * dt / ramp) : 1.0);
    f.assign(2 * nodes, 0);
    for (std::size_t n = 0; n < nodes; ++n) {
      f[2 * n] = mass[n] * load * std::sin(angle);
      f[2 * n + 1] = -mass[n] * load * std::cos(angle);
    }
    for (const auto& corners : elements) add_element(K, corners);
    if (!add_contact(dt)) ++flying;
    for (std::size_t k = 0; k < 2 * nodes; ++k) {
      v[k] += dt * f[k] / mass[k / 2];
      x[k] += dt * v[k];
    }
  }
  Motion motion;
  for (std::size_t n = 0; n < nodes; ++n) motion.velocity += mass[n] * v[2 * n];
  motion.velocity /= density * length * height;
  motion.flight = static_cast<double>(flying) / steps;
  return motion;
}

}  // namespace lahar::verification
