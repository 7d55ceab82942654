/// \file Points, measures and inverse map of a cell of any element.
#include "physics/mesh/element_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/mesh/newton.h"

namespace lahar {
namespace {

template <int Dim>
using Matrix = Eigen::Matrix<double, Dim, Dim>;

/// A root this near to the cell [natural coordinates] is the only one there: where the map is one
/// to one in the cell, it is so a little beyond.
constexpr double touching = 1e-6;
/// So is one this near, where the cell is not distorted: the Jacobian there is this share of the
/// one in the middle. (In random cells whose Jacobian falls below a twentieth, other roots were
/// found from 0.07 on.)
constexpr double beside = 0.05, sound = 0.3;
/// Control points must be this far on one side of a point [natural coordinates] for it to be out of
/// their hull: far above the rounding with which they are computed.
constexpr double clear_of_hull = 1e-10;
/// Times that the cell is halved along each axis in the search.
constexpr int most_halvings = 12;
/// Boxes that a search looks at: some per level suffice even on the edge of a folding cell.
constexpr int most_boxes = 4000;
/// A box that cannot be divided further is explained by a root so many of its edges away.
constexpr double near_box = 8;

/// x(xi) - x0.
template <Element E>
struct ElementMap {
  static constexpr int dim = info(E).dim, nodes = info(E).nodes;
  std::array<Vec<dim>, nodes> X;

  ElementMap(const ElementGeometry<dim>& cell, const Vec<dim>& x0) {
    for (int a = 0; a < nodes; ++a) X[a] = cell.X[a] - x0;
  }
  Vec<dim> value(const Vec<dim>& xi) const {
    double at[dim], N[nodes];
    std::copy_n(xi.data(), dim, at);
    Shape<E>::values(at, N);
    Vec<dim> x = N[0] * X[0];
    for (int a = 1; a < nodes; ++a) x += N[a] * X[a];
    return x;
  }
  Matrix<dim> gradient(const Vec<dim>& xi) const {
    double at[dim], dN[nodes][dim];
    std::copy_n(xi.data(), dim, at);
    Shape<E>::gradients(at, dN);
    Matrix<dim> J = Matrix<dim>::Zero();
    for (int a = 0; a < nodes; ++a)
      for (int d = 0; d < dim; ++d) J.col(d) += dN[a][d] * X[a];
    return J;
  }
};

template <int Dim, class Body>
decltype(auto) with_map(const ElementGeometry<Dim>& cell, const Vec<Dim>& x0, Body body) {
  return with_element<Dim>(cell.element, [&](auto element) {
    return body(ElementMap<decltype(element)::value>(cell, x0));
  });
}

/// The control points, in Bernstein's form, of a map that is at most quadratic along every axis,
/// over a box of natural coordinates: its image lies in their convex hull.
template <int Dim>
struct ControlNet {
  static constexpr int points = Dim == 2 ? 9 : 27;
  std::array<Vec<Dim>, static_cast<std::size_t>(points)> p;  ///< the first axis runs fastest
  Vec<Dim> low, high;

  /// The whole cell; a simplex within its box.
  template <class Map>
  ControlNet(Element element, const Map& map) {
    low = Vec<Dim>::Constant(info(element).simplex ? 0.0 : -1.0);
    high = Vec<Dim>::Ones();
    for (int k = 0; k < points; ++k) {
      Vec<Dim> xi;
      for (int d = 0, rest = k; d < Dim; ++d, rest /= 3)
        xi[d] = low[d] + 0.5 * (rest % 3) * (high[d] - low[d]);
      p[k] = map.value(xi);
    }
    for (int d = 0; d < Dim; ++d)
      for_each_line(d, [](Vec<Dim>& a, Vec<Dim>& b, Vec<Dim>& c) { b = 2.0 * b - 0.5 * (a + c); });
  }

  /// Call body(a, b, c) for every three points along an axis.
  template <class Body>
  void for_each_line(int axis, Body body) {
    const int stride = axis == 0 ? 1 : axis == 1 ? 3 : 9;
    for (int k = 0; k < points; ++k)
      if (k / stride % 3 == 0) body(p[k], p[k + stride], p[k + 2 * stride]);
  }
  /// One half along an axis (de Casteljau).
  ControlNet half(int axis, bool upper) const {
    ControlNet part = *this;
    (upper ? part.low : part.high)[axis] = 0.5 * (low[axis] + high[axis]);
    part.for_each_line(axis, [upper](Vec<Dim>& a, Vec<Dim>& b, Vec<Dim>& c) {
      const Vec<Dim> left = 0.5 * (a + b), right = 0.5 * (b + c);
      const Vec<Dim> middle = 0.5 * (left + right);
      if (upper)
        a = middle, b = right;
      else
        b = left, c = middle;
    });
    return part;
  }
  std::pair<Vec<Dim>, Vec<Dim>> hull() const {
    Vec<Dim> least = p[0], most = p[0];
    for (const auto& x : p) least = least.cwiseMin(x), most = most.cwiseMax(x);
    return {least, most};
  }
  Vec<Dim> middle() const { return 0.5 * (low + high); }
};

/// The search for a point of a cell that maps to a given one.
template <Element E>
class Search {
 public:
  static constexpr int dim = info(E).dim;
  using Point = Vec<dim>;

  explicit Search(const ElementMap<E>& map) : map_(map), middle_(map.gradient(centre_xi<dim>(E))) {}

  Mapped run(Point& xi) {
    ControlNet<dim> cell(E, map_);
    // Distances are then natural coordinates, and hulls of boxes are nearly these boxes.
    const Matrix<dim> to_natural = middle_.inverse();
    for (auto& x : cell.p) x = to_natural * x;
    const Mapped result = look(cell, 0);
    if (found_) xi = nearest_;
    if (result == Mapped::no && found_) return Mapped::yes;
    return result;
  }

  /// Newton's method from a start; true if it ended in the cell or so near that no other root is.
  bool solve(Point start) {
    double residual;
    last_converged_ = newton<dim>(map_, start, residual);
    if (!last_converged_) return false;
    last_ = start;
    const double outside = outside_by<dim>(E, start);
    if (!found_ || outside < least_outside_) {
      found_ = true;
      least_outside_ = outside;
      nearest_ = start;
    }
    if (in_closed_cell<dim>(E, start) || outside < touching) return true;
    return outside < beside && map_.gradient(start).determinant() > sound * middle_.determinant();
  }
  const Point& nearest() const { return nearest_; }

 private:
  Mapped look(const ControlNet<dim>& box, int depth) {
    if (excluded(box)) return Mapped::no;
    if (++boxes_ > most_boxes) return Mapped::undecided;
    const int axis = depth % dim;
    if (axis == 0) {
      if (solve(box.middle())) return Mapped::yes;
      if (depth == most_halvings * dim) return is_explained(box) ? Mapped::no : Mapped::undecided;
    }
    Mapped result = Mapped::no;
    for (const bool upper : {false, true}) {
      const Mapped half = look(box.half(axis, upper), depth + 1);
      if (half == Mapped::yes) return half;
      if (half == Mapped::undecided) result = half;
    }
    return result;
  }
  bool excluded(const ControlNet<dim>& box) const {
    if (info(E).simplex && box.low.sum() > 1.0 + clear_of_hull) return true;
    const auto [least, most] = box.hull();
    return (least.array() > clear_of_hull).any() || (most.array() < -clear_of_hull).any();
  }
  /// The root to which a small box leads lies beside the box, not in the cell.
  bool is_explained(const ControlNet<dim>& box) const {
    const double edge = (box.high - box.low).maxCoeff();
    return last_converged_ &&
           (last_ - box.middle()).template lpNorm<Eigen::Infinity>() < near_box * edge;
  }

  const ElementMap<E>& map_;
  Matrix<dim> middle_;  ///< the Jacobian there
  int boxes_ = 0;
  bool found_ = false, last_converged_ = false;
  double least_outside_ = std::numeric_limits<double>::infinity();
  Point nearest_ = Point::Zero(), last_ = Point::Zero();
};

}  // namespace

template <int Dim>
Vec<Dim> ElementGeometry<Dim>::point(const Vec<Dim>& xi) const {
  return with_map<Dim>(*this, X[0], [&](const auto& map) { return Vec<Dim>(map.value(xi)); }) +
         X[0];
}

template <int Dim>
Eigen::Matrix<double, Dim, Dim> ElementGeometry<Dim>::jacobian(const Vec<Dim>& xi) const {
  return with_map<Dim>(*this, X[0], [&](const auto& map) { return map.gradient(xi); });
}

template <int Dim>
double ElementGeometry<Dim>::volume() const {
  return with_map<Dim>(*this, X[0], [&](const auto& map) {
    double sum = 0;
    for (const auto& q : volume_quadrature<Dim>(element))
      sum += q.weight * map.gradient(q.xi).determinant();
    return sum;
  });
}

template <int Dim>
Vec<Dim> ElementGeometry<Dim>::centre() const {
  Vec<Dim> sum = X[0];
  for (int k = 1; k < info(element).corners; ++k) sum += X[k];
  return sum / info(element).corners;
}

template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> ElementGeometry<Dim>::bounds() const {
  if (info(element).order == 1) {
    Vec<Dim> low = X[0], high = X[0];
    for (int a = 1; a < nodes(); ++a) low = low.cwiseMin(X[a]), high = high.cwiseMax(X[a]);
    return {low, high};
  }
  if constexpr (Dim == 2) {
    if (info(element).simplex) {  // Bernstein's form on a triangle
      Vec<2> low = X[0], high = X[0];
      for (int a = 1; a < 6; ++a) {
        const Vec<2> ends = a < 3 ? X[a] : Vec<2>(0.5 * (X[a - 3] + X[(a - 2) % 3]));
        const Vec<2> control = 2.0 * X[a] - ends;
        low = low.cwiseMin(control), high = high.cwiseMax(control);
      }
      return {low, high};
    }
  }
  return with_map<Dim>(*this, X[0], [&](const auto& map) {
    const auto [low, high] = ControlNet<Dim>(element, map).hull();
    return std::pair<Vec<Dim>, Vec<Dim>>(low + X[0], high + X[0]);
  });
}

template <int Dim>
double ElementGeometry<Dim>::size() const {
  const double edge = info(element).simplex ? 1.0 : 2.0;  // of the cell in natural coordinates
  double least = std::numeric_limits<double>::infinity();
  for (int a = 0; a < nodes(); ++a) {
    // Rows of the inverse Jacobian are the normals of faces over the distance between them; the
    // last face of a simplex has minus their sum.
    const Matrix<Dim> normals = (edge * jacobian(node_xi<Dim>(element, a))).inverse();
    double steepest = normals.rowwise().norm().maxCoeff();
    if (info(element).simplex) steepest = std::max(steepest, normals.colwise().sum().norm());
    least = std::min(least, 1.0 / steepest);
  }
  return least / info(element).order;
}

namespace {

/// The inverse of the map's affine part at the middle of the cell; false if that is folded.
template <Element E>
bool affine_estimate(const ElementMap<E>& map, Vec<info(E).dim>& xi) {
  constexpr int dim = info(E).dim;
  xi = centre_xi<dim>(E);
  Vec<dim> step;
  if (!solve_positive(map.gradient(xi), map.value(xi), step)) return false;
  xi -= step;
  return true;
}

template <Element E>
constexpr bool is_affine = info(E).order == 1 && info(E).simplex;

}  // namespace

template <int Dim>
Mapped inverse_map(const ElementGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi) {
  return with_element<Dim>(cell.element, [&](auto element) {
    constexpr Element E = decltype(element)::value;
    const ElementMap<E> map(cell, x);
    if (!x.allFinite()) {
      xi = centre_xi<Dim>(E);
      return Mapped::no;
    }
    if constexpr (is_affine<E>) {
      return affine_estimate(map, xi) ? Mapped::yes : Mapped::undecided;
    } else {
      Search<E> search(map);
      if (search.solve(centre_xi<Dim>(E))) {
        xi = search.nearest();
        return Mapped::yes;
      }
      affine_estimate(map, xi);
      return search.run(xi);
    }
  });
}

template <int Dim>
bool quick_inverse_map(const ElementGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi) {
  return with_element<Dim>(cell.element, [&](auto element) {
    constexpr Element E = decltype(element)::value;
    const ElementMap<E> map(cell, x);
    const bool estimated = affine_estimate(map, xi);
    if constexpr (is_affine<E>) return estimated;
    Vec<Dim> found = centre_xi<Dim>(E);
    double residual;
    if (!newton<Dim>(map, found, residual)) return false;
    xi = found;
    return true;
  });
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template struct ElementGeometry<Dim>;                                                      \
  template Mapped inverse_map<Dim>(const ElementGeometry<Dim>&, const Vec<Dim>&, Vec<Dim>&); \
  template bool quick_inverse_map<Dim>(const ElementGeometry<Dim>&, const Vec<Dim>&, Vec<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
