/// \file Cells of many points: cell by cell, packs of points that are in its bounding box.
#include "physics/mesh/locate_all.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "physics/base/pack_bits.h"
#include "physics/mesh/cell_polynomial.h"
#include "physics/mesh/inverse_mapping.h"

namespace lahar {

namespace {

/// With fewer points per cell of the mesh than this, each is looked for by itself.
constexpr double least_points_per_cell = 0.1;

/// Points by the bins of a uniform grid, one bin after the other; the first axis is the fastest.
template <int Dim>
class BinnedPoints {
 public:
  /// Takes the points whose cell is negative. `bins`: about how many.
  BinnedPoints(std::span<const Vec<Dim>> x, std::span<const Index> cell, const Vec<Dim>& low,
               const Vec<Dim>& high, double bins)
      : low_(low) {
    const Vec<Dim> extent = high - low;
    const Vec<Dim> wanted = bins_along(extent, bins);
    std::size_t n_bins = 1;
    for (int d = 0; d < Dim; ++d) {
      counts_[d] = std::max<Index>(1, std::lround(wanted[d]));
      per_metre_[d] = static_cast<double>(counts_[d]) / extent[d];
      n_bins *= static_cast<std::size_t>(counts_[d]);
    }
    std::vector<Index> bin(x.size(), -1);
    first_.assign(n_bins + 1, 0);
    for (std::size_t p = 0; p < x.size(); ++p)
      if (cell[p] < 0) ++first_[static_cast<std::size_t>(bin[p] = bin_of(x[p])) + 1];
    for (std::size_t b = 0; b < n_bins; ++b) first_[b + 1] += first_[b];
    point.resize(first_.back());
    for (auto& row : at) row.resize(point.size() + lanes<Pack>);
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t p = 0; p < x.size(); ++p) {
      if (bin[p] < 0) continue;
      const std::size_t place = next[static_cast<std::size_t>(bin[p])]++;
      point[place] = p;
      for (int d = 0; d < Dim; ++d) at[static_cast<std::size_t>(d)][place] = x[p][d];
    }
  }

  /// Call visit(begin, end) for ranges of places that hold all points of a box.
  template <class Visit>
  void for_each_range(const Vec<Dim>& low, const Vec<Dim>& high, Visit visit) const {
    std::array<Index, 3> from{}, to{};
    for (int d = 0; d < Dim; ++d) {
      from[static_cast<std::size_t>(d)] = position(low, d);
      to[static_cast<std::size_t>(d)] = position(high, d);
    }
    for (Index z = from[2]; z <= to[2]; ++z)
      for (Index y = from[1]; y <= to[1]; ++y) {
        const Index row = ((Dim == 3 ? z * counts_[1] : 0) + y) * counts_[0];
        visit(first_[static_cast<std::size_t>(row + from[0])],
              first_[static_cast<std::size_t>(row + to[0]) + 1]);
      }
  }

  std::vector<std::size_t> point;           ///< number of the point at each place
  std::array<std::vector<double>, Dim> at;  ///< [m] its coordinates; a pack more can be read

 private:
  /// About `bins` cubes in a box. Where it is thinner than a cube there is one bin across, and
  /// fewer along the others: cells far from each other must not make more bins than there are
  /// cells.
  static Vec<Dim> bins_along(const Vec<Dim>& extent, double bins) {
    Vec<Dim> n = extent / std::pow(extent.prod() / bins, 1.0 / Dim);
    for (int pass = 1; pass < Dim; ++pass) {
      const double thin = n.cwiseMin(1.0).prod();  // what rounding up to one bin multiplies by
      const auto wide = (n.array() > 1.0).count();
      if (thin >= 1.0 || wide == 0) break;
      const double factor = std::pow(thin, 1.0 / static_cast<double>(wide));
      n = (n.array() > 1.0).select(n * factor, 1.0);
    }
    return n.cwiseMax(1.0).cwiseMin(std::max(bins, 1.0));
  }

  /// Beyond the grid, and for what is no number, that of a bin at its border.
  Index position(const Vec<Dim>& x, int d) const {
    const double bins = (x[d] - low_[d]) * per_metre_[d];
    return bins > 0 ? static_cast<Index>(std::min(bins, static_cast<double>(counts_[d] - 1))) : 0;
  }
  Index bin_of(const Vec<Dim>& x) const {
    Index bin = 0;
    for (int d = Dim - 1; d >= 0; --d) bin = bin * counts_[d] + position(x, d);
    return bin;
  }

  Vec<Dim> low_, per_metre_;
  std::array<Index, Dim> counts_;
  std::vector<std::size_t> first_;  ///< place of the first point of each bin
};

template <int Dim>
CellPolynomial<Dim> polynomial(const CellGeometry<Dim>& cell) {
  std::array<Local, corners<Dim>> corner;
  double position[corners<Dim>][4] = {};
  for (int a = 0; a < corners<Dim>; ++a) {
    corner[static_cast<std::size_t>(a)] = a;
    for (int d = 0; d < Dim; ++d) position[a][d] = cell.corner[static_cast<std::size_t>(a)][d];
  }
  return {position[0], corner};
}

/// Points in the bounding box of a cell.
template <int Dim>
struct NearPoints {
  std::vector<std::size_t> place;           ///< among BinnedPoints
  std::array<std::vector<double>, Dim> at;  ///< [m] coordinates, with room for a pack more

  void find(const BinnedPoints<Dim>& points, const std::vector<Index>& found,
            const CellGeometry<Dim>& cell) {
    Vec<Dim> low = cell.corner[0], high = low;
    for (const auto& corner : cell.corner) low = low.cwiseMin(corner), high = high.cwiseMax(corner);
    place.clear();
    for (auto& row : at) row.clear();
    points.for_each_range(low, high, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; k += lanes<Pack>) {
        unsigned bits = first_bits<Pack>(static_cast<Local>(end - k));
        for (std::size_t d = 0; d < Dim; ++d) {
          const Pack x = load<Pack>(&points.at[d][k]);
          const auto e = static_cast<Eigen::Index>(d);
          bits &= greater(x, Pack(low[e])) & greater(Pack(high[e]), x);
        }
        for_each_bit(bits, [&](std::size_t lane) {
          const std::size_t j = k + lane;
          if (found[j] >= 0) return;
          place.push_back(j);
          for (std::size_t d = 0; d < Dim; ++d) at[d].push_back(points.at[d][j]);
        });
      }
    });
    for (auto& row : at) row.resize(place.size() + lanes<Pack>);
  }

  /// Bits of the pack of points from k on that are inside the cell and clear of its faces: in no
  /// other cell, and by no rounding.
  unsigned inside(const CellPolynomial<Dim>& cell, std::size_t k) const {
    Pack x[Dim], xi[Dim];
    LAHAR_UNROLL
    for (std::size_t d = 0; d < Dim; ++d) {
      x[d] = load<Pack>(&at[d][k]);
      xi[d] = Pack(0.0);
    }
    const auto n = static_cast<Local>(place.size() - k);
    unsigned outside = inverse_map_pack(cell, x, xi, n);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) outside |= lahar::outside(xi[d], pack_clear_of_faces, n);
    return first_bits<Pack>(n) & ~outside;
  }
};

/// Find the points that are clear of the faces of their cells.
template <int Dim>
void locate_inside(const Mesh<Dim>& mesh, std::span<const Vec<Dim>> x, std::span<Index> cell) {
  const auto [low, high] = mesh.bounds();
  const BinnedPoints<Dim> points(x, cell, low, high, static_cast<double>(mesh.n_cells()));
  std::vector<Index> found(points.point.size(), -1);
  NearPoints<Dim> near;
  for (Index c = 0; c < mesh.n_cells(); ++c) {
    if (!mesh.holds(c)) continue;
    const auto geometry = mesh.geometry(c);
    near.find(points, found, geometry);
    if (near.place.empty()) continue;
    const auto map = polynomial<Dim>(geometry);
    for (std::size_t k = 0; k < near.place.size(); k += lanes<Pack>)
      for_each_bit(near.inside(map, k), [&](std::size_t lane) { found[near.place[k + lane]] = c; });
  }
  for (std::size_t k = 0; k < found.size(); ++k)
    if (found[k] >= 0) cell[points.point[k]] = found[k];
}

}  // namespace

template <int Dim>
void locate_all(const Mesh<Dim>& mesh, std::span<const Vec<Dim>> x, std::span<Index> cell) {
  const auto unknown =
      static_cast<double>(std::ranges::count_if(cell, [](Index c) { return c < 0; }));
  if (!mesh.is_cartesian() && mesh.element() == multilinear<Dim> &&
      unknown > least_points_per_cell * static_cast<double>(mesh.n_cells()))
    locate_inside(mesh, x, cell);
  for (std::size_t p = 0; p < x.size(); ++p)
    if (cell[p] < 0) cell[p] = mesh.locate(x[p]).cell;
}

template void locate_all<2>(const Mesh<2>&, std::span<const Vec<2>>, std::span<Index>);
template void locate_all<3>(const Mesh<3>&, std::span<const Vec<3>>, std::span<Index>);

}  // namespace lahar
