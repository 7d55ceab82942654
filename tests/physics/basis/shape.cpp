// Shape functions and their gradients.
#include <doctest/doctest.h>

#include "physics/basis/cell_map.h"
#include "tests/physics/kernels/kernels_fixture.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
Weights<Dim, Scalar> weights(const Vec<Dim>& xi) {
  Scalar at[Dim];
  for (int d = 0; d < Dim; ++d) at[d] = xi[d];
  return Weights<Dim, Scalar>(at);
}

template <int Dim>
void check_functions() {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec<Dim> xi = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones());
    const auto w = weights<Dim>(xi);
    double sum = 0;
    for (int i = 0; i < corners<Dim>; ++i) {
      sum += w.N(i)[0];
      CHECK(w.N(i)[0] >= 0);
    }
    CHECK(sum == doctest::Approx(1).epsilon(1e-15));
    // dN/dxi by difference; exact up to rounding, N being linear along each axis.
    for (int d = 0; d < Dim; ++d)
      for (int c = 0; c < face_corners<Dim>; ++c)
        for (const int side : {0, 1}) {
          const int i = face_to_corner(d, c) | (side << d);
          Vec<Dim> low = xi, high = xi;
          low[d] = -1;
          high[d] = 1;
          const double slope = (weights<Dim>(high).N(i)[0] - weights<Dim>(low).N(i)[0]) / 2;
          const double face = w.face(d, c)[0] / 2;
          CHECK(slope == doctest::Approx(side ? face : -face).epsilon(1e-14));
        }
  }
  for (int i = 0; i < corners<Dim>; ++i) {
    Vec<Dim> corner;
    for (int d = 0; d < Dim; ++d) corner[d] = (i >> d) & 1 ? 1 : -1;
    for (int j = 0; j < corners<Dim>; ++j)
      CHECK(weights<Dim>(corner).N(j)[0] == (i == j ? 1.0 : 0.0));
  }
}

/// The gradient of a linear field by the maps that kernels use, at every particle.
template <int Dim, class Cells>
void check_gradient(const OnePatch<Dim>& f, std::mt19937& random) {
  Eigen::Matrix<double, Dim, Dim> A;
  for (int i = 0; i < Dim * Dim; ++i) A.data()[i] = uniform(random, -1, 1);
  NodeArray field(static_cast<std::size_t>(f.patch.n_nodes()) * node_width, 0.0);
  for (Local n = 0; n < f.patch.n_nodes(); ++n) {
    const Vec<Dim> value = A * f.node(n) + Vec<Dim>::Constant(7);
    for (int d = 0; d < Dim; ++d) field[f.at(n, d)] = value[d];
  }
  double worst = 0, worst_centre = 0, worst_natural = 0;
  const Cells cells(f.patch);
  for (const Local p : f.slots()) {
    const Local cell = f.patch.particles.cell[static_cast<std::size_t>(p)];
    const CornerDifferences<Dim> difference(
        field.data(), f.patch.topology.corner_nodes[static_cast<std::size_t>(cell)]);
    const auto map = cells[cell];
    double Gc[Dim][Dim], Lc[Dim][Dim];
    difference.centre_gradient(Gc);
    map.to_physical_centre(Gc, Lc);
    Scalar xi[Dim], G[Dim][Dim], L[Dim][Dim];
    map.natural(p, xi);
    Vec<Dim> at;
    for (int d = 0; d < Dim; ++d) at[d] = xi[d][0];
    worst_natural = std::max(worst_natural, (f.physical(cell, at) - f.vector(Column::x, p)).norm());
    difference.gradient(weights_at<Dim, Scalar>(map, p), G);
    map.to_physical(p, G, L);
    for (int a = 0; a < Dim; ++a)
      for (int d = 0; d < Dim; ++d) {
        worst = std::max(worst, std::abs(L[a][d][0] - A(a, d)));
        worst_centre = std::max(worst_centre, std::abs(Lc[a][d] - A(a, d)));
      }
  }
  CHECK(worst_natural < 1e-14);
  CHECK(worst < 1e-13);
  CHECK(worst_centre < 1e-13);
}

}  // namespace

TEST_CASE("shape functions are a partition of unity, one at their corner and zero at the others") {
  check_functions<2>();
  check_functions<3>();
}

TEST_CASE("the gradient of a linear field is exact anywhere in boxes and distorted cells") {
  on_every_mesh([](const auto& f, std::mt19937& random) {
    constexpr int Dim = std::decay_t<decltype(f)>::dim;
    if (f.patch.particles.layout().has(Column::xi))
      check_gradient<Dim, IsoparametricCells<Dim>>(f, random);
    if (f.patch.cartesian) check_gradient<Dim, CartesianCells<Dim>>(f, random);
  });
}
