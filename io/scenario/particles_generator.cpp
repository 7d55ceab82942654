#include "io/scenario/particles_generator.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "physics/mesh/locate_all.h"

namespace lahar {

namespace {

// Corners in file order: counter-clockwise per layer.
template <int Dim>
Vec<Dim> corner_xi(int k) {
  constexpr int sx[] = {-1, 1, 1, -1}, sy[] = {-1, -1, 1, 1};
  Vec<Dim> xi;
  xi[0] = sx[k % 4];
  xi[1] = sy[k % 4];
  if constexpr (Dim == 3) xi[2] = k < 4 ? -1 : 1;
  return xi;
}

// All tuples of n values, the first axis runs fastest.
template <int Dim>
std::vector<Vec<Dim>> tensor_points(const std::vector<double>& a) {
  const int n = static_cast<int>(a.size());
  int total = 1;
  for (int d = 0; d < Dim; ++d) total *= n;
  std::vector<Vec<Dim>> points(static_cast<std::size_t>(total));
  for (int p = 0; p < total; ++p)
    for (int d = 0, rest = p; d < Dim; ++d, rest /= n)
      points[static_cast<std::size_t>(p)][d] = a[static_cast<std::size_t>(rest % n)];
  return points;
}

}  // namespace

template <int Dim>
Vec<Dim> cell_point(const Mesh<Dim>& mesh, Index cell, const Vec<Dim>& xi) {
  if (!mesh.is_multilinear()) return mesh.element_geometry(cell).point(xi);
  const auto nodes = mesh.cell_nodes(cell);
  Vec<Dim> x = Vec<Dim>::Zero();
  for (int k = 0; k < corners<Dim>; ++k) {
    const Vec<Dim> s = corner_xi<Dim>(k);
    double N = 1;
    for (int d = 0; d < Dim; ++d) N *= 0.5 * (1 + s[d] * xi[d]);
    x += N * mesh.node(nodes[static_cast<std::size_t>(k)]);
  }
  return x;
}

template <int Dim>
NewParticles<Dim> fill_cells(const Mesh<Dim>& mesh, std::span<const Index> cells, int n) {
  const auto points = gauss_points<Dim>(mesh.element(), n);
  NewParticles<Dim> out;
  out.x.reserve(cells.size() * points.size());
  out.cell.reserve(cells.size() * points.size());
  for (const Index cell : cells)
    for (const auto& xi : points) {
      out.x.push_back(cell_point<Dim>(mesh, cell, xi));
      out.cell.push_back(cell);
    }
  out.volume.assign(out.x.size(), 0.0);
  return out;
}

namespace {

// A cell by its corners, with the map from natural coordinates.
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

// The parts of a cell whose centres lie in a region.
template <int Dim>
class RegionParts {
 public:
  RegionParts(const Mesh<Dim>& mesh, const Region<Dim>& region, int n)
      : mesh_(mesh), region_(region), half_(1.0 / n), share_(std::pow(1.0 / n, Dim)) {
    if (!mesh.is_multilinear()) {
      parts_ = cut_cell<Dim>(mesh.element(), n);
      return;
    }
    std::vector<double> centres;
    for (int i = 0; i < n; ++i) centres.push_back(-1 + (2.0 * i + 1) / n);
    points_ = tensor_points<Dim>(centres);
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

}  // namespace

namespace {

// Particles that go to the member that has their row of all.
template <int Dim>
class RowsOnTheirWay {
 public:
  /// [first, end): this member's rows.
  RowsOnTheirWay(Index first, Index end, const Team& team)
      : first_(first),
        total_(team.sum(end - first)),
        team_(team),
        to_(static_cast<std::size_t>(team.size())) {
    const auto n = static_cast<std::size_t>(end - first);
    out_.x.resize(n);
    out_.cell.resize(n);
    out_.volume.resize(n);
  }
  void add(Index row, const Vec<Dim>& x, Index cell, double volume) {
    auto& sent = to_[static_cast<std::size_t>(team_.member(row, total_))].emplace_back();
    sent = {row, cell, volume, {}};
    std::copy_n(x.data(), Dim, sent.x.begin());
  }
  /// Collective.
  void exchange() {
    for (const auto& part : team_.exchange(to_))
      for (const Sent& sent : part) {
        const auto at = static_cast<std::size_t>(sent.row - first_);
        out_.x[at] = Vec<Dim>(sent.x.data());
        out_.cell[at] = sent.cell;
        out_.volume[at] = sent.volume;
      }
    for (auto& part : to_) part.clear();
  }
  NewParticles<Dim> take() { return std::move(out_); }

 private:
  struct Sent {
    Index row, cell;
    double volume;
    std::array<double, static_cast<std::size_t>(Dim)> x;
  };
  Index first_, total_;
  const Team& team_;
  std::vector<std::vector<Sent>> to_;
  NewParticles<Dim> out_;
};

}  // namespace

template <int Dim>
NewParticles<Dim> fill_region(const Mesh<Dim>& mesh, const Region<Dim>& region, int n,
                              const Team& team, const ParticleLimit& limit) {
  // How many particles a cell has is not known before it has been looked at. So members first count
  // those of some blocks of cells each, and then look at the blocks that have their own particles.
  constexpr Index blocks_of_member = 64;
  const RegionParts<Dim> parts(mesh, region, n);
  const CellsNear<Dim> cells(mesh, region);
  const Index blocks = team.alone() ? 1 : blocks_of_member * team.size();
  const auto block_begin = [&](Index b) {
    return cells.size() / blocks * b + cells.size() % blocks * b / blocks;
  };
  Index first = 0, end = std::numeric_limits<Index>::max();
  std::vector<Index> counts(1, 1);  // particles of each block
  const double most = static_cast<double>(limit.of_member) * team.size();
  const auto check = [&](Index count) {
    if (static_cast<double>(count) > most) limit.too_many(count);
  };
  if (team.alone() &&
      static_cast<double>(cells.size()) * static_cast<double>(parts.size()) > most) {
    Index count = 0;  // where there may be too many, they are counted before they are kept
    cells.visit(0, cells.size(), [&](Index cell) {
      parts.visit(cell, [&](const auto&, auto&&) { ++count; });
      check(count);
    });
  }
  if (!team.alone()) {
    std::vector<Index> own(blocks_of_member, 0);
    all_or_none(team, [&] {
      Index all = 0;
      for (Index b = 0; b < blocks_of_member; ++b) {
        const Index block = team.index() * blocks_of_member + b;
        Index& count = own[static_cast<std::size_t>(b)];
        cells.visit(block_begin(block), block_begin(block + 1), [&](Index cell) {
          parts.visit(cell, [&](const auto&, auto&&) { ++count, ++all; });
          check(all);
        });
      }
    });
    counts.clear();
    for (const auto& member : team.gather(own))
      counts.insert(counts.end(), member.begin(), member.end());
    const Index total = std::accumulate(counts.begin(), counts.end(), Index{0});
    check(total);
    first = team.part(total, team.index());
    end = team.part(total, team.index() + 1);
  }
  NewParticles<Dim> out;
  if (mesh.is_share()) {
    // Nobody else has this member's cells: it makes their particles and sends them, block by block.
    RowsOnTheirWay<Dim> on_their_way(first, end, team);
    const Index own = team.index() * blocks_of_member;
    Index row = std::accumulate(counts.begin(), counts.begin() + own, Index{0});
    for (Index b = own; b < own + blocks_of_member; ++b) {
      cells.visit(block_begin(b), block_begin(b + 1), [&](Index cell) {
        parts.visit(cell, [&](const Vec<Dim>& x, auto&& volume) {
          on_their_way.add(row++, x, cell, volume());
        });
      });
      on_their_way.exchange();
    }
    return on_their_way.take();
  }
  Index row = 0;
  for (Index b = 0; b < blocks; ++b) {
    const Index next = row + counts[static_cast<std::size_t>(b)];
    if (next > first && row < end)
      cells.visit(block_begin(b), block_begin(b + 1), [&](Index cell) {
        parts.visit(cell, [&](const Vec<Dim>& x, auto&& volume) {
          if (row++ < first || row > end) return;
          out.x.push_back(x);
          out.cell.push_back(cell);
          out.volume.push_back(volume());
        });
      });
    row = next;
  }
  return out;
}

template <int Dim>
std::vector<Index> place(const Mesh<Dim>& mesh, const std::vector<Index>& suggested,
                         ParticleTable<Dim>& particles) {
  for (std::size_t p = 0; p < suggested.size(); ++p)
    if (particles.cell[p] < 0 && suggested[p] >= 0 &&
        mesh.natural_coordinates(suggested[p], particles.x[p]))
      particles.cell[p] = suggested[p];
  locate_all<Dim>(mesh, particles.x, particles.cell);
  std::vector<Index> outside;
  for (std::size_t p = 0; p < particles.cell.size(); ++p)
    if (particles.cell[p] < 0) outside.push_back(static_cast<Index>(p));
  return outside;
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template Vec<Dim> cell_point<Dim>(const Mesh<Dim>&, Index, const Vec<Dim>&);               \
  template NewParticles<Dim> fill_cells<Dim>(const Mesh<Dim>&, std::span<const Index>, int); \
  template NewParticles<Dim> fill_region<Dim>(const Mesh<Dim>&, const Region<Dim>&, int,     \
                                              const Team&, const ParticleLimit&);            \
  template std::vector<Index> place<Dim>(const Mesh<Dim>&, const std::vector<Index>&,        \
                                         ParticleTable<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
