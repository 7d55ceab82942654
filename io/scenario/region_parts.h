/// \file The parts of a cell that lie in a region: where particles begin, and the volume of each.
#pragma once

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <vector>

#include "io/scenario/regions.h"
#include "physics/mesh/mesh.h"

namespace lahar {

/// A cell by its corners, with the map from natural coordinates.
template <int Dim>
struct CellMap {
  std::array<Vec<Dim>, corners<Dim>> X;  // tensor order

  Vec<Dim> point(const Vec<Dim>& xi) const {
    Vec<Dim> x = Vec<Dim>::Zero();
    for (unsigned k = 0; k < corners<Dim>; ++k) {
      double N = 1;
      for (int d = 0; d < Dim; ++d) N *= 0.5 * ((k >> d & 1u) ? 1 + xi[d] : 1 - xi[d]);
      x += N * X[k];
    }
    return x;
  }

  double jacobian(const Vec<Dim>& xi) const {
    Eigen::Matrix<double, Dim, Dim> J = Eigen::Matrix<double, Dim, Dim>::Zero();
    for (unsigned k = 0; k < corners<Dim>; ++k)
      for (int d = 0; d < Dim; ++d) {
        double dN = (k >> d & 1u) ? 0.5 : -0.5;
        for (int e = 0; e < Dim; ++e)
          if (e != d) dN *= 0.5 * ((k >> e & 1u) ? 1 + xi[e] : 1 - xi[e]);
        J.col(d) += dN * X[k];
      }
    return J.determinant();
  }

  // Volume of the box of half-width h around xi: two Gauss points per axis are exact, because the
  // Jacobian is at most quadratic along each.
  double volume(const Vec<Dim>& xi, double h) const {
    double sum = 0;
    for (unsigned k = 0; k < corners<Dim>; ++k) {
      Vec<Dim> at = xi;
      for (int d = 0; d < Dim; ++d) at[d] += ((k >> d & 1u) ? h : -h) / std::sqrt(3.0);
      sum += jacobian(at);
    }
    return sum * std::pow(h, Dim);
  }
};

/// Centres of n^Dim equal parts of the natural coordinates of Q4 and H8; the first axis runs
/// fastest.
template <int Dim>
std::vector<Vec<Dim>> part_centres(int n);

/// Parts whose centres lie in a region, with all of their volume.
template <int Dim>
class WholeParts {
 public:
  WholeParts(const Mesh<Dim>& mesh, const Region<Dim>& region, int n)
      : mesh_(mesh), region_(region), half_(1.0 / n), share_(std::pow(1.0 / n, Dim)) {
    if (mesh.is_multilinear())
      points_ = part_centres<Dim>(n);
    else
      parts_ = cut_cell<Dim>(mesh.element(), n);
  }

  std::size_t size() const { return std::max(points_.size(), parts_.size()); }  ///< per cell
  /// Call `visit(x, volume)` for each; volume() computes it.
  void visit(Index cell, auto&& visit) const {
    if (!mesh_.is_multilinear()) return visit_parts(mesh_.element_geometry(cell), visit);
    const auto geometry = mesh_.geometry(cell);
    const CellMap<Dim> map{geometry.corner};
    for (const auto& xi : points_) {
      Vec<Dim> x = geometry.centre;
      if (geometry.cartesian)
        x += 0.5 * geometry.length.cwiseProduct(xi);
      else
        x = map.point(xi);
      if (!region_.contains(x)) continue;
      visit(x, [&] {
        return geometry.cartesian ? geometry.length.prod() * share_ : map.volume(xi, half_);
      });
    }
  }

 private:
  void visit_parts(const ElementGeometry<Dim>& cell, auto&& visit) const {
    for (const auto& part : parts_) {
      const Vec<Dim> x = cell.point(part.centre);
      if (!region_.contains(x)) continue;
      visit(x, [&] {
        double volume = 0;
        for (const auto& q : part.quadrature)
          volume += q.weight * cell.jacobian(q.xi).determinant();
        return volume;
      });
    }
  }

  const Mesh<Dim>& mesh_;
  const Region<Dim>& region_;
  double half_, share_;
  std::vector<Vec<Dim>> points_;      // of Q4 and H8
  std::vector<CellPart<Dim>> parts_;  // of other elements
};

/// Parts of Q4 and H8 with the volume of them that lies in a region, by samples where its boundary
/// cuts them. The particle is in the centroid of what lies inside. A part with little volume
/// gives it to a neighbour in the cell. A part without a neighbour keeps it.
template <int Dim>
class CutParts {
 public:
  CutParts(const Mesh<Dim>& mesh, const Region<Dim>& region, int n);

  std::size_t size() const { return points_.size(); }  ///< per cell, at most
  /// As that of WholeParts.
  void visit(Index cell, auto&& visit) const {
    for (const Part& part : parts_of(cell))
      if (part.volume > 0) visit(part.x, [&] { return part.volume; });
  }

 private:
  struct Part {
    Vec<Dim> x = Vec<Dim>::Zero();
    double volume = 0, share = 0;  ///< [m^d]; [-] of the whole part
  };
  std::vector<Part> parts_of(Index cell) const;
  using Box = std::pair<Vec<Dim>, Vec<Dim>>;
  void sample(const CellMap<Dim>& map, const Vec<Dim>& xi, const Vec<Dim>* edges, const Box& box,
              Part& part) const;
  void merge_slivers(std::vector<Part>& parts) const;

  const Mesh<Dim>& mesh_;
  const Region<Dim>& region_;
  int n_;
  double half_, share_;
  std::vector<Vec<Dim>> points_, samples_;  ///< centres of parts; in a cube from -1 to 1
};

extern template class CutParts<2>;
extern template class CutParts<3>;

}  // namespace lahar
