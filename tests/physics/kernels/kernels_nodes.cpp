// Nodal kernels: integration, constraints, damping, smoothing; and the time step limit.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

using enum NodeSum;

/// Mass, momentum and force of every node; there is one patch, whose sums are those of all.
template <class Fixture>
void map_all(Fixture& f) {
  map_mass_momentum(f.patch, f.context(), f.patch.bins);
  map_force(f.patch, f.context(), f.patch.bins);
}

template <class Fixture>
double mass(const Fixture& f, Local n) {
  return f.sum(mass_momentum, n, mass_lane);
}
template <class Fixture>
double momentum_of(const Fixture& f, Local n, int d) {
  return f.sum(mass_momentum, n, d);
}
template <class Fixture>
double velocity(const Fixture& f, Local n, int d) {
  return f.patch.velocity[f.at(n, d)];
}
template <class Fixture>
double acceleration(const Fixture& f, Local n, int d) {
  return f.patch.acceleration[f.at(n, d)];
}

}  // namespace

TEST_CASE("nodes move by (f + m g) / m, symplectic Euler") {
  on_every_mesh([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    f.model.gravity = Vec<Dim>::LinSpaced(1, -9);
    map_all(f);
    nodal_velocity(f.patch, f.context());
    std::vector<double> forces;
    for (Local n = 0; n < f.patch.n_nodes(); ++n)
      for (int d = 0; d < Dim; ++d) forces.push_back(f.sum(force, n, d));
    integrate(f.patch, f.context());
    double worst = 0;
    for (Local n = 0; n < f.patch.n_nodes(); ++n)
      for (int d = 0; d < Dim; ++d) {
        if (mass(f, n) == 0) {
          CHECK(velocity(f, n, d) == 0);
          CHECK(acceleration(f, n, d) == 0);
          continue;
        }
        const double a =
            forces[static_cast<std::size_t>(n * Dim + d)] / mass(f, n) + f.model.gravity[d];
        const double v = momentum_of(f, n, d) / mass(f, n) + f.dt * a;
        worst = std::max({worst, std::abs(acceleration(f, n, d) - a) / (1 + std::abs(a)),
                          std::abs(velocity(f, n, d) - v) / (1 + std::abs(v))});
      }
    CHECK(worst < 1e-13);
  });
}

TEST_CASE("gravity grows with its function of time") {
  OnePatch<2> f(boxes<2>());
  std::mt19937 random(1);
  f.add(random, 0, {0, 0}, 0);
  for (int k = 0; k < stress_components<2>; ++k) f.at(Column::stress, 0, k) = 0;
  f.model.gravity = {2, -8};
  f.model.gravity_function = 0;
  f.model.functions = {{.kind = MathFunction::Kind::linear, .x = {0, 1}, .f = {0, 1}}};
  f.time = 0.25;
  receive(f.patch);
  map_all(f);
  nodal_velocity(f.patch, f.context());
  integrate(f.patch, f.context());
  const Local node = f.patch.topology.corner_nodes[0][0];
  CHECK(acceleration(f, node, 0) == doctest::Approx(0.5).epsilon(1e-13));
  CHECK(acceleration(f, node, 1) == doctest::Approx(-2).epsilon(1e-13));
}

TEST_CASE("a node without mass does not move, whatever acts on it") {
  OnePatch<2> f(boxes<2>());
  std::mt19937 random(1);
  f.add(random, 0, {0, 0}, 0);
  f.model.gravity = {0, -9.81};
  receive(f.patch);
  f.patch.forces = {{.node = 40, .dir = 0, .force = 5, .function = -1}};
  map_all(f);
  nodal_velocity(f.patch, f.context());
  integrate(f.patch, f.context());
  CHECK(mass(f, 40) == 0);
  for (int d = 0; d < 2; ++d) {
    CHECK(velocity(f, 40, d) == 0);
    CHECK(acceleration(f, 40, d) == 0);
    CHECK(std::isfinite(velocity(f, 0, d)));
  }
  CHECK(f.patch.work.external != 0);  // of gravity on the nodes that do have mass
}

TEST_CASE("prescribed velocities hold before and after integration, without acceleration") {
  on_every_mesh([](auto& f, std::mt19937&) {
    const Local node = f.patch.topology.corner_nodes[5][0];
    f.patch.fixed = {{.node = node, .dir = 1, .velocity = -2.5}};
    f.patch.forces = {{.node = node, .dir = 1, .force = 100, .function = -1}};
    map_all(f);
    REQUIRE(mass(f, node) > 0);
    nodal_velocity(f.patch, f.context());
    CHECK(velocity(f, node, 1) == -2.5);
    integrate(f.patch, f.context());
    CHECK(velocity(f, node, 1) == -2.5);
    CHECK(acceleration(f, node, 1) == 0);
    CHECK(acceleration(f, node, 0) != 0);
  });
}

TEST_CASE("point forces act with their function of time") {
  on_every_mesh([](auto& f, std::mt19937&) {
    const Local node = f.patch.topology.corner_nodes[5][0];
    f.model.functions = {{.kind = MathFunction::Kind::linear, .x = {0, 1}, .f = {0, 2}}};
    f.time = 0.25;
    map_all(f);
    nodal_velocity(f.patch, f.context());
    const double before = f.sum(force, node, 0), m = mass(f, node);
    f.patch.forces = {{.node = node, .dir = 0, .force = 3, .function = 0},
                      {.node = node, .dir = 0, .force = -1, .function = -1}};
    integrate(f.patch, f.context());
    CHECK(acceleration(f, node, 0) == doctest::Approx((before + 3 * 0.5 - 1) / m).epsilon(1e-12));
  });
}

TEST_CASE("damping opposes each component of the velocity with a share of the unbalanced force") {
  for (const bool as_cbgeo : {false, true})
    on_every_mesh([as_cbgeo](auto& f, std::mt19937&) {
      constexpr int Dim = std::decay_t<decltype(f)>::dim;
      const double alpha = 0.3;
      f.model.analysis.damping_as_cbgeo = as_cbgeo;
      f.model.analysis.damping = alpha;
      map_all(f);
      nodal_velocity(f.patch, f.context());
      const auto v = f.patch.velocity;
      double worst = 0, work = 0;
      std::vector<double> unbalanced;
      for (Local n = 0; n < f.patch.n_nodes(); ++n)
        for (int d = 0; d < Dim; ++d) unbalanced.push_back(f.sum(force, n, d));
      integrate(f.patch, f.context());
      for (Local n = 0; n < f.patch.n_nodes(); ++n) {
        if (mass(f, n) == 0) continue;
        double norm = 0;
        for (int d = 0; d < Dim; ++d)
          norm += std::pow(unbalanced[static_cast<std::size_t>(n * Dim + d)], 2);
        for (int d = 0; d < Dim; ++d) {
          const auto i = f.at(n, d);
          const double own = std::abs(unbalanced[static_cast<std::size_t>(n * Dim + d)]);
          const double size = as_cbgeo ? std::sqrt(norm) : own;
          const double drag = alpha * size * (v[i] > 0 ? 1 : v[i] < 0 ? -1 : 0);
          const double a = (unbalanced[static_cast<std::size_t>(n * Dim + d)] - drag) / mass(f, n);
          worst = std::max(worst, std::abs(acceleration(f, n, d) - a) / (1 + std::abs(a)));
          work += drag * 0.5 * (v[i] + velocity(f, n, d)) * f.dt;
        }
      }
      CHECK(worst < 1e-13);
      CHECK(f.patch.work.damping == doctest::Approx(work).epsilon(1e-11));
    });
}

TEST_CASE(
    "viscous damping slows free nodes by exp(-rate dt), and takes the energy that they lose") {
  on_every_mesh([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    f.model.analysis.damping = 70;  // 0.7 in a step
    f.model.analysis.viscous_damping = true;
    map_mass_momentum(f.patch, f.context(), f.patch.bins);
    nodal_velocity(f.patch, f.context());
    const auto v = f.patch.velocity;
    integrate(f.patch, f.context());
    double worst = 0, before = 0, after = 0;
    for (Local n = 0; n < f.patch.n_nodes(); ++n)
      for (int d = 0; d < Dim && mass(f, n) > 0; ++d) {
        const double old = v[f.at(n, d)], now = velocity(f, n, d);
        worst = std::max(worst, std::abs(now - std::exp(-0.7) * old));
        before += 0.5 * mass(f, n) * old * old;
        after += 0.5 * mass(f, n) * now * now;
      }
    CHECK(worst < 1e-13);
    CHECK(before > 0.1);
    CHECK(f.patch.work.damping == doctest::Approx(before - after).epsilon(1e-11));
  });
}

TEST_CASE("a uniform pressure stays uniform when it is smoothed, and only fluids are smoothed") {
  on_every_mesh([](auto& f, std::mt19937&) {
    bool both[2] = {false, false};
    for (const Local p : f.slots()) {
      const int material = f.patch.particles.material[static_cast<std::size_t>(p)];
      f.at(Column::state, p) = material == 1 ? 12.5 : -3;
      both[material] = true;
    }
    REQUIRE((both[0] && both[1]));
    // Nodes average p over the mass of all particles: make them all fluid first.
    for (const Local p : f.slots())
      if (f.patch.particles.material[static_cast<std::size_t>(p)] == 0) f.at(Column::mass, p) = 0;
    map_mass_momentum(f.patch, f.context(), f.patch.bins);
    nodal_velocity(f.patch, f.context());
    map_pressure(f.patch, f.context(), f.patch.bins);
    nodal_pressure(f.patch, f.context());
    smooth_pressure(f.patch, f.context(), f.patch.bins);
    double worst = 0;
    bool solids_kept = true;
    for (const Local p : f.slots()) {
      const bool fluid = f.patch.particles.material[static_cast<std::size_t>(p)] == 1;
      if (fluid)
        worst = std::max(worst, std::abs(f.at(Column::state, p) - 12.5));
      else
        solids_kept = solids_kept && f.at(Column::state, p) == -3;
    }
    CHECK(worst < 1e-12);
    CHECK(solids_kept);
  });
}

TEST_CASE("the time step limit is the smallest h / (c + |v|), or that of viscous diffusion") {
  on_every_mesh([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    for (const double mu : {0.0, 0.4, 40.0}) {
      f.model.materials[1].law = Newtonian{.bulk_modulus = 20, .dynamic_viscosity = mu};
      double least = 1e9;
      Local where = -1;
      for (const Local p : f.slots()) {
        const auto i = static_cast<std::size_t>(p);
        const bool fluid = f.patch.particles.material[i] == 1;
        const double h = f.model.mesh->cell_size(
            f.patch.topology.cells[static_cast<std::size_t>(f.patch.particles.cell[i])]);
        const double density = f.at(Column::mass, p) / f.at(Column::volume, p);
        // E = 10, nu = 0.3: M = E (1 - nu) / (1 + nu) / (1 - 2 nu).
        const double c = std::sqrt((fluid ? 20 : 7 / (1.3 * 0.4)) / density);
        double v2 = 0;
        for (int d = 0; d < Dim; ++d) v2 += std::pow(f.at(Column::v, p, d), 2);
        double limit = h / (c + std::sqrt(v2));
        if (fluid && mu > 0) limit = std::min(limit, h * h * density / (2 * Dim * 4.0 / 3 * mu));
        if (limit < least) least = limit, where = p;
      }
      Local limiting = -1;
      CHECK(time_step_limit(f.patch, f.model, f.patch.bins, &limiting) ==
            doctest::Approx(least).epsilon(1e-13));
      CHECK(limiting == where);
    }
  });
}

TEST_CASE("a cell whose volume would vanish within a step is a fault with its first particle") {
  OnePatch<2> f(boxes<2>());
  std::mt19937 random(1);
  f.add(random, 7, {0.25, -0.5}, 0);
  f.add(random, 7, {0, 0}, 0);
  receive(f.patch);
  for (Local n = 0; n < f.patch.n_nodes(); ++n)
    for (int d = 0; d < 2; ++d) f.patch.velocity[f.at(n, d)] = -60 * f.node(n)[d];
  update_stress(f.patch, f.context(), f.patch.bins, StressPart::both);  // trace * dt = -1.2
  CHECK(f.patch.fault.kind == ParticleFault::Kind::volume);
  CHECK(f.patch.fault.particle == 1000);
  CHECK(f.patch.fault.count == 2);
  for (int d = 0; d < 2; ++d)
    CHECK(f.patch.fault.position[static_cast<std::size_t>(d)] == f.at(Column::x, 0, d));
}

TEST_CASE("a particle that jumped out of a table mesh within its bounds has moved too far") {
  // An L of unit cells: the quarter without cells lies within the bounds.
  Tables<2> table = grid_tables<2>({12, 12});
  std::erase_if(table.cells, [&](const auto& cell) {
    return table.nodes[cell[0]][0] > 2 && table.nodes[cell[0]][1] > 2;
  });
  for (const double distance : {0.5, 5.0}) {
    OnePatch<2> f(table.mesh(false));
    f.model.analysis.remove_leaving_particles = true;
    std::mt19937 random(1);
    const Index cell = f.model.mesh->locate({2.5, 6.5}).cell;
    f.add(random, static_cast<Local>(cell), {0, 0}, 0);
    receive(f.patch);
    f.at(Column::x, 0, 0) = 3 + distance;
    locate(f.patch, f.context(), f.patch.bins);
    place_movers(f.patch, f.context());
    CHECK(f.patch.fault.kind ==
          (distance < 1 ? ParticleFault::Kind::none : ParticleFault::Kind::moved_too_far));
    CHECK(f.patch.removed.size() == (distance < 1 ? 1 : 0));
  }
}

TEST_CASE("a particle outside of the mesh is a fault, or taken out where the model says so") {
  for (const bool remove : {false, true}) {
    OnePatch<2> f(boxes<2>());
    std::mt19937 random(1);
    for (int k = 0; k < 3; ++k) f.add(random, 7, {0.1 * k, 0}, 0);
    receive(f.patch);
    f.model.analysis.remove_leaving_particles = remove;
    f.at(Column::x, 1, 0) = 77;
    locate(f.patch, f.context(), f.patch.bins);
    place_movers(f.patch, f.context());
    CHECK(f.patch.fault.kind ==
          (remove ? ParticleFault::Kind::none : ParticleFault::Kind::left_mesh));
    CHECK(f.size() == (remove ? 2 : 3));
    CHECK(f.patch.removed.size() == (remove ? 1 : 0));
    if (remove) {
      CHECK(f.ids() == std::vector<Index>{1000, 1002});
    } else {
      CHECK(f.patch.fault.particle == 1001);
      CHECK(f.patch.fault.position[0] == 77);
    }
  }
}

TEST_CASE("a position that is not a number is a fault of its own, even where particles may leave") {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    OnePatch<2> f(boxes<2>());
    std::mt19937 random(1);
    for (int k = 0; k < 3; ++k) f.add(random, 7, {0.1 * k, 0}, 0);
    receive(f.patch);
    f.model.analysis.remove_leaving_particles = true;
    f.at(Column::x, 2, 1) = bad;
    locate(f.patch, f.context(), f.patch.bins);
    place_movers(f.patch, f.context());
    CHECK(f.patch.fault.kind == ParticleFault::Kind::not_finite);
    CHECK(f.patch.fault.particle == 1002);
    CHECK(f.size() == 3);
  }
}
