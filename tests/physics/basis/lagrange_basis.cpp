#include "physics/basis/lagrange_basis.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>

#include "tests/physics/mesh/element_fixtures.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// A basis at points of a cell that is bent everywhere, a hundred of its lengths from the origin.
template <Element E>
struct BentCell {
  static constexpr int dim = info(E).dim;
  ElementGeometry<dim> geometry = natural_cell<dim>(E);
  std::vector<double> position;
  std::vector<Local> nodes;

  explicit BentCell(std::mt19937& random) {
    nodes.resize(static_cast<std::size_t>(info(E).nodes));
    std::iota(nodes.begin(), nodes.end(), 0);
    position.assign(nodes.size() * node_width, 0.0);
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      auto& X = geometry.X[a];
      X += random_point<dim>(random, Vec<dim>::Constant(-0.05), Vec<dim>::Constant(0.05)) +
           Vec<dim>::Constant(100.0);
      std::copy_n(X.data(), dim, &position[a * node_width]);
    }
  }
  LagrangeBasis<E> basis() const { return {position.data(), nodes.data(), {}}; }
};

/// Points of a pack and where the search for them begins.
template <int Dim>
struct Search {
  Pack x[Dim], xi[Dim];

  void set(int lane, const Vec<Dim>& point, const Vec<Dim>& start) {
    for (int d = 0; d < Dim; ++d) {
      x[d].v[lane] = point[d];
      xi[d].v[lane] = start[d];
    }
  }
  Vec<Dim> found(int lane) const {
    Vec<Dim> at;
    for (int d = 0; d < Dim; ++d) at[d] = xi[d][lane];
    return at;
  }
};

template <Element E>
void check_inverse_of_packs() {
  constexpr int Dim = info(E).dim;
  CAPTURE(info(E).name);
  std::mt19937 random(11);
  for (int k = 0; k < 30; ++k) {
    const BentCell<E> cell(random);
    const auto basis = cell.basis();
    for (const double away : {0.0, 1e-10, 1e-8, 1e-6, 1e-4, 1e-3, 1e-2, 0.3}) {
      CAPTURE(away);
      const auto near = [&](const Vec<Dim>& xi) {
        return Vec<Dim>(xi + away * random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones()));
      };
      Search<Dim> search, beside;
      std::vector<Vec<Dim>> point;
      for (int lane = 0; lane < lanes<Pack>; ++lane) {
        const Vec<Dim> xi = random_xi<Dim>(E, random);
        point.push_back(cell.geometry.point(xi));
        const Vec<Dim> start = near(xi);
        search.set(lane, point.back(), start);
        // Every other lane looks for something else, from far away.
        const Vec<Dim> other = random_xi<Dim>(E, random);
        if (lane % 2 == 0)
          beside.set(lane, point.back(), start);
        else
          beside.set(lane, cell.geometry.point(other), Vec<Dim>(0.5 * other));
      }
      CHECK(basis.inverse_map(search.x, search.xi, lanes<Pack>) == 0);
      basis.inverse_map(beside.x, beside.xi, lanes<Pack>);
      for (int lane = 0; lane < lanes<Pack>; ++lane) {
        const auto& x = point[static_cast<std::size_t>(lane)];
        CHECK((cell.geometry.point(search.found(lane)) - x).norm() < 1e-13);
        if (lane % 2 == 0) CHECK(beside.found(lane) == search.found(lane));
      }
    }
  }
}

}  // namespace

TEST_CASE("packs find natural coordinates to the last digits, however far off they begin") {
  using enum Element;
  check_inverse_of_packs<T3>();
  check_inverse_of_packs<T6>();
  check_inverse_of_packs<Q8>();
  check_inverse_of_packs<Q9>();
  check_inverse_of_packs<Tet4>();
  check_inverse_of_packs<H20>();
  check_inverse_of_packs<H27>();
}
