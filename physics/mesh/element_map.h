/// \file The map between natural and physical coordinates of a cell of any element, and its
/// inverse.
#pragma once

#include "physics/mesh/element.h"

namespace lahar {

/// A cell by the positions of its nodes, in file order: x(xi) = sum_a N_a(xi) X_a.
template <int Dim>
struct ElementGeometry {
  Element element;
  std::array<Vec<Dim>, static_cast<std::size_t>(most_nodes<Dim>)> X;  ///< [m]

  int nodes() const { return info(element).nodes; }
  Vec<Dim> point(const Vec<Dim>& xi) const;  ///< [m]
  /// J(i, d) = dx_i / dxi_d [m].
  Eigen::Matrix<double, Dim, Dim> jacobian(const Vec<Dim>& xi) const;
  double volume() const;  ///< [m^2 per m of thickness, or m^3], exact
  /// Mean of the corners [m].
  Vec<Dim> centre() const;
  /// A box that holds the cell, also where its faces bulge beyond their nodes [m].
  std::pair<Vec<Dim>, Vec<Dim>> bounds() const;
  /// Distance between opposite faces over the order of the polynomials: about the distance between
  /// neighbouring nodes, for the time step limit [m]. The smallest height, at any node, of the
  /// parallelepiped (simplex) that the cell's edges, if they went on straight from there, span.
  double size() const;
};

/// How the search for natural coordinates ended.
enum class Mapped {
  yes,  ///< xi maps to x; if any point of the cell does, xi is in the cell
  no,   ///< no point of the cell maps to x; xi is an estimate that says in which direction x is
  undecided  ///< the cell is so distorted that neither could be shown
};

/// Natural coordinates of x, which may lie outside the cell. Simplices with straight edges: closed
/// form. Else Newton's method from the cell's middle; where it does not end in the cell, the cell
/// is cut into smaller and smaller boxes of natural coordinates. Those whose image cannot hold x,
/// because the control points of the map in Bernstein's form lie on one side of it (the image is in
/// their convex hull), are left out; in the others Newton's method starts again.
template <int Dim>
Mapped inverse_map(const ElementGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi);

/// The same by Newton's method alone: true if xi maps to x. Another point of the cell might, too,
/// where xi is outside; and where it is false.
template <int Dim>
bool quick_inverse_map(const ElementGeometry<Dim>& cell, const Vec<Dim>& x, Vec<Dim>& xi);

}  // namespace lahar
