// Functions that reach beyond a cell: B-splines and GIMP, anywhere on a mesh and at its walls.
#include <doctest/doctest.h>

#include <Eigen/Geometry>

#include "physics/basis/basis.h"
#include "physics/kernels/velocity_transfer.h"
#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// N and dN of the particle in slot p, by node id.
template <int Dim>
struct AtParticle {
  std::vector<double> N;
  std::vector<Vec<Dim>> dN;
};

template <int Dim, class Real>
AtParticle<Dim> functions_at(const OnePatch<Dim>& f, Local p) {
  AtParticle<Dim> at;
  at.N.assign(static_cast<std::size_t>(f.patch.n_nodes()), 0.0);
  at.dN.assign(at.N.size(), Vec<Dim>::Zero());
  const Local cell = f.patch.particles.cell[static_cast<std::size_t>(p)];
  const auto nodes = f.patch.topology.support(static_cast<std::size_t>(cell));
  with_bases(f.patch, [&](const auto& cells) {
    const auto basis = cells[cell];
    constexpr int n = std::decay_t<decltype(basis)>::nodes;
    Real N[n], dN[Dim][n];
    basis.functions(p, N);
    basis.gradients(p, dN);
    for (int i = 0; i < n; ++i) {
      const auto node = static_cast<std::size_t>(nodes[static_cast<std::size_t>(i)]);
      at.N[node] += N[i][0];
      for (int d = 0; d < Dim; ++d) at.dN[node][d] += dN[d][i][0];
    }
  });
  return at;
}

/// Natural coordinates inside the cell, on its faces, at its middle (where quadratic splines have
/// knots), and as near to these as numbers come.
template <int Dim>
Vec<Dim> special_point(std::mt19937& random) {
  static constexpr double special[] = {-1, -1 + 1e-15, -1e-15, 0, 1e-15, 1 - 1e-15, 1};
  Vec<Dim> xi = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
  for (int d = 0; d < Dim; ++d)
    if (random() % 2) xi[d] = special[random() % 7];
  return xi;
}

/// Call check(patch) for patches with particles at such points of every cell, on meshes of few and
/// of many cells.
template <class Check>
void on_every_function(Check check) {
  std::mt19937 random(5);
  const auto with = [&](auto mesh, ShapeFunctions functions, Natural natural) {
    OnePatch<decltype(mesh.node(0))::SizeAtCompileTime> f(std::move(mesh), natural, functions);
    for (Index c = 0; c < f.model.mesh->n_cells(); ++c)
      for (int k = 0; k < 8; ++k)
        f.add(random, static_cast<Local>(c), special_point<decltype(f)::dim>(random), 0);
    CAPTURE(static_cast<int>(functions));
    check(f, random);
  };
  for (const ShapeFunctions functions : wide_functions)
    for (const Natural natural : {Natural::computed, Natural::stored}) {
      with(boxes<2>(), functions, natural);
      with(boxes<3>(), functions, natural);
      with(Mesh<2>::structured({3, -1}, {0.5, 0.25}, {1, 2}), functions, natural);
      with(Mesh<3>::structured({0, 0, 1}, {2, 1, 1}, {3, 1, 2}), functions, natural);
    }
}

}  // namespace

TEST_CASE("wide functions sum to one, gradients to zero, and both reproduce linear fields") {
  on_every_function([](const auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    for (Local p = 0; p < f.patch.particles.size(); ++p) {
      const auto at = functions_at<Dim, Pack>(f, p);
      double sum = 0;
      Vec<Dim> x = Vec<Dim>::Zero(), sum_of_gradients = Vec<Dim>::Zero();
      Eigen::Matrix<double, Dim, Dim> gradient_of_x = Eigen::Matrix<double, Dim, Dim>::Zero();
      for (std::size_t i = 0; i < at.N.size(); ++i) {
        const Vec<Dim> node = f.node(static_cast<Local>(i));
        sum += at.N[i];
        x += at.N[i] * node;
        sum_of_gradients += at.dN[i];
        gradient_of_x += node * at.dN[i].transpose();
      }
      CHECK(std::abs(sum - 1) < 1e-12);
      CHECK((x - f.vector(Column::x, p)).norm() < 1e-12);
      CHECK(sum_of_gradients.norm() < 1e-12);
      CHECK((gradient_of_x - Eigen::Matrix<double, Dim, Dim>::Identity()).norm() < 1e-12);
    }
  });
}

TEST_CASE("gradients of wide functions are the differences of the functions") {
  on_every_function([](auto& f, std::mt19937&) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    // CPDI's are the differences of corners, not of places.
    if (f.patch.basis == BasisKind::cpdi || f.patch.basis == BasisKind::cpdi2) return;
    const double step = 1e-3;  // functions are polynomials of degree three between knots
    for (Local p = 0; p < f.patch.particles.size(); ++p) {
      const auto at = functions_at<Dim, Scalar>(f, p);
      for (int d = 0; d < Dim; ++d) {
        const bool stored = f.patch.particles.layout().has(Column::xi);
        double& place = f.at(stored ? Column::xi : Column::x, p, d);
        const auto cell = f.patch.particles.cell[static_cast<std::size_t>(p)];
        const double middle = place, half = f.model.mesh->geometry(cell).length[d] / 2,
                     unit = stored ? 1.0 : half;
        const auto moved = [&](double xi) {
          place = middle + xi * unit;
          const auto there = functions_at<Dim, Scalar>(f, p);
          place = middle;
          return there;
        };
        // Simpson's rule for the change of N between two places: exact for cubic functions.
        const auto a = moved(-step), b = moved(step), before = at;
        double worst = 0;
        for (std::size_t i = 0; i < at.N.size(); ++i)
          worst = std::max(
              worst, std::abs((b.N[i] - a.N[i]) -
                              step * half / 3 * (a.dN[i][d] + 4 * before.dN[i][d] + b.dN[i][d])));
        const Vec<Dim> xi = f.natural(p);
        // Where a knot lies between the two, second derivatives jump.
        const bool smooth = std::abs(std::abs(xi[d]) - 1) > 2 * step &&
                            std::abs(xi[d]) > 2 * step &&
                            f.model.analysis.functions != ShapeFunctions::gimp &&
                            f.model.analysis.functions != ShapeFunctions::uniform_gimp;
        CHECK(worst < (smooth ? 1e-12 : 2e-5));
      }
    }
  });
}

TEST_CASE("at a wall only the functions of wall nodes are not zero, for splines") {
  const auto check = [](auto mesh, ShapeFunctions functions) {
    OnePatch<decltype(mesh.node(0))::SizeAtCompileTime> f(std::move(mesh), Natural::stored,
                                                          functions);
    constexpr int Dim = decltype(f)::dim;
    std::mt19937 random(8);
    const auto [low, high] = f.model.mesh->bounds();
    for (Index c = 0; c < f.model.mesh->n_cells(); ++c)
      for (int d = 0; d < Dim; ++d)
        for (const double side : {-1.0, 1.0}) {
          Vec<Dim> xi = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
          xi[d] = side;
          f.add(random, static_cast<Local>(c), xi, 0);
          const Local p = f.patch.particles.size() - 1;
          const double wall = side < 0 ? low[d] : high[d];
          if (std::abs(f.at(Column::x, p, d) - wall) > 1e-12) continue;
          const auto at = functions_at<Dim, Scalar>(f, p);
          for (Local i = 0; i < f.patch.n_nodes(); ++i)
            if (std::abs(f.node(i)[d] - wall) > 1e-12)
              CHECK(std::abs(at.N[static_cast<std::size_t>(i)]) < 1e-14);
        }
  };
  for (const ShapeFunctions functions :
       {ShapeFunctions::quadratic_spline, ShapeFunctions::cubic_spline}) {
    check(boxes<2>(), functions);
    check(boxes<3>(), functions);
  }
}

TEST_CASE("GIMP functions are means of linear functions over the particle's box") {
  OnePatch<2> f(Mesh<2>::structured({0, 0}, {1, 0.5}, {5, 5}), Natural::computed,
                ShapeFunctions::uniform_gimp);
  std::mt19937 random(9);
  for (int k = 0; k < 50; ++k) {
    f.add(random, 12, special_point<2>(random), 0);  // the cell in the middle
    const Local p = f.patch.particles.size() - 1;
    const auto at = functions_at<2, Scalar>(f, p);
    const auto mean = [&](int d, double node) {  // of a hat over the box, by the midpoint rule
      const double h = d == 0 ? 1.0 : 0.5, edge = f.at(Column::domain, p, d);
      const int n = 20000;
      double sum = 0;
      for (int i = 0; i < n; ++i) {
        const double x = f.at(Column::x, p, d) + edge * ((i + 0.5) / n - 0.5);
        sum += std::max(0.0, 1 - std::abs(x - node) / h);
      }
      return sum / n;
    };
    for (Local i = 0; i < f.patch.n_nodes(); i += 5 + k % 3)
      CHECK(at.N[static_cast<std::size_t>(i)] ==
            doctest::Approx(mean(0, f.node(i)[0]) * mean(1, f.node(i)[1])).epsilon(1e-6));
  }
}

TEST_CASE("CPDI functions are means of linear functions at corners, gradients their differences") {
  OnePatch<2> f(Mesh<2>::structured({0, 0}, {1, 0.5}, {5, 5}), Natural::computed,
                ShapeFunctions::cpdi);
  std::mt19937 random(19);
  for (int k = 0; k < 50; ++k) {
    // Near the middle of the cell, so that the domain is within the cells around.
    f.add(random, 12, random_point<2>(random, Vec<2>(-0.5, -0.5), Vec<2>(0.5, 0.5)), 0);
    const Local p = f.patch.particles.size() - 1;
    const Vec<2> x = f.vector(Column::x, p);
    const Vec<2> r[2] = {{f.at(Column::vectors, p, 0), f.at(Column::vectors, p, 1)},
                         {f.at(Column::vectors, p, 2), f.at(Column::vectors, p, 3)}};
    const auto at = functions_at<2, Scalar>(f, p);
    for (Local i = 0; i < f.patch.n_nodes(); ++i) {
      double mean = 0, along[2] = {};
      for (const int a : {-1, 1})
        for (const int b : {-1, 1}) {
          const Vec<2> away = x + a * r[0] + b * r[1] - f.node(i);
          const double N =
              std::max(0.0, 1 - std::abs(away[0])) * std::max(0.0, 1 - std::abs(away[1]) / 0.5);
          mean += N / 4;
          along[0] += a * N / 4;
          along[1] += b * N / 4;
        }
      const auto n = static_cast<std::size_t>(i);
      CHECK(std::abs(at.N[n] - mean) < 1e-13);
      for (int d = 0; d < 2; ++d) CHECK(std::abs(at.dN[n].dot(r[d]) - along[d]) < 1e-13);
    }
  }
}

TEST_CASE("kernels of wide functions and of other elements add what the functions say") {
  std::mt19937 random(23);
  const auto with = [&](auto make) {
    auto f = make();
    constexpr int Dim = decltype(f)::dim;
    CAPTURE(info(f.patch.element).name);
    f.fill(random, Slots::with_free);
    set_linear(f, f.patch.velocity, random);
    set_linear(f, f.patch.acceleration, random);
    for (double& v : f.patch.velocity) v += uniform(random, -0.1, 0.1);
    const auto nodes = static_cast<std::size_t>(f.patch.n_nodes());
    std::vector<Vec<Dim>> momentum(nodes, Vec<Dim>::Zero()), force = momentum;
    std::vector<double> mass(nodes, 0.0), pressure = mass;
    std::vector<Vec<Dim>> v_p, x_p;
    constexpr int voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    f.model.analysis.transfer.flip = 0.7;
    for (const Local p : f.slots()) {
      const auto at = functions_at<Dim, Scalar>(f, p);
      Vec<Dim> v = Vec<Dim>::Zero(), a = v;
      for (std::size_t i = 0; i < nodes; ++i) {
        mass[i] += at.N[i] * f.at(Column::mass, p);
        momentum[i] += at.N[i] * f.at(Column::mass, p) * f.vector(Column::v, p);
        if (f.patch.particles.material[static_cast<std::size_t>(p)] == 1)
          pressure[i] += at.N[i] * f.at(Column::mass, p) * f.at(Column::state, p);
        for (int d = 0; d < Dim; ++d) {
          for (int b = 0; b < Dim; ++b)
            force[i][d] -=
                f.at(Column::volume, p) * f.at(Column::stress, p, voigt[d][b]) * at.dN[i][b];
          v[d] += at.N[i] * f.patch.velocity[f.at(static_cast<Local>(i), d)];
          a[d] += at.N[i] * f.patch.acceleration[f.at(static_cast<Local>(i), d)];
        }
      }
      v_p.push_back(0.7 * (f.vector(Column::v, p) + f.dt * a) + 0.3 * v);
      x_p.push_back(f.vector(Column::x, p) + f.dt * v);
    }
    map_mass_momentum(f.patch, f.context(), f.patch.bins);
    map_pressure(f.patch, f.context(), f.patch.bins);
    map_force(f.patch, f.context(), f.patch.bins);
    for (Local i = 0; i < f.patch.n_nodes(); ++i) {
      const auto n = static_cast<std::size_t>(i);
      CHECK(std::abs(f.sum(NodeSum::mass_momentum, i, mass_lane) - mass[n]) < 1e-11);
      CHECK(std::abs(f.sum(NodeSum::pressure, i, 0) - pressure[n]) < 1e-11);
      for (int d = 0; d < Dim; ++d) {
        CHECK(std::abs(f.sum(NodeSum::mass_momentum, i, d) - momentum[n][d]) < 1e-11);
        CHECK(std::abs(f.sum(NodeSum::force, i, d) - force[n][d]) < 1e-10);
      }
    }
    update_particles(f.patch, f.context(), f.patch.bins);
    for (std::size_t k = 0; const Local p : f.slots()) {
      CHECK((f.vector(Column::v, p) - v_p[k]).norm() < 1e-12);
      // The place of CPDI2's is that of the moved domain's middle (cpdi2.cpp).
      if (f.patch.basis != BasisKind::cpdi2)
        CHECK((f.vector(Column::x, p) - x_p[k]).norm() < 1e-12);
      ++k;
    }
  };
  with_wide_functions(with);
  with_elements(with);
}

TEST_CASE("affine particles give a linear velocity field to nodes and take it back") {
  std::mt19937 random(41);
  for (const Affine affine : {Affine::apic, Affine::tpic}) {
    const auto check = [&](auto make) {
      auto f = make();
      constexpr int Dim = decltype(f)::dim;
      f.fill(random, Slots::with_free);
      f.model.analysis.transfer.flip = 0.0;
      const auto [A, b] = set_linear(f, f.patch.velocity, random);
      CAPTURE(static_cast<int>(f.model.analysis.functions));
      std::vector<Vec<Dim>> x;
      for (const Local p : f.slots()) x.push_back(f.vector(Column::x, p));
      f.dt = 0.0;
      velocities_before_forces(f.patch, f.context());
      update_particles(f.patch, f.context(), f.patch.bins);
      for (std::size_t k = 0; const Local p : f.slots()) {
        CHECK((f.vector(Column::v, p) - (A * x[k++] + b)).norm() < 1e-11);
        for (int d = 0; d < Dim * Dim; ++d)
          CHECK(std::abs(f.at(Column::affine, p, d) - A(d / Dim, d % Dim)) < 1e-8);
      }
      // Nodes of little mass amplify rounding by its inverse.
      map_mass_momentum(f.patch, f.context(), f.patch.bins);
      for (Local i = 0; i < f.patch.n_nodes(); ++i) {
        const double m = f.sum(NodeSum::mass_momentum, i, mass_lane);
        const Vec<Dim> v = A * f.node(i) + b;
        for (int d = 0; d < Dim; ++d)
          CHECK(std::abs(f.sum(NodeSum::mass_momentum, i, d) - m * v[d]) < 1e-7);
      }
    };
    with_wide_functions(check, affine);
    with_affine_corners(check, affine);
  }
}

TEST_CASE("splines with APIC keep angular momentum when it goes to nodes and back") {
  for (const ShapeFunctions functions :
       {ShapeFunctions::quadratic_spline, ShapeFunctions::cubic_spline}) {
    OnePatch<3> f(Mesh<3>::structured({-4, -4, -4}, {1, 1, 1}, {8, 8, 8}), Natural::computed,
                  functions, Affine::apic);
    std::mt19937 random(12);
    for (Local c = 0; c < 512; ++c) {  // away from the walls
      const Vec<3> at = f.model.mesh->geometry(c).centre;
      if (at.cwiseAbs().maxCoeff() < 2)
        for (int k = 0; k < 3; ++k)
          f.add(random, c, random_point<3>(random, -Vec<3>::Ones(), Vec<3>::Ones()), 0);
    }
    receive(f.patch);
    // With D = spread h^2, a particle's own part is m spread h^2 times the vector of C's
    // antisymmetric part.
    const double spread = functions == ShapeFunctions::quadratic_spline ? 0.25 : 1.0 / 3.0;
    const auto of_particles = [&] {
      Vec<3> L = Vec<3>::Zero();
      for (const Local p : f.slots()) {
        const auto C = [&](int a, int d) { return f.at(Column::affine, p, 3 * a + d); };
        const double m = f.at(Column::mass, p);
        L += m * f.vector(Column::x, p).cross(f.vector(Column::v, p));
        L += m * spread * Vec<3>(C(2, 1) - C(1, 2), C(0, 2) - C(2, 0), C(1, 0) - C(0, 1));
      }
      return L;
    };
    const Vec<3> before = of_particles();
    map_mass_momentum(f.patch, f.context(), f.patch.bins);
    Vec<3> of_nodes = Vec<3>::Zero();
    for (Local i = 0; i < f.patch.n_nodes(); ++i) {
      Vec<3> momentum;
      for (int d = 0; d < 3; ++d) momentum[d] = f.sum(NodeSum::mass_momentum, i, d);
      of_nodes += f.node(i).cross(momentum);
    }
    CHECK((of_nodes - before).norm() < 1e-10);
    nodal_velocity(f.patch, f.context());
    f.model.analysis.transfer.flip = 0.0;
    f.dt = 1e-300;  // nothing moves
    update_particles(f.patch, f.context(), f.patch.bins);
    CHECK(before.norm() > 1);
    CHECK((of_particles() - before).norm() < 1e-9);
  }
}

namespace {

/// Angular momentum about the origin, Dim (Dim - 1) / 2 components: of x v^T, what is not
/// symmetric.
template <int Dim>
using Moments = Eigen::Matrix<double, Dim, Dim>;

/// sum_p m (x v^T + D C^T), with D = sum_i N_i (x_i - x_p) (x_i - x_p)^T, less its transpose.
template <int Dim>
Moments<Dim> angular_momentum(const OnePatch<Dim>& f) {
  Moments<Dim> sum = Moments<Dim>::Zero();
  for (const Local p : f.slots()) {
    const auto at = functions_at<Dim, Scalar>(f, p);
    Moments<Dim> D = Moments<Dim>::Zero(), C;
    for (std::size_t i = 0; i < at.N.size(); ++i) {
      const Vec<Dim> away = f.node(static_cast<Local>(i)) - f.vector(Column::x, p);
      D += at.N[i] * away * away.transpose();
    }
    for (int k = 0; k < Dim * Dim; ++k) C(k / Dim, k % Dim) = f.at(Column::affine, p, k);
    sum += f.at(Column::mass, p) *
           (f.vector(Column::x, p) * f.vector(Column::v, p).transpose() + D * C.transpose());
  }
  return sum - sum.transpose();
}

/// To nodes and back; the nodes' velocities are no linear field. `cells`: particles are in those
/// whose place is within.
template <int Dim>
void check_angular_momentum(OnePatch<Dim> f, std::mt19937& random, double within) {
  CAPTURE(info(f.patch.element).name);
  CAPTURE(static_cast<int>(f.patch.basis));
  const auto [low, high] = f.model.mesh->bounds();
  for (Local c = 0; c < f.model.mesh->n_cells(); ++c) {
    const Vec<Dim> x = f.physical(c, f.inside(random));
    if ((x - 0.5 * (low + high)).cwiseQuotient(high - low).cwiseAbs().maxCoeff() > within) continue;
    for (int k = 0; k < 3; ++k) f.add(random, c, f.inside(random), 0);
  }
  receive(f.patch);
  const Moments<Dim> before = angular_momentum(f);
  map_mass_momentum(f.patch, f.context(), f.patch.bins);
  Moments<Dim> nodes = Moments<Dim>::Zero();
  for (Local i = 0; i < f.patch.n_nodes(); ++i) {
    Vec<Dim> momentum;
    for (int d = 0; d < Dim; ++d) momentum[d] = f.sum(NodeSum::mass_momentum, i, d);
    nodes += f.node(i) * momentum.transpose();
  }
  CHECK(before.norm() > 0.1);
  CHECK((nodes - nodes.transpose() - before).norm() < 1e-10);
  nodal_velocity(f.patch, f.context());
  f.model.analysis.transfer.flip = 0.0;
  f.dt = 1e-300;  // nothing moves
  velocities_before_forces(f.patch, f.context());
  update_particles(f.patch, f.context(), f.patch.bins);
  CHECK((angular_momentum(f) - before).norm() < 1e-9);
}

}  // namespace

TEST_CASE("APIC keeps angular momentum in a transfer on boxes and simplices, and with CPDI") {
  // In boxes, in sheared ones and in simplices linear functions are their moments over D:
  // grad N_i = D^-1 (x_i - x_p) N_i. On other cells only linear fields are carried on as they are.
  std::mt19937 random(43);
  using enum ShapeFunctions;
  for (const Natural natural : {Natural::computed, Natural::stored}) {
    check_angular_momentum(OnePatch<2>(boxes<2>(), natural, element, Affine::apic), random, 1);
    check_angular_momentum(OnePatch<3>(boxes<3>(), natural, element, Affine::apic), random, 1);
  }
  check_angular_momentum(OnePatch<2>(bent<2>(Element::T3), Natural::stored, element, Affine::apic),
                         random, 1);
  check_angular_momentum(
      OnePatch<3>(bent<3>(Element::Tet4), Natural::stored, element, Affine::apic), random, 1);
  for (const ShapeFunctions functions : {cpdi, cpdi2}) {  // away from the walls
    check_angular_momentum(OnePatch<2>(Mesh<2>::structured({-4, -2}, {1, 0.5}, {8, 8}),
                                       Natural::computed, functions, Affine::apic),
                           random, 0.3);
    check_angular_momentum(OnePatch<3>(Mesh<3>::structured({-3, -3, -1.5}, {1, 1, 0.5}, {6, 6, 6}),
                                       Natural::computed, functions, Affine::apic),
                           random, 0.2);
  }
}

TEST_CASE(
    "a linear velocity field strains particles with wide functions and in other elements "
    "uniformly") {
  std::mt19937 random(31);
  const auto with = [&](auto make) {
    auto f = make();
    constexpr int Dim = decltype(f)::dim;
    CAPTURE(info(f.patch.element).name);
    f.patch.lagrange_functions = true;  // Bernstein's take values at control points, not at nodes
    f.fill(random);
    const auto [A, b] = set_linear(f, f.patch.velocity, random);
    const auto slots = f.slots();
    std::vector<double> volume, strain;
    std::vector<Vec<Dim>> domain;
    const bool stretches = f.patch.particles.layout().has(Column::next_domain);
    for (const Local p : slots) {
      volume.push_back(f.at(Column::volume, p));
      strain.push_back(f.at(Column::strain, p, Dim == 2 ? 2 : 3));
      if (stretches) domain.push_back(f.vector(Column::domain, p));
    }
    update_stress(f.patch, f.context(), f.patch.bins, StressPart::both);
    for (std::size_t k = 0; k < slots.size(); ++k) {
      CHECK(f.at(Column::volume, slots[k]) ==
            doctest::Approx(volume[k] * (1 + f.dt * A.trace())).epsilon(1e-12));
      CHECK(f.at(Column::strain, slots[k], Dim == 2 ? 2 : 3) - strain[k] ==
            doctest::Approx(f.dt * (A(0, 1) + A(1, 0))).epsilon(1e-10));
      for (int d = 0; d < Dim && stretches; ++d) {
        CHECK(f.at(Column::domain, slots[k], d) == domain[k][d]);
        CHECK(f.at(Column::next_domain, slots[k], d) ==
              doctest::Approx(domain[k][d] * (1 + f.dt * A(d, d))).epsilon(1e-11));
      }
    }
  };
  with_wide_functions(with);
  with_elements(with);
}
