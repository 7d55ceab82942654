#include <doctest/doctest.h>

#include <Eigen/LU>

#include "tests/physics/mesh/element_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double rounding = 1e-12;

/// Shape functions and gradients at a point, as vectors.
template <int Dim>
struct Functions {
  std::vector<double> N;
  std::vector<Vec<Dim>> dN;

  Functions(Element element, const Vec<Dim>& xi) {
    with_element<Dim>(element, [&](auto e) {
      using S = Shape<decltype(e)::value>;
      double at[Dim], values[S::nodes], gradients[S::nodes][Dim];
      std::copy_n(xi.data(), Dim, at);
      S::values(at, values);
      S::gradients(at, gradients);
      for (int a = 0; a < S::nodes; ++a) {
        N.push_back(values[a]);
        dN.push_back(Eigen::Map<Vec<Dim>>(gradients[a]));
      }
    });
  }
};

template <int Dim>
void check_shape_functions() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    for (int k = 0; k < 500; ++k) {
      const Vec<Dim> xi = random_xi<Dim>(element, random);
      const Functions<Dim> f(element, xi);
      double sum = 0;
      Vec<Dim> x = Vec<Dim>::Zero(), slope = x;
      Eigen::Matrix<double, Dim, Dim> J = Eigen::Matrix<double, Dim, Dim>::Zero();
      for (int a = 0; a < info(element).nodes; ++a) {
        const auto i = static_cast<std::size_t>(a);
        sum += f.N[i];
        slope += f.dN[i];
        x += f.N[i] * node_xi<Dim>(element, a);
        J += node_xi<Dim>(element, a) * f.dN[i].transpose();
      }
      CHECK(std::abs(sum - 1) < rounding);
      CHECK(slope.norm() < rounding);
      CHECK((x - xi).norm() < rounding);
      CHECK((J - Eigen::Matrix<double, Dim, Dim>::Identity()).norm() < rounding);
    }
  });
}

/// Along an axis every function is a polynomial of second order at most, of which a central
/// difference is the derivative, whatever its width.
template <int Dim>
void check_gradients() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    for (int k = 0; k < 500; ++k) {
      const Vec<Dim> xi = random_xi<Dim>(element, random);
      const Functions<Dim> f(element, xi);
      for (int d = 0; d < Dim; ++d) {
        const Vec<Dim> h = 0.5 * Vec<Dim>::Unit(d);
        const Functions<Dim> after(element, xi + h), before(element, xi - h);
        for (std::size_t a = 0; a < f.N.size(); ++a)
          CHECK(std::abs(after.N[a] - before.N[a] - f.dN[a][d]) < rounding);
      }
    }
  });
}

template <int Dim>
void check_nodes() {
  for_elements<Dim>([](Element element, std::mt19937&) {
    for (int a = 0; a < info(element).nodes; ++a) {
      const Vec<Dim> xi = node_xi<Dim>(element, a);
      CHECK(in_closed_cell<Dim>(element, xi));
      const Functions<Dim> f(element, xi);
      for (int b = 0; b < info(element).nodes; ++b)
        CHECK(f.N[static_cast<std::size_t>(b)] == (a == b ? 1.0 : 0.0));
    }
  });
}

/// Nodes that lie in the middle of others, by file order.
void check_middles(Element element, int first, const std::vector<std::vector<int>>& of) {
  CAPTURE(info(element).name);
  const auto middles = [&]<int Dim>(std::integral_constant<int, Dim>) {
    for (std::size_t k = 0; k < of.size(); ++k) {
      Vec<Dim> mean = Vec<Dim>::Zero();
      for (const int a : of[k])
        mean += node_xi<Dim>(element, a) / static_cast<double>(of[k].size());
      CHECK((node_xi<Dim>(element, first + static_cast<int>(k)) - mean).norm() == 0.0);
    }
  };
  if (info(element).dim == 2)
    middles(std::integral_constant<int, 2>());
  else
    middles(std::integral_constant<int, 3>());
}

/// The corners of a face, and whether a point is beyond it.
template <int Dim>
void check_faces() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    const ElementInfo& about = info(element);
    for (int face = 0; face < about.faces; ++face) {
      Vec<Dim> middle = Vec<Dim>::Zero();
      int n = 0;
      for (const int corner : about.face[static_cast<std::size_t>(face)])
        if (corner >= 0) middle += node_xi<Dim>(element, corner), ++n;
      CHECK(n == (Dim == 2 ? 2 : about.simplex ? 3 : 4));
      middle /= n;
      const Vec<Dim> inwards = centre_xi<Dim>(element) - middle;
      CHECK(outside_by<Dim>(element, middle) == doctest::Approx(0).epsilon(1e-15));
      CHECK(outside_by<Dim>(element, middle + 0.1 * inwards) < 0);
      CHECK(outside_by<Dim>(element, middle - 0.1 * inwards) > 0);
      CHECK(nearest_face<Dim>(element, middle + 0.01 * inwards) == face);
      CHECK(nearest_face<Dim>(element, middle - 0.1 * inwards) == face);
    }
    for (int k = 0; k < 1000; ++k) {
      const Vec<Dim> xi =
          random_xi<Dim>(element, random) +
          random_point<Dim>(random, -Vec<Dim>::Constant(1e-9), Vec<Dim>::Constant(1e-9));
      const Vec<Dim> inside = clamp_to_cell<Dim>(element, xi);
      CHECK(in_closed_cell<Dim>(element, inside));
      CHECK((inside - xi).norm() < 1e-8);
      const Functions<Dim> f(
          about.simplex ? (Dim == 2 ? Element::T3 : Element::Tet4) : multilinear<Dim>, inside);
      CHECK(*std::min_element(f.N.begin(), f.N.end()) > 0);
    }
    Vec<Dim> bad = centre_xi<Dim>(element);
    bad[Dim - 1] = std::nan("");
    CHECK_FALSE(in_closed_cell<Dim>(element, bad));
  });
}

template <int Dim>
double volume_of(const ElementGeometry<Dim>& cell, const std::vector<WeightedPoint<Dim>>& points) {
  double volume = 0;
  for (const auto& p : points) volume += p.weight * cell.jacobian(p.xi).determinant();
  return volume;
}

template <int Dim>
void check_parts() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    const auto cell = distorted_cell<Dim>(element, random);
    double whole = 0;
    for (const int n : {1, 2, 3, 4}) {
      const auto parts = cut_cell<Dim>(element, n);
      CHECK(static_cast<double>(parts.size()) == std::pow(n, Dim));
      double sum = 0, natural = 0;
      for (const auto& part : parts) {
        CHECK(in_closed_cell<Dim>(element, part.centre));
        sum += volume_of(cell, part.quadrature);
        natural += volume_of(natural_cell<Dim>(element), part.quadrature);
      }
      if (n == 1) whole = sum;
      CHECK(sum == doctest::Approx(whole).epsilon(1e-12));
      CHECK(sum == doctest::Approx(cell.volume()).epsilon(1e-12));
      CHECK(natural == doctest::Approx(!info(element).simplex ? 1 << Dim
                                       : Dim == 2             ? 0.5
                                                              : 1.0 / 6)
                           .epsilon(1e-12));
    }
  });
}

template <int Dim>
void check_bounds() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    for (int k = 0; k < 20; ++k) {
      const auto cell = distorted_cell<Dim>(element, random);
      const auto [low, high] = cell.bounds();
      for (int p = 0; p < 200; ++p) {
        const Vec<Dim> x = cell.point(random_xi<Dim>(element, random));
        CHECK((x - low).minCoeff() > -1e-12);
        CHECK((high - x).minCoeff() > -1e-12);
      }
    }
  });
}

template <int Dim>
void check_inverse() {
  for_elements<Dim>([](Element element, std::mt19937& random) {
    for (int k = 0; k < 40; ++k) {
      const auto cell = distorted_cell<Dim>(element, random);
      for (int p = 0; p < 50; ++p) {
        const Vec<Dim> xi = random_xi<Dim>(element, random);
        Vec<Dim> back;
        REQUIRE(inverse_map<Dim>(cell, cell.point(xi), back) == Mapped::yes);
        // Coordinates of 100 are known to 1e-14, and a Jacobian of 1/200 makes 200 of it.
        CHECK((back - xi).norm() < 1e-10);
      }
      // Points around the cell that are not in it: whatever is said of them, not that they are.
      const auto [low, high] = cell.bounds();
      for (int p = 0; p < 50; ++p) {
        const Vec<Dim> x = random_point<Dim>(random, low, high);
        Vec<Dim> at;
        const Mapped mapped = inverse_map<Dim>(cell, x, at);
        CHECK(mapped != Mapped::undecided);
        if (mapped == Mapped::yes) CHECK((cell.point(at) - x).norm() < 1e-11);
        CHECK(at.allFinite());
      }
    }
  });
}

}  // namespace

TEST_CASE("shape functions of every element sum to one and reproduce linear functions") {
  check_shape_functions<2>();
  check_shape_functions<3>();
}

TEST_CASE("gradients of every element are the derivatives of its shape functions") {
  check_gradients<2>();
  check_gradients<3>();
}

TEST_CASE("a shape function is one at its node and zero at the others") {
  check_nodes<2>();
  check_nodes<3>();
}

TEST_CASE("nodes beyond the corners lie where the file format says") {
  using enum Element;
  check_middles(T6, 3, {{0, 1}, {1, 2}, {2, 0}});
  check_middles(Q8, 4, {{0, 1}, {1, 2}, {2, 3}, {3, 0}});
  check_middles(Q9, 4, {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 1, 2, 3}});
  const std::vector<std::vector<int>> edges{{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3},
                                            {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}};
  check_middles(H20, 8, edges);
  check_middles(H27, 8, edges);
  check_middles(H27, 20,
                {{0, 1, 2, 3},
                 {0, 1, 4, 5},
                 {0, 3, 4, 7},
                 {1, 2, 5, 6},
                 {2, 3, 6, 7},
                 {4, 5, 6, 7},
                 {0, 1, 2, 3, 4, 5, 6, 7}});
}

TEST_CASE("faces hold their corners and say on which side of them a point lies") {
  check_faces<2>();
  check_faces<3>();
}

TEST_CASE("the parts of a cell have its volume, whatever its shape") {
  check_parts<2>();
  check_parts<3>();
}

TEST_CASE("the box around a cell holds it, however its faces bulge") {
  check_bounds<2>();
  check_bounds<3>();
}

TEST_CASE("the inverse map returns where a point came from in strongly distorted cells") {
  check_inverse<2>();
  check_inverse<3>();
}

TEST_CASE(
    "a quadratic cell bent into a horseshoe is mapped back everywhere, and its gap is outside") {
  // The middle line is a parabola whose tangents at the ends are nearly vertical; the gap between
  // its legs is in the cell's box, and Newton's method from the middle runs out of the cell.
  ElementGeometry<2> cell{Element::Q9, {}};
  const auto place = [](double s, double t) {
    const double r = 1 + 0.4 * t, angle = 1.3 * s;
    return Vec<2>(r * std::sin(angle), r * std::cos(angle));
  };
  for (int a = 0; a < 9; ++a) {
    const Vec<2> xi = node_xi<2>(Element::Q9, a);
    cell.X[static_cast<std::size_t>(a)] = place(xi[0], xi[1]);
  }
  std::mt19937 random(2);
  for (int k = 0; k < 2000; ++k) {
    const Vec<2> xi = random_xi<2>(Element::Q9, random);
    Vec<2> back;
    REQUIRE(inverse_map<2>(cell, cell.point(xi), back) == Mapped::yes);
    CHECK((back - xi).norm() < 1e-10);
  }
  for (const double x : {-0.3, 0.0, 0.3})
    for (const double y : {0.0, 0.2, 0.3}) {
      Vec<2> at;
      const Mapped mapped = inverse_map<2>(cell, Vec<2>(x, y), at);
      CHECK(mapped != Mapped::undecided);
      CHECK((mapped == Mapped::no || !in_closed_cell<2>(Element::Q9, at)));
    }
}

TEST_CASE("Gauss points of simplices come in the reference code's order") {
  const auto three = gauss_points<2>(Element::T6, 2);
  REQUIRE(three.size() == 3);
  CHECK((three[0] - Vec<2>(1.0 / 6, 1.0 / 6)).norm() < 1e-15);
  CHECK((three[1] - Vec<2>(2.0 / 3, 1.0 / 6)).norm() < 1e-15);
  CHECK((three[2] - Vec<2>(1.0 / 6, 2.0 / 3)).norm() < 1e-15);
  CHECK(gauss_points<2>(Element::T3, 1) == std::vector<Vec<2>>{Vec<2>(1.0 / 3, 1.0 / 3)});
  const auto four = gauss_points<3>(Element::Tet4, 2);
  REQUIRE(four.size() == 4);
  for (int k = 0; k < 4; ++k)
    for (int d = 0; d < 3; ++d)
      CHECK(four[static_cast<std::size_t>(k)][d] ==
            doctest::Approx(k == d ? 0.58541020 : 0.13819660).epsilon(1e-8));
}

TEST_CASE("a grid of any element fills its box with cells of equal volume") {
  const auto check = [](auto dim) {
    constexpr int Dim = decltype(dim)::value;
    for (const Element element : elements_of(Dim)) {
      CAPTURE(info(element).name);
      std::array<Index, Dim> counts;
      counts.fill(2);
      const auto t = element_grid<Dim>(element, Vec<Dim>::Zero(), Vec<Dim>::Constant(0.5), counts);
      const std::size_t n = static_cast<std::size_t>(info(element).nodes);
      double volume = 0;
      for (std::size_t c = 0; c < t.cells.size() / n; ++c) {
        ElementGeometry<Dim> cell{element, {}};
        for (std::size_t a = 0; a < n; ++a)
          cell.X[a] = t.nodes[static_cast<std::size_t>(t.cells[c * n + a])];
        CHECK(cell.volume() == doctest::Approx(static_cast<double>(n) / t.cells.size()));
        CHECK(least_jacobian<Dim>(cell) > 0.999);
        volume += cell.volume();
      }
      CHECK(volume == doctest::Approx(1));
    }
  };
  check(std::integral_constant<int, 2>());
  check(std::integral_constant<int, 3>());
}
