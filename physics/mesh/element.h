/// \file The Lagrange elements: their nodes, faces and shape functions.
///
/// A cell's shape functions N_a(xi) are 1 at node a, 0 at its other nodes, and sum to 1. Natural
/// coordinates of quadrilaterals and hexahedra run from -1 to 1 along each axis, those of triangles
/// and tetrahedra are the last Dim barycentric coordinates: xi_d >= 0, their sum <= 1.
/// Q4, Q9, H8 and H27 are products of polynomials along the axes, Q8 and H20 the serendipity
/// elements, T6 is quadratic (Zienkiewicz, Taylor & Zhu 2013, The Finite Element Method, chap. 6).
///
/// Nodes are in *file order*: corners (Q4 counter-clockwise; H8 bottom, then top), then the edges,
/// faces and the centre in the order of Gmsh.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "physics/base/simd.h"
#include "physics/base/types.h"

namespace lahar {

enum class Element : std::uint8_t { T3, T6, Q4, Q8, Q9, Tet4, H8, H20, H27 };
inline constexpr int n_elements = 9;

/// The most nodes that an element has in a dimension, and the most faces.
template <int Dim>
inline constexpr int most_nodes = Dim == 2 ? 9 : 27;
template <int Dim>
inline constexpr int most_faces = 2 * Dim;
inline constexpr int most_face_corners = 4;

struct ElementInfo {
  std::string_view name;  ///< as scenarios write it
  std::string_view noun;  ///< what a cell of it is called in messages
  int dim, nodes, corners, faces;
  int order;     ///< of the polynomials along an edge
  bool simplex;  ///< a triangle or tetrahedron
  /// Corners of each face, in file order, -1 behind the last. Face 2 d + (0: minus, 1: plus side)
  /// is normal to natural axis d; face a of a simplex lies opposite to corner a.
  std::array<std::array<signed char, most_face_corners>, 6> face;
};

namespace detail {

inline constexpr std::array<ElementInfo, n_elements> element_table = [] {
  using Faces = decltype(ElementInfo::face);
  constexpr Faces triangle{{{1, 2, -1, -1}, {2, 0, -1, -1}, {0, 1, -1, -1}}};
  constexpr Faces quadrilateral{{{3, 0, -1, -1}, {1, 2, -1, -1}, {0, 1, -1, -1}, {2, 3, -1, -1}}};
  constexpr Faces tetrahedron{{{1, 2, 3, -1}, {0, 3, 2, -1}, {0, 1, 3, -1}, {0, 2, 1, -1}}};
  constexpr Faces hexahedron{
      {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}}};
  return std::array<ElementInfo, n_elements>{{
      {"ED2T3", "triangle", 2, 3, 3, 3, 1, true, triangle},
      {"ED2T6", "triangle", 2, 6, 3, 3, 2, true, triangle},
      {"ED2Q4", "quadrilateral", 2, 4, 4, 4, 1, false, quadrilateral},
      {"ED2Q8", "quadrilateral", 2, 8, 4, 4, 2, false, quadrilateral},
      {"ED2Q9", "quadrilateral", 2, 9, 4, 4, 2, false, quadrilateral},
      {"ED3T4", "tetrahedron", 3, 4, 4, 4, 1, true, tetrahedron},
      {"ED3H8", "hexahedron", 3, 8, 8, 6, 1, false, hexahedron},
      {"ED3H20", "hexahedron", 3, 20, 8, 6, 2, false, hexahedron},
      {"ED3H27", "hexahedron", 3, 27, 8, 6, 2, false, hexahedron},
  }};
}();

/// Where the nodes lie: -1, 0, 1 along each axis, in simplices twice the natural coordinates.
using NodePlace = std::array<signed char, 3>;
inline constexpr std::array<NodePlace, 9> quadrilateral_nodes{{{-1, -1, 0},
                                                               {1, -1, 0},
                                                               {1, 1, 0},
                                                               {-1, 1, 0},
                                                               {0, -1, 0},
                                                               {1, 0, 0},
                                                               {0, 1, 0},
                                                               {-1, 0, 0},
                                                               {0, 0, 0}}};
inline constexpr std::array<NodePlace, 27> hexahedron_nodes{
    {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1},  {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1},
     {-1, 1, 1},   {0, -1, -1}, {-1, 0, -1}, {-1, -1, 0}, {1, 0, -1},  {1, -1, 0}, {0, 1, -1},
     {1, 1, 0},    {-1, 1, 0},  {0, -1, 1},  {-1, 0, 1},  {1, 0, 1},   {0, 1, 1},  {0, 0, -1},
     {0, -1, 0},   {-1, 0, 0},  {1, 0, 0},   {0, 1, 0},   {0, 0, 1},   {0, 0, 0}}};
inline constexpr std::array<NodePlace, 6> triangle_nodes{
    {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
inline constexpr std::array<NodePlace, 4> tetrahedron_nodes{
    {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}}};

constexpr const NodePlace& node_place(Element e, int node) {
  const auto n = static_cast<std::size_t>(node);
  const ElementInfo& info = element_table[static_cast<std::size_t>(e)];
  if (info.simplex) return info.dim == 2 ? triangle_nodes[n] : tetrahedron_nodes[n];
  return info.dim == 2 ? quadrilateral_nodes[n] : hexahedron_nodes[n];
}

}  // namespace detail

constexpr const ElementInfo& info(Element element) {
  return detail::element_table[static_cast<std::size_t>(element)];
}
/// Elements without nodes within cells or faces: functions of their corners have negative means.
constexpr bool is_serendipity(Element element) {
  return element == Element::Q8 || element == Element::H20;
}
/// The element of this name ("ED2T3"); none if there is no such Lagrange element.
std::optional<Element> element_named(std::string_view name);

/// Q4 and H8, which kernels of their own serve.
template <int Dim>
inline constexpr Element multilinear = Dim == 2 ? Element::Q4 : Element::H8;

/// The shape functions of an element for Real a double or a pack of particles of one cell.
template <Element E>
struct Shape {
  static constexpr int dim = info(E).dim, nodes = info(E).nodes;

  /// N_a(xi).
  template <class Real>
  LAHAR_INLINE static void values(const Real (&xi)[dim], Real (&N)[nodes]);
  /// dN[a][d] = dN_a/dxi_d.
  template <class Real>
  LAHAR_INLINE static void gradients(const Real (&xi)[dim], Real (&dN)[nodes][dim]);

 private:
  /// Side of axis d on which node a lies (0: minus, 1: middle, 2: plus), or its doubled
  /// natural coordinate in a simplex.
  static constexpr int place(int a, int d) {
    return detail::node_place(E, a)[static_cast<std::size_t>(d)] + (info(E).simplex ? 0 : 1);
  }
  static constexpr int middles(int a) {
    int n = 0;
    for (int d = 0; d < dim; ++d) n += place(a, d) == 1;
    return n;
  }
  template <class Real>
  struct Axes;
  template <class Real>
  struct Barycentric;
};

/// Q4, Q9, H8, H27: polynomials l[d][s] of one axis and their derivatives g.
/// Q8, H20: l[d][0 or 2] = 1 -+ xi_d and l[d][1] = 1 - xi_d^2.
template <Element E>
template <class Real>
struct Shape<E>::Axes {
  static constexpr bool serendipity = is_serendipity(E);
  Real l[dim][3], g[dim][3];

  LAHAR_INLINE explicit Axes(const Real (&xi)[dim]) {
    LAHAR_UNROLL
    for (int d = 0; d < dim; ++d) {
      if constexpr (serendipity) {
        l[d][0] = 1.0 - xi[d];
        l[d][1] = 1.0 - xi[d] * xi[d];
        l[d][2] = 1.0 + xi[d];
        g[d][0] = Real(-1.0);
        g[d][1] = -2.0 * xi[d];
        g[d][2] = Real(1.0);
      } else if constexpr (info(E).order == 1) {
        l[d][0] = 0.5 - 0.5 * xi[d];
        l[d][1] = Real(0.0);
        l[d][2] = 0.5 + 0.5 * xi[d];
        g[d][0] = Real(-0.5);
        g[d][1] = Real(0.0);
        g[d][2] = Real(0.5);
      } else {
        const Real half = 0.5 * xi[d];
        l[d][0] = half * xi[d] - half;
        l[d][1] = 1.0 - xi[d] * xi[d];
        l[d][2] = half * xi[d] + half;
        g[d][0] = xi[d] - 0.5;
        g[d][1] = -2.0 * xi[d];
        g[d][2] = xi[d] + 0.5;
      }
    }
  }

  /// Product over all axes, of axis `except` (-1 = none) the derivative.
  LAHAR_INLINE Real product(int a, int except) const {
    Real value = except == 0 ? g[0][place(a, 0)] : l[0][place(a, 0)];
    LAHAR_UNROLL
    for (int d = 1; d < dim; ++d) value *= except == d ? g[d][place(a, d)] : l[d][place(a, d)];
    return value;
  }
  /// Serendipity, corners: the factor sum_d s_d xi_d - (dim - 1), with s_d = -+ 1.
  LAHAR_INLINE Real corner_factor(int a, const Real (&xi)[dim]) const {
    Real sum = place(a, 0) == 0 ? -xi[0] : xi[0];
    LAHAR_UNROLL
    for (int d = 1; d < dim; ++d) sum += place(a, d) == 0 ? -xi[d] : xi[d];
    return sum - Real(dim - 1.0);
  }
  static constexpr double corner_scale = 1.0 / (1 << dim), middle_scale = 2.0 * corner_scale;
};

/// T3, T6, Tet4: barycentric coordinates, b[0] = 1 - sum xi.
template <Element E>
template <class Real>
struct Shape<E>::Barycentric {
  Real b[dim + 1];

  LAHAR_INLINE explicit Barycentric(const Real (&xi)[dim]) {
    b[0] = 1.0 - xi[0];
    b[1] = xi[0];
    LAHAR_UNROLL
    for (int d = 1; d < dim; ++d) b[0] -= xi[d], b[d + 1] = xi[d];
  }
  /// db_k/dxi_d.
  static constexpr double slope(int k, int d) { return k == 0 ? -1.0 : k == d + 1 ? 1.0 : 0.0; }
  /// The two corners between which node a of T6 lies.
  static constexpr std::array<int, 2> ends(int a) { return {a - 3, (a - 2) % 3}; }
};

template <Element E>
template <class Real>
LAHAR_INLINE void Shape<E>::values(const Real (&xi)[dim], Real (&N)[nodes]) {
  if constexpr (info(E).simplex) {
    const Barycentric<Real> at(xi);
    LAHAR_UNROLL
    for (int a = 0; a < nodes; ++a) {
      if constexpr (info(E).order == 1) {
        N[a] = at.b[a];
      } else if (a <= dim) {
        N[a] = at.b[a] * (2.0 * at.b[a] - 1.0);
      } else {
        const auto ends = at.ends(a);
        N[a] = 4.0 * at.b[ends[0]] * at.b[ends[1]];
      }
    }
  } else {
    const Axes<Real> at(xi);
    LAHAR_UNROLL
    for (int a = 0; a < nodes; ++a) {
      N[a] = at.product(a, -1);
      if constexpr (Axes<Real>::serendipity)
        N[a] *= middles(a) ? Real(at.middle_scale) : at.corner_scale * at.corner_factor(a, xi);
    }
  }
}

template <Element E>
template <class Real>
LAHAR_INLINE void Shape<E>::gradients(const Real (&xi)[dim], Real (&dN)[nodes][dim]) {
  if constexpr (info(E).simplex) {
    const Barycentric<Real> at(xi);
    LAHAR_UNROLL
    for (int a = 0; a < nodes; ++a) LAHAR_UNROLL
    for (int d = 0; d < dim; ++d) {
      if constexpr (info(E).order == 1) {
        dN[a][d] = Real(at.slope(a, d));
      } else if (a <= dim) {
        dN[a][d] = at.slope(a, d) * (4.0 * at.b[a] - 1.0);
      } else {
        const auto [i, j] = at.ends(a);
        dN[a][d] = 4.0 * (at.slope(i, d) * at.b[j] + at.slope(j, d) * at.b[i]);
      }
    }
  } else {
    const Axes<Real> at(xi);
    LAHAR_UNROLL
    for (int a = 0; a < nodes; ++a) LAHAR_UNROLL
    for (int d = 0; d < dim; ++d) {
      dN[a][d] = at.product(a, d);
      if constexpr (Axes<Real>::serendipity) {
        if (middles(a)) {
          dN[a][d] *= at.middle_scale;
        } else {
          const double s = place(a, d) == 0 ? -at.corner_scale : at.corner_scale;
          dN[a][d] = dN[a][d] * (at.corner_scale * at.corner_factor(a, xi)) + s * at.product(a, -1);
        }
      }
    }
  }
}

/// Throws: an element of the other dimension came where it cannot come, a mistake of the program.
[[noreturn]] void wrong_element(Element element, int dim);

/// Call `body` with an std::integral_constant<Element, ...> of an element of this dimension.
template <int Dim, class Body>
decltype(auto) with_element(Element element, Body&& body) {
  using enum Element;
  const auto call = [&]<Element E>() -> decltype(auto) {
    return body(std::integral_constant<Element, E>());
  };
  if constexpr (Dim == 2) {
    switch (element) {
      case T3:
        return call.template operator()<T3>();
      case T6:
        return call.template operator()<T6>();
      case Q8:
        return call.template operator()<Q8>();
      case Q9:
        return call.template operator()<Q9>();
      case Q4:
        return call.template operator()<Q4>();
      case Tet4:
      case H8:
      case H20:
      case H27:
        break;
    }
  } else {
    switch (element) {
      case Tet4:
        return call.template operator()<Tet4>();
      case H20:
        return call.template operator()<H20>();
      case H27:
        return call.template operator()<H27>();
      case H8:
        return call.template operator()<H8>();
      case T3:
      case T6:
      case Q4:
      case Q8:
      case Q9:
        break;
    }
  }
  wrong_element(element, Dim);
}

/// Natural coordinates of a node, and of the cell's middle (the mean of its corners).
template <int Dim>
Vec<Dim> node_xi(Element element, int node);
template <int Dim>
Vec<Dim> centre_xi(Element element);

/// How far xi lies outside the closed cell [natural coordinates]; at most 0 inside, NaN for NaN.
template <int Dim>
double outside_by(Element element, const Vec<Dim>& xi);
/// True in the closed cell, without tolerance; false for NaN.
template <int Dim>
bool in_closed_cell(Element element, const Vec<Dim>& xi);
/// The face to which xi is nearest, or beyond which it lies farthest.
template <int Dim>
int nearest_face(Element element, const Vec<Dim>& xi);
/// xi moved into the cell, off its faces by one rounding unit, so that every corner's shape
/// function is positive.
template <int Dim>
Vec<Dim> clamp_to_cell(Element element, const Vec<Dim>& xi);

/// A point of a cell with a weight: a quadrature over the cell, or over a part of it.
template <int Dim>
struct WeightedPoint {
  Vec<Dim> xi;
  double weight;  ///< the sum is the volume of the part in natural coordinates
};
/// Points with which the volume sum w det J is exact whatever the shape of the cell.
template <int Dim>
const std::vector<WeightedPoint<Dim>>& volume_quadrature(Element element);

/// Means of the functions of its nodes over an element with straight and parallel edges.
template <int Dim>
std::vector<double> means_of_functions(Element element);

/// One of the equal parts into which a cell is cut in natural coordinates.
template <int Dim>
struct CellPart {
  Vec<Dim> centre;
  std::vector<WeightedPoint<Dim>> quadrature;  ///< exact for the part's volume
};
/// n^Dim parts. Quadrilaterals and hexahedra: boxes, the first axis runs fastest. Simplices:
/// similar halves of squares and sixths of cubes.
template <int Dim>
std::vector<CellPart<Dim>> cut_cell(Element element, int n);

/// Gauss points in the reference code's order, for n particles per direction. Quadrilaterals and
/// hexahedra: n = 2 counter-clockwise, layer by layer; n = 3 in 2D corners, mid-sides (each
/// counter-clockwise) and centre, in 3D the last axis fastest; n = 4 in 2D the last axis fastest,
/// in 3D the same layer by layer. Triangles and tetrahedra: n = 1 the centre, n = 2 three or four
/// points.
template <int Dim>
std::vector<Vec<Dim>> gauss_points(Element element, int n);
/// The largest n that gauss_points() knows.
int most_gauss_points(Element element);

}  // namespace lahar
