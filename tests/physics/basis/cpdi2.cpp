// CPDI2: particles whose domains are general quadrilaterals and hexahedra.
#include <doctest/doctest.h>

#include <Eigen/LU>

#include "physics/basis/basis.h"
#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
using Corners = std::array<Vec<Dim>, static_cast<std::size_t>(corners<Dim>)>;

/// Corners of the cube [-1, 1]^Dim, each moved by up to 0.45; det J stays above 0 (checked below).
template <int Dim>
Corners<Dim> random_corners(std::mt19937& random) {
  Corners<Dim> at;
  const double amount = Dim == 2 ? 0.45 : 0.25;
  for (std::size_t c = 0; c < at.size(); ++c)
    for (int d = 0; d < Dim; ++d)
      at[c][d] = corner_sign(static_cast<int>(c), d) + uniform(random, -amount, amount);
  return at;
}

/// Volume, and means over a domain of a function that is interpolated from its corners: by Gauss's
/// rule of five points per axis, in terms of nothing but the map.
template <int Dim>
struct Means {
  double volume = 0;
  std::array<double, static_cast<std::size_t>(corners<Dim>)> w{};
  Corners<Dim> slope;

  explicit Means(const Corners<Dim>& x) {
    constexpr double place[5] = {0, -0.5384693101056831, 0.5384693101056831, -0.9061798459386640,
                                 0.9061798459386640};
    constexpr double share[5] = {0.5688888888888889, 0.4786286704993665, 0.4786286704993665,
                                 0.2369268850561891, 0.2369268850561891};
    slope.fill(Vec<Dim>::Zero());
    for (int g = 0; g < (Dim == 2 ? 25 : 125); ++g) {
      double xi[Dim], weight = 1;
      for (int d = 0, rest = g; d < Dim; ++d, rest /= 5) {
        xi[d] = place[rest % 5];
        weight *= share[rest % 5];
      }
      Eigen::Matrix<double, Dim, Dim> J = Eigen::Matrix<double, Dim, Dim>::Zero();
      std::array<double, static_cast<std::size_t>(corners<Dim>)> S;
      Corners<Dim> dS;
      for (std::size_t c = 0; c < x.size(); ++c) {
        const auto side = [&](int k) { return corner_sign(static_cast<int>(c), k); };
        S[c] = 1;
        for (int k = 0; k < Dim; ++k) S[c] *= (1 + side(k) * xi[k]) / 2;
        for (int k = 0; k < Dim; ++k) {
          dS[c][k] = side(k) / 2;
          for (int l = 0; l < Dim; ++l)
            if (l != k) dS[c][k] *= (1 + side(l) * xi[l]) / 2;
        }
        J += x[c] * dS[c].transpose();
      }
      const double dV = weight * J.determinant();
      REQUIRE(J.determinant() > 0);
      volume += dV;
      for (std::size_t c = 0; c < x.size(); ++c) {
        w[c] += S[c] * dV;
        slope[c] += dV * J.inverse().transpose() * dS[c];
      }
    }
    for (std::size_t c = 0; c < x.size(); ++c) {
      w[c] /= volume;
      slope[c] /= volume;
    }
  }
};

template <int Dim>
void check_domains() {
  std::mt19937 random(3);
  for (int k = 0; k < 200; ++k) {
    const Corners<Dim> x = random_corners<Dim>(random);
    const Means<Dim> exact(x);
    Hexahedron<Dim, Pack> domain;
    for (int c = 0; c < corners<Dim>; ++c)
      for (int d = 0; d < Dim; ++d) domain.r[c][d] = Pack(x[static_cast<std::size_t>(c)][d]);
    Pack w[corners<Dim>], slope[corners<Dim>][Dim];
    const Pack volume = domain.weights(w);
    domain.slopes(slope);
    const int lane = k % lanes<Pack>;
    CHECK(std::abs(volume[lane] - exact.volume) < 1e-13 * exact.volume);
    for (int c = 0; c < corners<Dim>; ++c) {
      const auto i = static_cast<std::size_t>(c);
      CHECK(std::abs(w[c][lane] - exact.w[i]) < 1e-13);
      for (int d = 0; d < Dim; ++d) CHECK(std::abs(slope[c][d][lane] - exact.slope[i][d]) < 1e-12);
    }
  }
}

/// Corners of a particle's domain in space.
template <int Dim>
Corners<Dim> corners_of(const OnePatch<Dim>& f, Local p) {
  Corners<Dim> x;
  for (int c = 0; c < corners<Dim>; ++c)
    for (int d = 0; d < Dim; ++d)
      x[static_cast<std::size_t>(c)][d] =
          f.at(Column::x, p, d) + f.at(Column::corners, p, Dim * c + d);
  return x;
}

template <int Dim>
double hat(const Vec<Dim>& x, const Vec<Dim>& node, const Vec<Dim>& h) {
  double N = 1;
  for (int d = 0; d < Dim; ++d) N *= std::max(0.0, 1 - std::abs(x[d] - node[d]) / h[d]);
  return N;
}

/// A grid whose middle cell is not at the border, with particles whose domains reach beyond it.
template <int Dim>
OnePatch<Dim> with_particles(std::mt19937& random, int n) {
  std::array<Index, Dim> counts;
  counts.fill(5);
  Vec<Dim> h = Vec<Dim>::Ones();
  h[1] = 0.5;
  OnePatch<Dim> f(Mesh<Dim>::structured(Vec<Dim>::Zero(), h, counts), Natural::computed,
                  ShapeFunctions::cpdi2);
  for (int k = 0; k < n; ++k)
    f.add(random, Dim == 2 ? 12 : 62,
          random_point<Dim>(random, Vec<Dim>::Constant(-0.8), Vec<Dim>::Constant(0.8)), 0);
  return f;
}

template <int Dim>
void check_functions() {
  std::mt19937 random(11);
  const OnePatch<Dim> f = with_particles<Dim>(random, 40);
  for (Local p = 0; p < f.patch.particles.size(); ++p) {
    const Corners<Dim> x = corners_of(f, p);
    const Means<Dim> exact(x);
    Vec<Dim> centroid = Vec<Dim>::Zero();
    for (std::size_t c = 0; c < x.size(); ++c) centroid += exact.w[c] * x[c];
    CHECK((centroid - f.vector(Column::x, p)).norm() < 1e-14);
    with_bases(f.patch, [&](const auto& cells) {
      const auto basis = cells[Dim == 2 ? 12 : 62];
      constexpr int n = std::decay_t<decltype(basis)>::nodes;
      Scalar N[n], dN[Dim][n];
      basis.functions(p, N);
      basis.gradients(p, dN);
      const auto nodes = f.patch.topology.support(Dim == 2 ? 12 : 62);
      for (int i = 0; i < n; ++i) {
        double mean = 0;
        Vec<Dim> gradient = Vec<Dim>::Zero();
        const Vec<Dim> node = f.node(nodes[static_cast<std::size_t>(i)]);
        for (std::size_t c = 0; c < x.size(); ++c) {
          const double at_corner = hat<Dim>(x[c], node, f.model.mesh->geometry(0).length);
          mean += exact.w[c] * at_corner;
          gradient += exact.slope[c] * at_corner;
        }
        CHECK(std::abs(N[i][0] - mean) < 1e-13);
        for (int d = 0; d < Dim; ++d) CHECK(std::abs(dN[d][i][0] - gradient[d]) < 1e-12);
      }
    });
  }
}

/// Corners go where the nodes carry them, and the particle to the middle of its domain.
template <int Dim>
void check_motion() {
  std::mt19937 random(12);
  OnePatch<Dim> f = with_particles<Dim>(random, 40);
  receive(f.patch);
  for (double& v : f.patch.velocity) v = uniform(random, -1, 1);
  f.dt = 0.02;
  std::vector<Corners<Dim>> expected;
  std::vector<Vec<Dim>> x, u;
  for (const Local p : f.slots()) {
    expected.push_back(corners_of(f, p));
    x.push_back(f.vector(Column::x, p));
    u.push_back(f.vector(Column::u, p));
    for (Vec<Dim>& corner : expected.back()) {
      Vec<Dim> v = Vec<Dim>::Zero();
      for (Local i = 0; i < f.patch.n_nodes(); ++i)
        for (int d = 0; d < Dim; ++d)
          v[d] += hat<Dim>(corner, f.node(i), f.model.mesh->geometry(0).length) *
                  f.patch.velocity[f.at(i, d)];
      corner += f.dt * v;
    }
  }
  update_particles(f.patch, f.context(), f.patch.bins);
  CHECK(f.patch.fault.kind == ParticleFault::Kind::none);
  for (std::size_t k = 0; const Local p : f.slots()) {
    const Corners<Dim> now = corners_of(f, p);
    Vec<Dim> centroid = Vec<Dim>::Zero();
    for (std::size_t c = 0; c < now.size(); ++c) {
      CHECK((now[c] - expected[k][c]).norm() < 1e-14);
      centroid += Means<Dim>(expected[k]).w[c] * expected[k][c];
    }
    CHECK((f.vector(Column::x, p) - centroid).norm() < 1e-14);
    CHECK((f.vector(Column::x, p) - x[k] - f.vector(Column::u, p) + u[k]).norm() < 1e-14);
    ++k;
  }
}

}  // namespace

TEST_CASE("volume, weights and slopes of quadrilaterals and hexahedra are integrals over them") {
  check_domains<2>();
  check_domains<3>();
}

TEST_CASE("CPDI2 functions are means over the domain of what corners have, and so are gradients") {
  check_functions<2>();
  check_functions<3>();
}

TEST_CASE("CPDI2 corners move with the nodes, and particles to the middle of their domain") {
  check_motion<2>();
  check_motion<3>();
}

TEST_CASE("corners beyond the cells around move as the domain's inner part does") {
  OnePatch<2> f(Mesh<2>::structured({0, 0}, {1, 1}, {7, 7}), Natural::computed,
                ShapeFunctions::cpdi2);
  std::mt19937 random(2);
  f.add(random, 24, {0.1, -0.3}, 0);
  for (int c = 0; c < 4; ++c)
    for (int d = 0; d < 2; ++d)
      f.at(Column::corners, 0, 2 * c + d) = corner_sign(c, d) * (d == 0 ? 2.5 : 0.5);
  receive(f.patch);
  const auto [A, b] = set_linear(f, f.patch.velocity, random);
  auto expected = corners_of(f, 0);
  for (Vec<2>& x : expected) x += f.dt * (A * x + b);
  update_particles(f.patch, f.context(), f.patch.bins);
  for (std::size_t c = 0; c < 4; ++c) CHECK((corners_of(f, 0)[c] - expected[c]).norm() < 1e-13);
}

TEST_CASE("a domain that folds is a fault, with its particle") {
  std::mt19937 random(13);
  OnePatch<2> f = with_particles<2>(random, 3);
  receive(f.patch);
  const Local p = f.slots()[1];
  // One corner beyond the diagonal of the other three, so that its weight is negative.
  for (int d = 0; d < 2; ++d) f.at(Column::corners, p, 6 + d) = 0.9 * f.at(Column::corners, p, d);
  update_particles(f.patch, f.context(), f.patch.bins);
  CHECK(f.patch.fault.kind == ParticleFault::Kind::folded);
  CHECK(f.patch.fault.particle == f.patch.particles.id[static_cast<std::size_t>(p)]);
  CHECK(f.patch.fault.count == 1);
}
