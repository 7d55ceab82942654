// Kernels of one patch: conservation, exactness for linear fields, packs against single particles.
#include <doctest/doctest.h>

#include "tests/physics/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr int mass_momentum = static_cast<int>(NodeSum::mass_momentum);
constexpr int force = static_cast<int>(NodeSum::force);
constexpr int momentum = static_cast<int>(NodeSum::momentum);

template <class Fixture>
double sum_particles(const Fixture& f, auto value) {
  double sum = 0;
  for (Local p = 0; p < f.size(); ++p) sum += value(p);
  return sum;
}

template <class Fixture>
double sum_nodes(const Fixture& f, int which, int component) {
  const int width = node_sum_width<Fixture::dim>[static_cast<std::size_t>(which)];
  double sum = 0;
  for (Local n = 0; n < f.patch.n_nodes(); ++n)
    sum += f.patch.partial[static_cast<std::size_t>(which)]
                          [static_cast<std::size_t>(n * width + component)];
  return sum;
}

/// Rounding of sums of about 20 values of order 1 to 100.
constexpr double rounding = 1e-12;

}  // namespace

TEST_CASE("particles to nodes: mass and momentum are conserved, by both mappings") {
  on_every_mesh([](auto& f, std::mt19937&) {
    map_mass_momentum(f.patch);
    map_momentum(f.patch);
    const double mass = sum_particles(f, [&](Local p) { return f.at(Column::mass, p); });
    CHECK(sum_nodes(f, mass_momentum, 0) == doctest::Approx(mass).epsilon(1e-14));
    for (int d = 0; d < f.dim; ++d) {
      const double expected =
          sum_particles(f, [&](Local p) { return f.at(Column::mass, p) * f.at(Column::v, p, d); });
      CHECK(std::abs(sum_nodes(f, mass_momentum, 1 + d) - expected) < rounding);
      CHECK(std::abs(sum_nodes(f, momentum, d) - expected) < rounding);
    }
  });
}

TEST_CASE("particles to nodes: the first moment of mass is where the particles are") {
  // sum_i m_i x_i = sum_p m_p x_p, because shape functions reproduce linear functions.
  on_every_mesh([](auto& f, std::mt19937&) {
    map_mass_momentum(f.patch);
    for (int d = 0; d < f.dim; ++d) {
      double nodes = 0;
      for (Local n = 0; n < f.patch.n_nodes(); ++n)
        nodes += f.patch.partial[mass_momentum][static_cast<std::size_t>(4 * n)] *
                 f.patch.node_position[static_cast<std::size_t>(n)][d];
      const double particles =
          sum_particles(f, [&](Local p) { return f.at(Column::mass, p) * f.at(Column::x, p, d); });
      CHECK(std::abs(nodes - particles) < rounding * 100);
    }
  });
}

TEST_CASE("internal forces add up to nothing and do the work of the stresses") {
  on_every_mesh([](auto& f, std::mt19937& random) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    map_force(f.patch, f.context());
    for (int d = 0; d < Dim; ++d) CHECK(std::abs(sum_nodes(f, force, d)) < rounding);
    // Virtual work with a linear velocity: sum_i f_i . v_i = -sum_p V_p sigma_p : A.
    const auto A = set_linear(f, f.patch.velocity, random).first;
    const int width = node_sum_width<Dim>[force];
    double nodes = 0;
    for (Local n = 0; n < f.patch.n_nodes(); ++n)
      for (int d = 0; d < Dim; ++d)
        nodes += f.patch.partial[force][static_cast<std::size_t>(n * width + d)] *
                 f.patch.velocity[static_cast<std::size_t>(n * Dim + d)];
    const double particles = sum_particles(f, [&](Local p) {
      const auto s = [&](int k) { return f.at(Column::stress, p, k); };
      double power = s(0) * A(0, 0) + s(1) * A(1, 1) + s(3) * (A(0, 1) + A(1, 0));
      if constexpr (Dim == 3)
        power += s(2) * A(2, 2) + s(4) * (A(1, 2) + A(2, 1)) + s(5) * (A(0, 2) + A(2, 0));
      return f.at(Column::volume, p) * power;
    });
    CHECK(std::abs(nodes + particles) < rounding * 100);
  });
}

TEST_CASE("tractions: the nodes get the force t V / size of every loaded particle") {
  on_every_mesh([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    f.model.functions = {{.kind = MathFunction::Kind::linear, .x = {0, 2}, .f = {0, 1}}};
    f.model.tractions = {{.particles = {}, .dir = 0, .traction = 3, .function = -1},
                         {.particles = {}, .dir = Dim - 1, .traction = -2, .function = 0}};
    f.time = 0.5;
    for (Local p = 0; p < f.size(); ++p)
      f.patch.particles.loads[static_cast<std::size_t>(p)] = static_cast<std::uint64_t>(p % 4);
    f.patch.runs_valid = false;
    receive(f.patch);
    map_force(f.patch, f.context());
    const auto loaded = [&](unsigned bit, double t) {
      return sum_particles(f, [&](Local p) {
        return f.patch.particles.loads[static_cast<std::size_t>(p)] >> bit & 1
                   ? t * f.at(Column::volume, p) / f.at(Column::size, p)
                   : 0.0;
      });
    };
    CHECK(sum_nodes(f, force, 0) == doctest::Approx(loaded(0, 3)).epsilon(1e-12));
    CHECK(sum_nodes(f, force, Dim - 1) == doctest::Approx(loaded(1, -0.5)).epsilon(1e-12));
  });
}

TEST_CASE("nodes to particles: a linear field arrives exactly, by FLIP, PIC and their blend") {
  on_every_mesh([](auto& f, std::mt19937& random) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    for (const double flip : {1.0, 0.0, 0.7}) {
      f.model.analysis.flip = flip;
      const auto [A, b] = set_linear(f, f.patch.velocity, random);
      const auto [B, c] = set_linear(f, f.patch.acceleration, random);
      std::vector<Vec<Dim>> x, v, u;
      for (Local p = 0; p < f.size(); ++p) {
        const auto vector = [&](Column column) {
          Vec<Dim> w;
          for (int d = 0; d < Dim; ++d) w[d] = f.at(column, p, d);
          return w;
        };
        // Natural coordinates are of this position: it is the one of the test before.
        x.push_back(
            f.physical(f.patch.particles.cell[static_cast<std::size_t>(p)], vector(Column::xi)));
        v.push_back(vector(Column::v));
        u.push_back(vector(Column::u));
        for (int d = 0; d < Dim; ++d) f.at(Column::x, p, d) = x.back()[d];
      }
      update_particles(f.patch, f.context());
      double worst = 0;
      for (Local p = 0; p < f.size(); ++p) {
        const auto i = static_cast<std::size_t>(p);
        const Vec<Dim> nodal = A * x[i] + b, acceleration = B * x[i] + c;
        const Vec<Dim> expected = flip * (v[i] + f.dt * acceleration) + (1 - flip) * nodal;
        for (int d = 0; d < Dim; ++d)
          worst = std::max({worst, std::abs(f.at(Column::v, p, d) - expected[d]),
                            std::abs(f.at(Column::x, p, d) - x[i][d] - f.dt * nodal[d]),
                            std::abs(f.at(Column::u, p, d) - u[i][d] - f.dt * nodal[d])});
      }
      CHECK(worst < 1e-13);
    }
  });
}

TEST_CASE("a linear velocity strains all particles alike and changes volumes by its trace") {
  on_every_mesh([](auto& f, std::mt19937& random) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    const auto A = set_linear(f, f.patch.velocity, random).first;
    std::vector<double> volume, strain;
    for (Local p = 0; p < f.size(); ++p) {
      volume.push_back(f.at(Column::volume, p));
      for (int k = 0; k < strain_components<Dim>; ++k) strain.push_back(f.at(Column::strain, p, k));
    }
    update_stress(f.patch, f.context(), StressPart::both);
    std::vector<double> rate{A(0, 0), A(1, 1)};
    if constexpr (Dim == 3) rate.push_back(A(2, 2));
    rate.push_back(A(0, 1) + A(1, 0));
    if constexpr (Dim == 3) {
      rate.push_back(A(1, 2) + A(2, 1));
      rate.push_back(A(0, 2) + A(2, 0));
    }
    double worst = 0, worst_volume = 0;
    for (Local p = 0; p < f.size(); ++p) {
      const auto i = static_cast<std::size_t>(p);
      for (std::size_t k = 0; k < rate.size(); ++k)
        worst = std::max(worst, std::abs(f.at(Column::strain, p, static_cast<int>(k)) -
                                         strain[i * rate.size() + k] - f.dt * rate[k]));
      worst_volume = std::max(worst_volume,
                              std::abs(f.at(Column::volume, p) / volume[i] - 1 - f.dt * A.trace()));
    }
    CHECK(worst < 1e-13);
    CHECK(worst_volume < 1e-13);
    CHECK(f.patch.mark.kind == Mark::Kind::none);
  });
}
