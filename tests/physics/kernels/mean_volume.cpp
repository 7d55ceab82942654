// The mean of volumetric strains over the particles of a bin, and the forces that go with it.
#include "physics/kernels/mean_volume.h"

#include <doctest/doctest.h>

#include <Eigen/LU>

#include "physics/kernels/mean_gradients.h"
#include "tests/physics/kernels/kernels_fixture.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double rounding = 1e-12;  // of sums of some hundred terms of about 1

/// Call with a filled patch of every dimension, kind of cell and functions, and random velocities.
template <class Check>
void on_every_patch(Check check) {
  const auto with = [&](auto make) {
    for (const Slots slots : {Slots::packed, Slots::with_free}) {
      auto f = make();
      std::mt19937 random(71);
      f.fill(random, slots);
      f.model.analysis.mean_volume = true;
      f.model.materials[1].law = f.model.materials[0].law;  // fluids of Q4 and H8 are below
      for (double& v : f.patch.velocity) v = uniform(random, -1, 1);
      CAPTURE(static_cast<int>(f.patch.basis));
      check(f, random);
    }
  };
  with_every_kind(with);
  with_wide_functions(with);
  with_elements(with);
}

}  // namespace

TEST_CASE("explicit steps have the mean volumetric strains that implicit steps have") {
  on_every_patch([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    VelocityGradients<Dim> found;
    const ParticleBins bins(f.patch.bins);
    find_mean_gradients(f.patch, f.context(), bins, found);
    const double* V = f.patch.particles.row(Column::volume);
    double worst = 0, most = 0;
    for_each_bin_with_basis(
        f.patch, bins, [](const ParticleBin&) { return true; },
        [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
          constexpr int n = std::decay_t<decltype(basis)>::nodes;
          double mean[Dim][n];
          mean_gradients<Dim>(basis, bin, V, mean);
          auto k = found.begin(bin, bins);
          for (Local p = bin.begin; p < bin.end; ++p, ++k) {
            double g[Dim][n], L[Dim][Dim], trace = 0;
            gradients_at<Dim>(basis, p, g);
            gradient_of<Dim>(g, mean, f.patch.velocity.data(), nodes, L);
            for (std::size_t a = 0; a < Dim; ++a) {
              trace += L[a][a];
              for (std::size_t b = 0; b < Dim; ++b) {
                worst = std::max(worst, std::abs(found.L[Dim * a + b][k] - L[a][b]));
                most = std::max(most, std::abs(L[a][b]));
              }
            }
            worst = std::max(worst, std::abs(found.trace[k] - trace));
          }
        });
    CHECK(worst < rounding * most);
    CHECK(most > 0.1);
  });
}

// F-bar (de Souza Neto et al. 1996): F_p (mean det F / det F_p)^(1 / Dim).
TEST_CASE("F-bar of an increment differs from B-bar in the second order of the increment") {
  on_every_patch([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    using Matrix = Eigen::Matrix<double, Dim, Dim>;
    const double* V = f.patch.particles.row(Column::volume);
    const auto matrix = [](const double(&H)[Dim][Dim]) {
      Matrix M;
      for (int a = 0; a < Dim; ++a)
        for (int b = 0; b < Dim; ++b) M(a, b) = H[a][b];
      return M;
    };
    const auto difference = [&](double dt, bool with_mean) {
      double most = 0;
      for_each_bin_with_basis(
          f.patch, ParticleBins(f.patch.bins), [](const ParticleBin&) { return true; },
          [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
            constexpr int n = std::decay_t<decltype(basis)>::nodes;
            double mean[Dim][n], volume = 0, grown = 0;
            mean_gradients<Dim>(basis, bin, V, mean);
            const auto increment = [&](Local p, const double(*means)[n]) -> Matrix {
              double g[Dim][n], L[Dim][Dim];
              gradients_at<Dim>(basis, p, g);
              gradient_of<Dim>(g, means, f.patch.velocity.data(), nodes, L);
              return Matrix::Identity() + dt * matrix(L);
            };
            for (Local p = bin.begin; p < bin.end; ++p) {
              volume += V[p];
              grown += V[p] * increment(p, nullptr).determinant();
            }
            for (Local p = bin.begin; p < bin.end; ++p) {
              const Matrix F = increment(p, nullptr);
              const double share = grown / volume / F.determinant();
              const Matrix F_bar = std::pow(share, 1.0 / Dim) * F;
              most = std::max(most, (F_bar - increment(p, with_mean ? mean : nullptr)).norm());
            }
          });
      return most;
    };
    // Velocities of 1 m/s in cells of 1 m, where CPDI's gradients are ten times as large.
    const double coarse = difference(1e-4, true), fine = difference(5e-5, true);
    if (f.patch.element == Element::T3 || f.patch.element == Element::Tet4) {
      CHECK(coarse < 1e-14);  // the strain of a cell is uniform
      return;
    }
    CHECK(coarse / fine == within(0.05, 4));
    CHECK(difference(1e-4, false) / difference(5e-5, false) == within(0.05, 2));
    CHECK(coarse < 0.05 * difference(1e-4, false));
  });
}

TEST_CASE("forces do the work of the stresses at the mean of volumetric strains, on every basis") {
  on_every_patch([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    const ParticleBins bins(f.patch.bins);
    map_mean_force(f.patch, f.context(), bins);
    VelocityGradients<Dim> gradients;
    find_mean_gradients(f.patch, f.context(), bins, gradients);
    double nodes = 0, particles = 0, size = 0;
    for (Local n = 0; n < f.patch.n_nodes(); ++n)
      for (int d = 0; d < Dim; ++d)
        nodes += f.sum(NodeSum::force, n, d) * f.patch.velocity[f.at(n, d)];
    constexpr int voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    for (const ParticleBin& bin : bins)
      for (Local p = bin.begin; p < bin.end; ++p) {
        const auto k = gradients.begin(bin, bins) + static_cast<std::size_t>(p - bin.begin);
        for (int a = 0; a < Dim; ++a)
          for (int b = 0; b < Dim; ++b) {
            const double power = f.at(Column::volume, p) * f.at(Column::stress, p, voigt[a][b]) *
                                 gradients.L[static_cast<std::size_t>(Dim * a + b)][k];
            particles += power;
            size += std::abs(power);
          }
      }
    CHECK(std::abs(nodes + particles) < rounding * size);
    CHECK(size > 1);
  });
}

TEST_CASE("fluids with the functions of Q4 and H8 have the volume and pressure of the centre") {
  with_every_kind([](auto make) {
    auto f = make();
    std::mt19937 random(71);
    f.fill(random, Slots::packed);
    f.model.analysis.mean_volume = true;
    for (double& v : f.patch.velocity) v = uniform(random, -1, 1);
    if (general::is(f.patch)) return;
    VelocityGradients<std::decay_t<decltype(f)>::dim> with, without;
    const ParticleBins bins(f.patch.bins);
    find_mean_gradients(f.patch, f.context(), bins, with);
    find_particle_gradients(f.patch, f.context(), bins, without);
    Index fluids = 0;
    for (const ParticleBin& bin : bins) {
      if (bin.material != 1 || bin.begin == bin.end) continue;
      const auto first = with.begin(bin, bins);
      for (auto k = first; k < first + static_cast<std::size_t>(bin.end - bin.begin); ++k) {
        ++fluids;
        CHECK(with.trace[k] == with.trace[first]);
        CHECK(with.L[0][k] == without.L[0][k]);  // shear and strain of each are its own
      }
    }
    CHECK(fluids > 10);
  });
}

TEST_CASE("a linear velocity strains particles alike, with and without the mean") {
  on_every_patch([](auto& f, std::mt19937& random) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;

    const auto A = set_linear(f, f.patch.velocity, random).first;
    VelocityGradients<Dim> gradients;
    const ParticleBins bins(f.patch.bins);
    find_mean_gradients(f.patch, f.context(), bins, gradients);
    double worst = 0;
    for (const ParticleBin& bin : bins)
      for (Local p = bin.begin; p < bin.end; ++p) {
        const auto k = gradients.begin(bin, bins) + static_cast<std::size_t>(p - bin.begin);
        for (int a = 0; a < Dim; ++a)
          for (int b = 0; b < Dim; ++b)
            worst = std::max(
                worst, std::abs(gradients.L[static_cast<std::size_t>(Dim * a + b)][k] - A(a, b)));
      }
    if (f.patch.element != Element::T6 && f.patch.element != Element::Q9 &&
        f.patch.element != Element::H27)  // nodal values of Bernstein's functions are others
      CHECK(worst < 1e-11);
  });
}

TEST_CASE("means are those of a bin, whatever is in free slots and in other calls") {
  on_every_patch([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    Particles<Dim>& particles = f.patch.particles;
    map_mean_force(f.patch, f.context(), f.patch.bins);
    const auto once = f.patch.sums;
    for (auto& copies : f.patch.sums)
      for (auto& sums : copies) std::fill(sums.begin(), sums.end(), 0.0);
    std::vector<char> used(static_cast<std::size_t>(particles.size()), 0);
    f.patch.for_each_particle([&](Local p) { used[static_cast<std::size_t>(p)] = 1; });
    for (std::size_t p = 0; p < used.size(); ++p)
      for (int k = 0; k < stress_components<Dim> && !used[p]; ++k)
        particles.row(Column::stress, k)[p] = 1e9;
    for (ParticleBin& bin : f.patch.bins) map_mean_force(f.patch, f.context(), {&bin, 1});
    CHECK(f.patch.sums == once);
  });
}
