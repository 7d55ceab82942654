/// \file What of the Lagrange elements is needed once, not per particle.
#include "physics/mesh/element.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "physics/mesh/inverse_mapping.h"

namespace lahar {
namespace {

/// Abscissae and weights of the Gauss-Legendre rule on [-1, 1], ascending.
struct GaussRule {
  std::vector<double> x, weight;
};

GaussRule gauss_rule(int n) {
  switch (n) {
    case 1:
      return {{0.0}, {2.0}};
    case 2:
      return {{-1.0 / std::sqrt(3.0), 1.0 / std::sqrt(3.0)}, {1.0, 1.0}};
    case 3:
      return {{-std::sqrt(3.0 / 5.0), 0.0, std::sqrt(3.0 / 5.0)}, {5.0 / 9, 8.0 / 9, 5.0 / 9}};
    default: {
      const double inner = std::sqrt(3.0 / 7.0 - 2.0 / 7.0 * std::sqrt(6.0 / 5.0));
      const double outer = std::sqrt(3.0 / 7.0 + 2.0 / 7.0 * std::sqrt(6.0 / 5.0));
      const double more = (18 + std::sqrt(30.0)) / 36, less = (18 - std::sqrt(30.0)) / 36;
      return {{-outer, -inner, inner, outer}, {less, more, more, less}};
    }
  }
}

/// All tuples of numbers below n; the first or the last runs fastest.
template <int Dim>
std::vector<std::array<int, Dim>> tuples(int n, bool last_fastest) {
  int total = 1;
  for (int d = 0; d < Dim; ++d) total *= n;
  std::vector<std::array<int, Dim>> all(static_cast<std::size_t>(total));
  for (int p = 0; p < total; ++p)
    for (int d = 0, rest = p; d < Dim; ++d, rest /= n)
      all[static_cast<std::size_t>(p)][static_cast<std::size_t>(last_fastest ? Dim - 1 - d : d)] =
          rest % n;
  return all;
}

/// Points of a rule for each axis; n points per axis are exact where the Jacobian has no power
/// above 2 n - 1 of any natural coordinate.
template <int Dim>
std::vector<WeightedPoint<Dim>> box_quadrature(int n) {
  const GaussRule rule = gauss_rule(n);
  std::vector<WeightedPoint<Dim>> points;
  for (const auto& at : tuples<Dim>(n, false)) {
    WeightedPoint<Dim> p{Vec<Dim>::Zero(), 1.0};
    for (int d = 0; d < Dim; ++d) {
      const auto i = static_cast<std::size_t>(at[static_cast<std::size_t>(d)]);
      p.xi[d] = rule.x[i];
      p.weight *= rule.weight[i];
    }
    points.push_back(p);
  }
  return points;
}

/// Three or four points inside a simplex, exact for quadratic functions (Zienkiewicz, Taylor & Zhu
/// 2013, tables 6.3 and 6.4), on the face opposite to each corner in turn or near it.
template <int Dim>
std::vector<Vec<Dim>> simplex_points() {
  std::vector<Vec<Dim>> points;
  if constexpr (Dim == 2) {
    const double near = 1.0 / 6, far = 2.0 / 3;
    points = {{near, near}, {far, near}, {near, far}};
  } else {
    const double near = (5 - std::sqrt(5.0)) / 20, far = (5 + 3 * std::sqrt(5.0)) / 20;
    points = {{far, near, near}, {near, far, near}, {near, near, far}, {near, near, near}};
  }
  return points;
}

constexpr double simplex_volume(int dim) {
  return dim == 2 ? 1.0 / 2 : 1.0 / 6;
}

/// A simplex in natural coordinates.
template <int Dim>
using Simplex = std::array<Vec<Dim>, Dim + 1>;

template <int Dim>
CellPart<Dim> part_of(const Simplex<Dim>& corner, double volume) {
  const auto at = [&](const Vec<Dim>& b) -> Vec<Dim> {
    Vec<Dim> xi = (1.0 - b.sum()) * corner[0];
    for (int d = 0; d < Dim; ++d) xi += b[d] * corner[static_cast<std::size_t>(d) + 1];
    return xi;
  };
  CellPart<Dim> part{at(Vec<Dim>::Constant(1.0 / (Dim + 1))), {}};
  const auto points = simplex_points<Dim>();
  for (const auto& b : points)
    part.quadrature.push_back({at(b), volume / static_cast<double>(points.size())});
  return part;
}

/// In the coordinates y_k = xi_k + ... + xi_last the cell is 1 >= y_0 >= y_1 >= ... >= 0: one of
/// the Dim! simplices into which the orders of coordinates cut a cube. Cut in the same way, the
/// cubes of a finer grid are inside or outside of it with every of their simplices.
template <int Dim>
std::vector<CellPart<Dim>> cut_simplex(int n) {
  std::vector<CellPart<Dim>> parts;
  const double volume = simplex_volume(Dim) / std::pow(n, Dim);
  const auto natural = [](const Vec<Dim>& y) {
    Vec<Dim> xi = y;
    for (int d = 0; d + 1 < Dim; ++d) xi[d] -= y[d + 1];
    return xi;
  };
  for (const auto& cube : tuples<Dim>(n, false)) {
    Vec<Dim> low;
    for (int d = 0; d < Dim; ++d) low[d] = cube[static_cast<std::size_t>(d)];
    std::array<int, Dim> order;
    for (int d = 0; d < Dim; ++d) order[static_cast<std::size_t>(d)] = d;
    do {
      Simplex<Dim> corner;
      Vec<Dim> y = low, middle = low;
      corner[0] = natural(y / n);
      for (std::size_t k = 0; k < Dim; ++k) {
        y[order[k]] += 1.0;
        corner[k + 1] = natural(y / n);
        middle += y;
      }
      middle /= Dim + 1;
      bool inside = true;
      for (int d = 0; d + 1 < Dim; ++d) inside &= middle[d] > middle[d + 1];
      if (inside) parts.push_back(part_of<Dim>(corner, volume));
    } while (std::next_permutation(order.begin(), order.end()));
  }
  return parts;
}

}  // namespace

void wrong_element(Element element, int dim) {
  throw std::logic_error("element " + std::string(info(element).name) + " in " +
                         std::to_string(dim) + "D");
}

std::optional<Element> element_named(std::string_view name) {
  for (int e = 0; e < n_elements; ++e)
    if (info(static_cast<Element>(e)).name == name) return static_cast<Element>(e);
  return std::nullopt;
}

template <int Dim>
Vec<Dim> node_xi(Element element, int node) {
  const auto& place = detail::node_place(element, node);
  Vec<Dim> xi;
  for (int d = 0; d < Dim; ++d) xi[d] = place[static_cast<std::size_t>(d)];
  return info(element).simplex ? Vec<Dim>(0.5 * xi) : xi;
}

template <int Dim>
Vec<Dim> centre_xi(Element element) {
  return Vec<Dim>::Constant(info(element).simplex ? 1.0 / (Dim + 1) : 0.0);
}

template <int Dim>
double outside_by(Element element, const Vec<Dim>& xi) {
  double most = info(element).simplex ? xi.sum() - 1.0 : -1.0;
  for (int d = 0; d < Dim; ++d) {
    const double beyond = info(element).simplex ? -xi[d] : std::abs(xi[d]) - 1.0;
    most = std::max(most, beyond);
  }
  return xi.allFinite() ? most : std::numeric_limits<double>::quiet_NaN();
}

/// Coordinates are compared with 1 one by one, not by their distance from it: that is 0 for the
/// last number above 1, too.
template <int Dim>
bool in_closed_cell(Element element, const Vec<Dim>& xi) {
  if (!info(element).simplex) return in_closed_cell<Dim>(xi);
  bool inside = xi.sum() <= 1.0;
  for (int d = 0; d < Dim; ++d) inside &= xi[d] >= 0.0;
  return inside;
}

template <int Dim>
int nearest_face(Element element, const Vec<Dim>& xi) {
  int axis = 0;
  if (!info(element).simplex) {
    xi.cwiseAbs().maxCoeff(&axis);
    return 2 * axis + (xi[axis] > 0);
  }
  const double least = xi.minCoeff(&axis);
  return 1.0 - xi.sum() < least ? 0 : axis + 1;
}

template <int Dim>
Vec<Dim> clamp_to_cell(Element element, const Vec<Dim>& xi) {
  if (!info(element).simplex) return clamp_to_cell<Dim>(xi);
  constexpr double least = 1.0 - xi_max;
  Vec<Dim> inside = xi.cwiseMax(least);
  // The sum must round to less than 1: take away what is too much, and a little more.
  if (const double sum = inside.sum(); sum > xi_max) {
    int largest = 0;
    inside.maxCoeff(&largest);
    inside[largest] -= sum - (xi_max - Dim * least);
  }
  return inside;
}

template <int Dim>
const std::vector<WeightedPoint<Dim>>& volume_quadrature(Element element) {
  // The Jacobian of Q8 and Q9 has powers up to 3, that of H20 and H27 up to 5; in T6 it is
  // quadratic.
  static const auto two = box_quadrature<Dim>(2), three = box_quadrature<Dim>(3);
  static const auto simplex = cut_simplex<Dim>(1)[0].quadrature;
  if (info(element).simplex) return simplex;
  return Dim == 3 && info(element).order == 2 ? three : two;
}

template <int Dim>
std::vector<double> means_of_functions(Element element) {
  return with_element<Dim>(element, [&](auto constant) {
    constexpr Element E = constant();
    constexpr int nodes = info(E).nodes;
    std::vector<double> means(nodes);
    double volume = 0;
    for (const auto& [xi, weight] : volume_quadrature<Dim>(element)) {
      double at[Dim], N[nodes];
      for (int d = 0; d < Dim; ++d) at[d] = xi[d];
      Shape<E>::values(at, N);
      for (std::size_t a = 0; a < nodes; ++a) means[a] += weight * N[a];
      volume += weight;
    }
    for (double& mean : means) mean /= volume;
    return means;
  });
}

template <int Dim>
std::vector<CellPart<Dim>> cut_cell(Element element, int n) {
  if (info(element).simplex) return cut_simplex<Dim>(n);
  std::vector<CellPart<Dim>> parts;
  for (const auto& at : tuples<Dim>(n, false)) {
    CellPart<Dim>& part = parts.emplace_back();
    for (int d = 0; d < Dim; ++d)
      part.centre[d] = -1 + (2.0 * at[static_cast<std::size_t>(d)] + 1) / n;
    for (auto point : volume_quadrature<Dim>(element)) {
      point.xi = part.centre + point.xi / n;
      point.weight /= std::pow(n, Dim);
      part.quadrature.push_back(point);
    }
  }
  return parts;
}

int most_gauss_points(Element element) {
  return info(element).simplex ? 2 : 4;
}

template <int Dim>
std::vector<Vec<Dim>> gauss_points(Element element, int n) {
  if (info(element).simplex)
    return n == 1 ? std::vector<Vec<Dim>>{centre_xi<Dim>(element)} : simplex_points<Dim>();
  const auto a = gauss_rule(n).x;
  std::vector<Vec<Dim>> points;
  if (n == 2 || (n == 3 && Dim == 2)) {
    // Where the corners are, and in 2D also the mid-sides and the centre.
    for (int k = 0; k < (n == 2 ? corners<Dim> : 9); ++k)
      points.push_back(node_xi<Dim>(Dim == 2 ? Element::Q9 : Element::H8, k) * a.back());
    return points;
  }
  for (const auto& at : tuples<Dim>(n, true))
    for (int d = 0; d < Dim; ++d) {
      if (d == 0) points.emplace_back();
      points.back()[d] = a[static_cast<std::size_t>(at[static_cast<std::size_t>(d)])];
    }
  if (Dim == 3 && n == 4)  // layer by layer, each as in 2D
    std::stable_sort(points.begin(), points.end(),
                     [](const Vec<Dim>& p, const Vec<Dim>& q) { return p[Dim - 1] < q[Dim - 1]; });
  return points;
}

#define LAHAR_INSTANTIATE(Dim)                                                     \
  template Vec<Dim> node_xi<Dim>(Element, int);                                    \
  template Vec<Dim> centre_xi<Dim>(Element);                                       \
  template double outside_by<Dim>(Element, const Vec<Dim>&);                       \
  template bool in_closed_cell<Dim>(Element, const Vec<Dim>&);                     \
  template int nearest_face<Dim>(Element, const Vec<Dim>&);                        \
  template Vec<Dim> clamp_to_cell<Dim>(Element, const Vec<Dim>&);                  \
  template const std::vector<WeightedPoint<Dim>>& volume_quadrature<Dim>(Element); \
  template std::vector<double> means_of_functions<Dim>(Element);                   \
  template std::vector<CellPart<Dim>> cut_cell<Dim>(Element, int);                 \
  template std::vector<Vec<Dim>> gauss_points<Dim>(Element, int);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
