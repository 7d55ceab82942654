// Kernels of one patch: conservation, exactness for linear fields, packs against single particles.
#include <doctest/doctest.h>

#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

using enum NodeSum;

template <class Fixture>
double sum_particles(const Fixture& f, auto value) {
  double sum = 0;
  for (const Local p : f.slots()) sum += value(p);
  return sum;
}

template <class Fixture>
double sum_nodes(const Fixture& f, NodeSum which, int component) {
  double sum = 0;
  for (Local n = 0; n < f.patch.n_nodes(); ++n) sum += f.sum(which, n, component);
  return sum;
}

/// Rounding of sums of about 20 values of order 1 to 100.
constexpr double rounding = 1e-12;

}  // namespace

TEST_CASE("particles to nodes: mass and momentum are conserved, by both mappings") {
  on_every_mesh([](auto& f, std::mt19937&) {
    map_mass_momentum(f.patch, f.context(), f.patch.bins);
    map_momentum(f.patch, f.context(), f.patch.bins);
    const double mass = sum_particles(f, [&](Local p) { return f.at(Column::mass, p); });
    CHECK(sum_nodes(f, mass_momentum, mass_lane) == doctest::Approx(mass).epsilon(1e-14));
    for (int d = 0; d < f.dim; ++d) {
      const double expected =
          sum_particles(f, [&](Local p) { return f.at(Column::mass, p) * f.at(Column::v, p, d); });
      CHECK(std::abs(sum_nodes(f, mass_momentum, d) - expected) < rounding);
      CHECK(std::abs(sum_nodes(f, momentum, d) - expected) < rounding);
    }
  });
}

TEST_CASE("particles to nodes: the first moment of mass is where the particles are") {
  // sum_i m_i x_i = sum_p m_p x_p, because shape functions reproduce linear functions.
  on_every_mesh([](auto& f, std::mt19937&) {
    map_mass_momentum(f.patch, f.context(), f.patch.bins);
    for (int d = 0; d < f.dim; ++d) {
      double nodes = 0;
      for (Local n = 0; n < f.patch.n_nodes(); ++n)
        nodes += f.sum(mass_momentum, n, mass_lane) * f.node(n)[d];
      const double particles =
          sum_particles(f, [&](Local p) { return f.at(Column::mass, p) * f.at(Column::x, p, d); });
      CHECK(std::abs(nodes - particles) < rounding * 100);
    }
  });
}

TEST_CASE("internal forces add up to nothing and do the work of the stresses") {
  on_every_mesh([](auto& f, std::mt19937& random) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    map_force(f.patch, f.context(), f.patch.bins);
    for (int d = 0; d < Dim; ++d) CHECK(std::abs(sum_nodes(f, force, d)) < rounding);
    // Virtual work with a linear velocity: sum_i f_i . v_i = -sum_p V_p sigma_p : A.
    const auto A = set_linear(f, f.patch.velocity, random).first;
    double nodes = 0;
    for (Local n = 0; n < f.patch.n_nodes(); ++n)
      for (int d = 0; d < Dim; ++d) nodes += f.sum(force, n, d) * f.patch.velocity[f.at(n, d)];
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
    for (const Local p : f.slots())
      f.patch.particles.loads[static_cast<std::size_t>(p)] = static_cast<std::uint64_t>(p % 4);
    for (ParticleBin& bin : f.patch.bins) bin.loaded = true;
    map_force(f.patch, f.context(), f.patch.bins);
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
      f.model.analysis.transfer.flip = flip;
      const auto [A, b] = set_linear(f, f.patch.velocity, random);
      const auto [B, c] = set_linear(f, f.patch.acceleration, random);
      std::vector<Vec<Dim>> x, v, u;
      for (const Local p : f.slots()) {
        x.push_back(f.vector(Column::x, p));
        v.push_back(f.vector(Column::v, p));
        u.push_back(f.vector(Column::u, p));
      }
      f.patch.max_speed = 0;
      update_particles(f.patch, f.context(), f.patch.bins);
      double worst = 0, fastest = 0;
      std::size_t i = 0;
      for (const Local p : f.slots()) {
        const Vec<Dim> nodal = A * x[i] + b, acceleration = B * x[i] + c;
        const Vec<Dim> expected = flip * (v[i] + f.dt * acceleration) + (1 - flip) * nodal;
        for (int d = 0; d < Dim; ++d)
          worst = std::max({worst, std::abs(f.at(Column::v, p, d) - expected[d]),
                            std::abs(f.at(Column::x, p, d) - x[i][d] - f.dt * nodal[d]),
                            std::abs(f.at(Column::u, p, d) - u[i][d] - f.dt * nodal[d])});
        fastest = std::max(fastest, f.vector(Column::v, p).norm());
        for (int d = 0; d < Dim; ++d)
          f.at(Column::x, p, d) = x[i][d];  // where it was, for the next
        ++i;
      }
      CHECK(worst < 1e-13);
      CHECK(f.patch.max_speed == doctest::Approx(fastest).epsilon(1e-14));
    }
  });
}

TEST_CASE("a linear velocity strains all particles alike and changes volumes by its trace") {
  on_every_mesh([](auto& f, std::mt19937& random) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    const auto A = set_linear(f, f.patch.velocity, random).first;
    std::vector<double> volume, strain;
    for (const Local p : f.slots()) {
      volume.push_back(f.at(Column::volume, p));
      for (int k = 0; k < strain_components<Dim>; ++k) strain.push_back(f.at(Column::strain, p, k));
    }
    update_stress(f.patch, f.context(), f.patch.bins, StressPart::both);
    std::vector<double> rate{A(0, 0), A(1, 1)};
    if constexpr (Dim == 3) rate.push_back(A(2, 2));
    rate.push_back(A(0, 1) + A(1, 0));
    if constexpr (Dim == 3) {
      rate.push_back(A(1, 2) + A(2, 1));
      rate.push_back(A(0, 2) + A(2, 0));
    }
    double worst = 0, worst_volume = 0;
    std::size_t i = 0;
    for (const Local p : f.slots()) {
      for (std::size_t k = 0; k < rate.size(); ++k)
        worst = std::max(worst, std::abs(f.at(Column::strain, p, static_cast<int>(k)) -
                                         strain[i * rate.size() + k] - f.dt * rate[k]));
      worst_volume = std::max(worst_volume,
                              std::abs(f.at(Column::volume, p) / volume[i] - 1 - f.dt * A.trace()));
      ++i;
    }
    CHECK(worst < 1e-13);
    CHECK(worst_volume < 1e-13);
    CHECK(f.patch.fault.kind == ParticleFault::Kind::none);
  });
}

TEST_CASE("a particle on an edge of its cell moves, and is not strained, with all of its nodes") {
  // Nodes across the cell have a share of its mass, however small: without mass they would stand.
  const auto check = [](auto make) {
    using Fixture = decltype(make());
    constexpr int Dim = Fixture::dim;
    for (int axis = 0; axis < Dim; ++axis)
      for (const double side : {-1.0, 1.0}) {
        Fixture f = make();
        std::mt19937 random(5);
        Vec<Dim> xi = Vec<Dim>::Constant(0.25);
        xi[axis] = side;
        f.add(random, 7, xi, 0);
        for (int d = 0; d < Dim; ++d) f.at(Column::v, 0, d) = d + 1;
        for (int k = 0; k < stress_components<Dim>; ++k) f.at(Column::stress, 0, k) = 0;
        receive(f.patch);
        locate(f.patch, f.context(), f.patch.bins);
        REQUIRE(f.patch.count == 1);
        map_mass_momentum(f.patch, f.context(), f.patch.bins);
        f.patch.least_mass = 1e-25;  // of any model whose particles are as light
        nodal_velocity(f.patch, f.context());
        for (const Local n : f.patch.topology.corner_nodes[7])
          for (int d = 0; d < Dim; ++d)
            CHECK(f.patch.velocity[f.at(n, d)] == doctest::Approx(d + 1).epsilon(1e-14));
        update_stress(f.patch, f.context(), f.patch.bins, StressPart::both);
        for (int k = 0; k < stress_components<Dim>; ++k)
          CHECK(std::abs(f.at(Column::stress, 0, k)) < 1e-13);
      }
  };
  check([] { return OnePatch<2>(boxes<2>()); });
  check([] { return OnePatch<2>(boxes<2>(), Natural::stored); });
  check([] { return OnePatch<3>(boxes<3>()); });
  check([] { return OnePatch<3>(boxes<3>(), Natural::stored); });
}
