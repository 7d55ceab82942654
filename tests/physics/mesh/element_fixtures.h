/// \file Cells and meshes of every element, for tests.
#pragma once

#include <random>

#include "physics/mesh/element_grid.h"
#include "physics/mesh/element_map.h"
#include "tests/physics/mesh/mesh_fixtures.h"

namespace lahar::test {

inline const std::vector<Element>& elements_of(int dim) {
  using enum Element;
  static const std::vector<Element> two{T3, T6, Q4, Q8, Q9}, three{Tet4, H8, H20, H27};
  return dim == 2 ? two : three;
}

/// Call check(element, random) for every element of a dimension.
template <int Dim, class Check>
void for_elements(Check check) {
  std::mt19937 random(7);
  for (const Element element : elements_of(Dim)) {
    CAPTURE(info(element).name);
    check(element, random);
  }
}

/// A point of the closed cell; some on its faces, edges and corners.
template <int Dim>
Vec<Dim> random_xi(Element element, std::mt19937& random) {
  Vec<Dim> xi;
  if (!info(element).simplex) {
    for (int d = 0; d < Dim; ++d) {
      const auto kind = random() % 8;
      xi[d] = kind == 0 ? -1.0 : kind == 1 ? 1.0 : uniform(random, -1, 1);
    }
    return xi;
  }
  std::array<double, Dim + 1> b;
  double sum = 0;
  do {
    sum = 0;
    for (double& part : b) sum += part = random() % 4 == 0 ? 0.0 : uniform(random, 0, 1);
  } while (sum == 0);
  for (int d = 0; d < Dim; ++d) xi[d] = b[static_cast<std::size_t>(d) + 1] / sum;
  return xi;
}

/// The cell whose nodes lie at their natural coordinates.
template <int Dim>
ElementGeometry<Dim> natural_cell(Element element) {
  ElementGeometry<Dim> cell{element, {}};
  for (int a = 0; a < info(element).nodes; ++a)
    cell.X[static_cast<std::size_t>(a)] = node_xi<Dim>(element, a);
  return cell;
}

/// The least Jacobian of a cell, over that of its middle, at a lattice of points.
template <int Dim>
double least_jacobian(const ElementGeometry<Dim>& cell) {
  double least = 1;
  const double middle = cell.jacobian(centre_xi<Dim>(cell.element)).determinant();
  const int n = 8;
  for (int k = 0; k < (Dim == 2 ? 81 : 729); ++k) {
    Vec<Dim> xi;
    for (int d = 0, rest = k; d < Dim; ++d, rest /= n + 1) xi[d] = -1 + 2.0 * (rest % (n + 1)) / n;
    if (info(cell.element).simplex) xi = (0.5 * (xi.array() + 1)).matrix();
    if (!in_closed_cell<Dim>(cell.element, xi)) continue;
    least = std::min(least, cell.jacobian(xi).determinant() / middle);
  }
  return middle > 0 ? least : -1;
}

/// A valid cell, distorted until its Jacobian is somewhere 3 to 8 % of the one at its middle
/// (affine where the element has no others), far from the origin and of unequal extents.
template <int Dim>
ElementGeometry<Dim> distorted_cell(Element element, std::mt19937& random) {
  const auto straight = natural_cell<Dim>(element);
  std::array<Vec<Dim>, static_cast<std::size_t>(most_nodes<Dim>)> shift;
  for (auto& s : shift)
    s = random_point<Dim>(random, -Vec<Dim>::Ones(), Vec<Dim>::Ones()) /
        (info(element).simplex ? 2 * info(element).order : info(element).order);
  auto cell = straight;
  const bool affine = info(element).simplex && info(element).order == 1;
  double low = 0, high = 1;
  for (int halving = 0; halving < 30; ++halving) {
    const double amount = 0.5 * (low + high);
    for (std::size_t a = 0; a < shift.size(); ++a) cell.X[a] = straight.X[a] + amount * shift[a];
    const double least =
        affine ? cell.jacobian(Vec<Dim>::Zero()).determinant() : least_jacobian<Dim>(cell);
    if (least > 0.03 && least < 0.08) break;
    (least > 0.05 ? low : high) = amount;
  }
  for (auto& X : cell.X) {
    X[0] *= 0.3;
    X += Vec<Dim>::Constant(100.0);
  }
  return cell;
}

}  // namespace lahar::test
