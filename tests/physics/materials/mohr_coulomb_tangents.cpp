// Tangents of Mohr-Coulomb in large increments: on faces, edges, cut-off and at the apex.
#include <doctest/doctest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "physics/materials/tangent.h"
#include "tests/physics/materials/material_samples.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// An increment from an isotropic stress.
struct Increment3 {
  const MohrCoulomb& law;
  Eigen::Matrix3d H;

  StressChange<3> change(int column, double step) const {
    const double stress[6] = {-5e3, -5e3, -5e3, 0, 0, 0};
    double state[most_state] = {}, rows[3][3];
    law.initial_state(stress, state);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) rows[a][b] = H(a, b) + (3 * a + b == column ? step : 0.0);
    StressChange<3> to{};
    CHECK(stress_change<3>(prepare(law), rows, 0.5, {}, stress, state, to).failed == 0);
    return to;
  }

  /// Largest difference of the tangent from central differences, beyond half the difference of
  /// those of one side (at a kink), over the largest tangent.
  double error(double h) const {
    const StressChange<3> here = change(0, 0);
    double largest = 1e-3 * law.wave_modulus(), worst = 0;
    for (const auto& row : here.tangent)
      for (const double t : row) largest = std::max(largest, std::abs(t));
    for (int column = 0; column < 9; ++column) {
      const auto up = change(column, h).stress, down = change(column, -h).stress;
      for (std::size_t k = 0; k < up.size(); ++k) {
        const double right = (up[k] - here.stress[k]) / h, left = (here.stress[k] - down[k]) / h;
        const double off = std::abs(here.tangent[k][column] - 0.5 * (right + left));
        worst = std::max(worst, (off - 0.5 * std::abs(right - left)) / largest);
      }
    }
    return worst;
  }

  /// Where the stress ends: on the cut-off or the surface of shear, at which edge, at the apex.
  std::string region() const {
    const StressChange<3> end = change(0, 0);
    if (end.state[6] == 0) return "elastic";
    Eigen::Matrix3d s;
    constexpr std::size_t voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) s(a, b) = end.stress[voigt[a][b]];
    const Eigen::Vector3d w = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(s).eigenvalues();
    const double range = w[2] - w[0], near = 1e-3;
    if (range < near) return "apex";
    const std::string face = std::abs(w[2] - law.tension_cutoff) < near ? "cut-off" : "shear";
    if (w[2] - w[1] < near * range) return face + ", extension edge";
    return w[1] - w[0] < near * range ? face + ", compression edge" : face;
  }
};

struct Count {
  int all = 0, off = 0;
};

std::map<std::string, Count> tangents_of(const MohrCoulomb& law) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  std::map<std::string, Count> found;
  for (int trial = 0; trial < 1500; ++trial) {
    const double size = std::pow(10.0, -3.5 + number(random));
    Eigen::Vector3d strain(number(random), number(random), number(random));
    if (trial % 3 == 1) strain[1] = strain[0];
    if (trial % 3 == 2) strain[1] = strain[0] * (1 + 1e-3 * number(random));
    const Eigen::Matrix3d turn =
        (Eigen::AngleAxisd(3 * number(random), Eigen::Vector3d::UnitX()) *
         Eigen::AngleAxisd(3 * number(random), Eigen::Vector3d(1, 2, 2) / 3))
            .toRotationMatrix();
    const Increment3 increment{law, turn * (size * strain).asDiagonal() * turn.transpose()};
    Count& count = found[increment.region()];
    ++count.all;
    count.off += increment.error(3e-6 * size) > 2e-3;
  }
  return found;
}

}  // namespace

TEST_CASE("tangents of Mohr-Coulomb and Tresca are derivatives on faces, edges and at the apex") {
  MohrCoulomb soil{.youngs_modulus = 1e7,
                   .poisson_ratio = 0.3,
                   .friction = 32,
                   .dilation = 8,
                   .cohesion = 2000,
                   .tension_cutoff = 500};
  MohrCoulomb dilating = soil, clay = soil, torn_clay = soil, sand = soil;
  dilating.dilation = 32, dilating.tension_cutoff = 3200;
  clay.friction = clay.dilation = 0, clay.tension_cutoff = 1e9;
  torn_clay.friction = torn_clay.dilation = 0;
  sand.cohesion = sand.tension_cutoff = 0;
  std::map<std::string, int> seen;
  for (const MohrCoulomb& law : {soil, dilating, clay, torn_clay, sand}) {
    CAPTURE(law.friction);
    CAPTURE(law.dilation);
    CAPTURE(law.tension_cutoff);
    for (const auto& [region, count] : tangents_of(law)) {
      CAPTURE(region);
      CAPTURE(count.all);
      seen[region] += count.all;
      // Beside an edge differences reach across a kink that is not at the increment itself.
      const bool edge = region.find("edge") != std::string::npos;
      CHECK(count.off <= (edge ? 0.03 * count.all + 1 : 0));
    }
  }
  CHECK(seen.size() == 8);
  for (const auto& [region, count] : seen) CHECK(count > 30);
}
