#include "io/particles_generator.h"

#include <tsl/robin_map.h>

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>

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

// Abscissae of the Gauss-Legendre rule on [-1, 1], ascending.
std::vector<double> gauss_abscissae(int n) {
  switch (n) {
    case 1:
      return {0.0};
    case 2:
      return {-1.0 / std::sqrt(3.0), 1.0 / std::sqrt(3.0)};
    case 3:
      return {-std::sqrt(3.0 / 5.0), 0.0, std::sqrt(3.0 / 5.0)};
    default: {
      const double inner = std::sqrt(3.0 / 7.0 - 2.0 / 7.0 * std::sqrt(6.0 / 5.0));
      const double outer = std::sqrt(3.0 / 7.0 + 2.0 / 7.0 * std::sqrt(6.0 / 5.0));
      return {-outer, -inner, inner, outer};
    }
  }
}

// All tuples of n values; `last_fastest` says which axis runs fastest.
template <int Dim>
std::vector<Vec<Dim>> tensor_points(const std::vector<double>& a, bool last_fastest) {
  const int n = static_cast<int>(a.size());
  int total = 1;
  for (int d = 0; d < Dim; ++d) total *= n;
  std::vector<Vec<Dim>> points(static_cast<std::size_t>(total));
  for (int p = 0; p < total; ++p)
    for (int d = 0, rest = p; d < Dim; ++d, rest /= n)
      points[static_cast<std::size_t>(p)][last_fastest ? Dim - 1 - d : d] =
          a[static_cast<std::size_t>(rest % n)];
  return points;
}

}  // namespace

template <int Dim>
std::vector<Vec<Dim>> gauss_points(int n) {
  const auto a = gauss_abscissae(n);
  std::vector<Vec<Dim>> points;
  if (n == 2) {
    for (int k = 0; k < corners<Dim>; ++k) points.push_back(corner_xi<Dim>(k) * a[1]);
    return points;
  }
  if constexpr (Dim == 2) {
    if (n == 3) {
      for (int k = 0; k < 4; ++k) points.push_back(corner_xi<2>(k) * a[2]);
      for (int k = 0; k < 4; ++k)
        points.push_back((corner_xi<2>(k) + corner_xi<2>((k + 1) % 4)) * (0.5 * a[2]));
      points.push_back(Vec<2>::Zero());
      return points;
    }
  }
  return tensor_points<Dim>(a, true);
}

template <int Dim>
Vec<Dim> cell_point(const Mesh<Dim>& mesh, Index cell, const Vec<Dim>& xi) {
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
NewParticles<Dim> fill_cells(const Mesh<Dim>& mesh, const std::vector<Index>& cells, int n) {
  const auto points = gauss_points<Dim>(n);
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

}  // namespace

template <int Dim>
NewParticles<Dim> fill_region(const Mesh<Dim>& mesh, const Region<Dim>& region, int n) {
  std::vector<double> centres;
  for (int i = 0; i < n; ++i) centres.push_back(-1 + (2.0 * i + 1) / n);
  const auto points = tensor_points<Dim>(centres, false);
  const double share = std::pow(1.0 / n, Dim);
  NewParticles<Dim> out;
  for_cells_near(mesh, region, [&](Index cell) {
    const auto geometry = mesh.geometry(cell);
    const CellMap<Dim> map{geometry.corner};
    for (const auto& xi : points) {
      Vec<Dim> x = geometry.centre;
      if (geometry.cartesian)
        x += 0.5 * geometry.length.cwiseProduct(xi);
      else
        x = map.point(xi);
      if (!region.contains(x)) continue;
      out.x.push_back(x);
      out.cell.push_back(cell);
      out.volume.push_back(geometry.cartesian ? geometry.length.prod() * share
                                              : map.volume(xi, 1.0 / n));
    }
  });
  return out;
}

template <int Dim>
std::vector<Index> place(const Mesh<Dim>& mesh, const std::vector<Index>& suggested,
                         ParticleTable<Dim>& particles) {
  std::vector<Index> outside;
  for (std::size_t p = 0; p < particles.x.size(); ++p) {
    Index& cell = particles.cell[p];
    if (cell >= 0) continue;
    const auto& x = particles.x[p];
    if (!suggested.empty() && suggested[p] >= 0 && mesh.natural_coordinates(suggested[p], x))
      cell = suggested[p];
    else
      cell = mesh.locate(x).cell;
    if (cell < 0) outside.push_back(static_cast<Index>(p));
  }
  return outside;
}

template <int Dim>
void share_volumes(const Mesh<Dim>& mesh, ParticleTable<Dim>& particles) {
  auto& volume = particles.volume;
  if (std::find(volume.begin(), volume.end(), 0.0) == volume.end()) return;
  tsl::robin_map<Index, std::int32_t> count;
  // Particles of a cell usually follow each other, so it is looked up once.
  const auto& cells = particles.cell;
  for (std::size_t begin = 0, end; begin < cells.size(); begin = end) {
    end = begin + 1;
    while (end < cells.size() && cells[end] == cells[begin]) ++end;
    count[cells[begin]] += static_cast<std::int32_t>(end - begin);
  }
  Index last = -1;
  double share = 0;
  for (std::size_t p = 0; p < cells.size(); ++p) {
    if (volume[p] != 0 || cells[p] < 0) continue;
    if (cells[p] != last) share = mesh.cell_volume(cells[p]) / count[cells[p]];
    last = cells[p];
    volume[p] = share;
  }
}

template <int Dim>
std::pair<Index, Index> find_coincident(const std::vector<Vec<Dim>>& points) {
  // First point of each place, by a hash of the coordinates' bits; -1 = free.
  std::vector<Index> first(std::bit_ceil(points.size() + points.size() / 2 + 2), -1);
  const std::size_t mask = first.size() - 1;
  std::pair<Index, Index> found{-1, -1};
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint64_t h = 0;
    for (int d = 0; d < Dim; ++d) {
      h ^= std::bit_cast<std::uint64_t>(points[i][d] + 0.0);  // + 0.0: -0 and 0 are the same place
      h *= 0x9E3779B97F4A7C15u;
      h ^= h >> 29;
    }
    std::size_t slot = h >> std::countl_zero(mask);  // the upper bits depend on all others
    const auto at = [&] { return static_cast<std::size_t>(first[slot]); };
    while (first[slot] >= 0 && points[at()] != points[i]) slot = (slot + 1) & mask;
    if (first[slot] < 0)
      first[slot] = static_cast<Index>(i);
    else if (found.first < 0 || first[slot] < found.first)
      found = {first[slot], static_cast<Index>(i)};
  }
  return found;
}

#define LAHAR_INSTANTIATE(Dim)                                                                  \
  template std::vector<Vec<Dim>> gauss_points<Dim>(int);                                        \
  template Vec<Dim> cell_point<Dim>(const Mesh<Dim>&, Index, const Vec<Dim>&);                  \
  template NewParticles<Dim> fill_cells<Dim>(const Mesh<Dim>&, const std::vector<Index>&, int); \
  template NewParticles<Dim> fill_region<Dim>(const Mesh<Dim>&, const Region<Dim>&, int);       \
  template std::vector<Index> place<Dim>(const Mesh<Dim>&, const std::vector<Index>&,           \
                                         ParticleTable<Dim>&);                                  \
  template void share_volumes<Dim>(const Mesh<Dim>&, ParticleTable<Dim>&);                      \
  template std::pair<Index, Index> find_coincident<Dim>(const std::vector<Vec<Dim>>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
