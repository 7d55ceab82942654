/// \file Mesh: one of two kinds behind one face, and the measures of a cell.
#include "physics/mesh/mesh.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <variant>

#include "physics/base/error.h"
#include "physics/mesh/inverse_mapping.h"
#include "physics/mesh/mesh_structured.h"
#include "physics/mesh/mesh_table.h"

namespace lahar {

template <int Dim>
struct Mesh<Dim>::Impl {
  std::variant<StructuredGrid<Dim>, CellTable<Dim>> kind;
  const StructuredGrid<Dim>& grid() const { return std::get<StructuredGrid<Dim>>(kind); }
};

namespace {

double area(const std::array<Vec<2>, 4>& X) {
  const Vec<2> a = X[3] - X[0], b = X[2] - X[1];
  return 0.5 * std::abs(a[0] * b[1] - a[1] * b[0]);
}

/// The Jacobian of a trilinear hexahedron is quadratic in each coordinate: two Gauss points per
/// axis integrate it exactly.
double hexahedron_volume(const CellGeometry<3>& g) {
  double volume = 0;
  for (int a = 0; a < 8; ++a) {
    Vec<3> xi;
    for (int d = 0; d < 3; ++d) xi[d] = corner_sign(a, d) / std::sqrt(3.0);
    volume += jacobian<3>(g, xi).determinant();
  }
  return volume;
}

/// Smallest height of the parallelogram or parallelepiped that the edges at one corner span [m]:
/// its volume over its largest face.
template <int Dim>
double smallest_height(const CellGeometry<Dim>& g, int corner) {
  Vec<Dim> xi;
  for (int d = 0; d < Dim; ++d) xi[d] = corner_sign(corner, d);
  // Columns of the Jacobian are half the edges; rows of the inverse are the faces' normals over the
  // distance between the faces.
  const Eigen::Matrix<double, Dim, Dim> edges = 2.0 * jacobian<Dim>(g, xi);
  const Eigen::Matrix<double, Dim, Dim> normals = edges.inverse();
  return 1.0 / normals.rowwise().norm().maxCoeff();
}

}  // namespace

template <int Dim>
Mesh<Dim>::Mesh(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
template <int Dim>
Mesh<Dim>::Mesh(Mesh&&) noexcept = default;
template <int Dim>
Mesh<Dim>& Mesh<Dim>::operator=(Mesh&&) noexcept = default;
template <int Dim>
Mesh<Dim>::~Mesh() = default;

template <int Dim>
Mesh<Dim> Mesh<Dim>::structured(const Point& origin, const Point& cell_size,
                                const std::array<Index, Dim>& counts) {
  return Mesh(std::make_unique<Impl>(Impl{StructuredGrid<Dim>(origin, cell_size, counts)}));
}

template <int Dim>
Mesh<Dim> Mesh<Dim>::from_tables(std::vector<Point> nodes, std::vector<Corners> cells,
                                 bool isoparametric) {
  const Index* ids = cells.empty() ? nullptr : cells.front().data();
  return from_tables(std::move(nodes), multilinear<Dim>,
                     std::span<const Index>(ids, cells.size() * corners<Dim>), isoparametric);
}

template <int Dim>
Mesh<Dim> Mesh<Dim>::from_tables(std::vector<Point> nodes, Element element,
                                 std::span<const Index> cells, bool isoparametric) {
  return Mesh(std::make_unique<Impl>(
      Impl{CellTable<Dim>(std::move(nodes), element, cells, isoparametric)}));
}

template <int Dim>
Mesh<Dim> Mesh<Dim>::share(TablePiece<Dim> own, Element element, Index n_nodes, Index n_cells,
                           bool isoparametric) {
  return Mesh(std::make_unique<Impl>(
      Impl{CellTable<Dim>(std::move(own), element, n_nodes, n_cells, isoparametric)}));
}

template <int Dim>
void Mesh<Dim>::add_to(CellSums<Dim>& sums) const {
  std::get<CellTable<Dim>>(impl_->kind).add_to(sums);
}

template <int Dim>
void Mesh<Dim>::complete(const CellSums<Dim>& sums) {
  std::get<CellTable<Dim>>(impl_->kind).complete(sums);
}

template <int Dim>
Mesh<Dim> Mesh<Dim>::share(std::span<const Index> cells,
                           std::vector<std::vector<std::byte>> pieces) const {
  return Mesh(std::make_unique<Impl>(
      Impl{std::get<CellTable<Dim>>(impl_->kind).part(cells, std::move(pieces), false)}));
}

template <int Dim>
bool Mesh<Dim>::is_share() const {
  const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind);
  return table && table->is_share();
}

template <int Dim>
Vec<Dim> Mesh<Dim>::mean_cell() const {
  return std::get<CellTable<Dim>>(impl_->kind).mean_cell();
}

template <int Dim>
Index Mesh<Dim>::n_bins() const {
  return std::get<CellTable<Dim>>(impl_->kind).n_bins();
}

template <int Dim>
Index Mesh<Dim>::bin_of(const Point& x) const {
  return std::get<CellTable<Dim>>(impl_->kind).bin_of(x);
}

template <int Dim>
std::vector<Index> Mesh<Dim>::bins_of(Index cell) const {
  return std::get<CellTable<Dim>>(impl_->kind).bins_of(cell);
}

template <int Dim>
std::vector<Index> Mesh<Dim>::bins_near(std::span<const Index> cells) const {
  return std::get<CellTable<Dim>>(impl_->kind).bins_near(cells);
}

template <int Dim>
Mesh<Dim> Mesh<Dim>::part(std::span<const Index> cells,
                          std::vector<std::vector<std::byte>> pieces) const {
  const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind);
  if (!table) return Mesh(std::make_unique<Impl>(*impl_));
  return Mesh(std::make_unique<Impl>(Impl{table->part(cells, std::move(pieces), true)}));
}

template <int Dim>
std::vector<std::byte> Mesh<Dim>::pack(std::span<const Index> cells) const {
  const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind);
  return table ? table->pack(cells) : std::vector<std::byte>();
}

template <int Dim>
bool Mesh<Dim>::holds(Index cell) const {
  const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind);
  return table ? table->holds(cell) : cell >= 0 && cell < n_cells();
}

template <int Dim>
std::size_t Mesh<Dim>::bytes() const {
  const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind);
  return table ? table->bytes() : 0;
}

template <int Dim>
bool Mesh<Dim>::is_near(const Point& x, Index cell) const {
  const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind);
  return !table || table->is_near(x, cell);
}

template <int Dim>
std::vector<Index> Mesh<Dim>::widened(std::span<const Index> cells, int layers) const {
  return std::get<CellTable<Dim>>(impl_->kind).widened(cells, layers);
}

template <int Dim>
std::vector<Index> Mesh<Dim>::cells_near(std::span<const Index> cells) const {
  return std::get<CellTable<Dim>>(impl_->kind).cells_near(cells);
}

template <int Dim>
bool Mesh<Dim>::is_structured() const {
  return std::holds_alternative<StructuredGrid<Dim>>(impl_->kind);
}

template <int Dim>
Index Mesh<Dim>::n_nodes() const {
  return std::visit([](const auto& m) { return m.n_nodes(); }, impl_->kind);
}
template <int Dim>
Index Mesh<Dim>::n_cells() const {
  return std::visit([](const auto& m) { return m.n_cells(); }, impl_->kind);
}
template <int Dim>
Element Mesh<Dim>::element() const {
  const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind);
  return table ? table->element() : multilinear<Dim>;
}
template <int Dim>
bool Mesh<Dim>::is_cartesian() const {
  return std::visit([](const auto& m) { return m.is_cartesian(); }, impl_->kind);
}
template <int Dim>
Vec<Dim> Mesh<Dim>::node(Index id) const {
  return std::visit([&](const auto& m) { return m.node(id); }, impl_->kind);
}
template <int Dim>
typename Mesh<Dim>::Corners Mesh<Dim>::cell_nodes(Index cell) const {
  return std::visit([&](const auto& m) { return m.cell_nodes(cell); }, impl_->kind);
}
template <int Dim>
typename Mesh<Dim>::Corners Mesh<Dim>::cell_nodes_tensor(Index cell) const {
  return std::visit([&](const auto& m) { return m.cell_nodes_tensor(cell); }, impl_->kind);
}
template <int Dim>
CellGeometry<Dim> Mesh<Dim>::geometry(Index cell) const {
  return std::visit([&](const auto& m) { return m.geometry(cell); }, impl_->kind);
}
template <int Dim>
CellNodes<Dim> Mesh<Dim>::element_nodes(Index cell) const {
  if (const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind))
    return table->element_nodes(cell);
  CellNodes<Dim> nodes{{}, corners<Dim>};
  std::ranges::copy(cell_nodes(cell), nodes.id.begin());
  return nodes;
}
template <int Dim>
ElementGeometry<Dim> Mesh<Dim>::element_geometry(Index cell) const {
  ElementGeometry<Dim> geometry{element(), {}};
  const CellNodes<Dim> nodes = element_nodes(cell);
  for (int a = 0; a < nodes.count; ++a) geometry.X[a] = node(nodes.id[a]);
  return geometry;
}
template <int Dim>
Vec<Dim> Mesh<Dim>::cell_centre(Index cell) const {
  return is_multilinear() ? geometry(cell).centre : element_geometry(cell).centre();
}
template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> Mesh<Dim>::cell_bounds(Index cell) const {
  if (const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind)) return table->bounds(cell);
  const CellGeometry<Dim> g = geometry(cell);
  return {g.corner.front(), g.corner.back()};
}
template <int Dim>
std::pair<Vec<Dim>, Vec<Dim>> Mesh<Dim>::bounds() const {
  return std::visit([](const auto& m) { return m.bounds(); }, impl_->kind);
}
template <int Dim>
typename Mesh<Dim>::Found Mesh<Dim>::locate(const Point& x) const {
  return std::visit([&](const auto& m) { return m.locate(x); }, impl_->kind);
}
template <int Dim>
typename Mesh<Dim>::Found Mesh<Dim>::locate_from(const Point& x, Index cell) const {
  return std::visit([&](const auto& m) { return m.locate_from(x, cell); }, impl_->kind);
}
template <int Dim>
std::vector<Index> Mesh<Dim>::neighbours(Index cell) const {
  return std::visit([&](const auto& m) { return m.neighbours(cell); }, impl_->kind);
}
template <int Dim>
std::vector<Index> Mesh<Dim>::node_cells(Index node) const {
  return std::visit([&](const auto& m) { return m.node_cells(node); }, impl_->kind);
}

template <int Dim>
std::optional<Vec<Dim>> Mesh<Dim>::natural_coordinates(Index cell, const Point& x) const {
  if (const auto* table = std::get_if<CellTable<Dim>>(&impl_->kind))
    return table->natural_coordinates(cell, x);
  Point xi;
  inverse_map<Dim>(geometry(cell), x, xi);
  if (!in_closed_cell<Dim>(xi)) return std::nullopt;
  return clamp_to_cell<Dim>(xi);
}

/// Cartesian: the product of the edges. Isoparametric quadrilateral: half the cross product of its
/// diagonals; hexahedron: the exact volume under its trilinear map; other elements: likewise exact.
template <int Dim>
double Mesh<Dim>::cell_volume(Index cell) const {
  if (!is_multilinear()) return element_geometry(cell).volume();
  const CellGeometry<Dim> g = geometry(cell);
  if (g.cartesian) return g.length.prod();
  if constexpr (Dim == 2) {
    return area(g.corner);
  } else {
    return hexahedron_volume(g);
  }
}

/// Cartesian: the shortest edge. Isoparametric: at each corner the edges that meet there span a
/// parallelogram (parallelepiped), whose smallest height is the distance between two opposite
/// faces; the smallest of these over the corners. It is exact for a parallelepiped, equals the
/// shortest edge of a box, and tends to zero as a cell degenerates, so that a time step bound made
/// from it does too.
template <int Dim>
double Mesh<Dim>::cell_size(Index cell) const {
  if (!is_multilinear()) return element_geometry(cell).size();
  const CellGeometry<Dim> g = geometry(cell);
  if (g.cartesian) return g.length.minCoeff();
  double size = smallest_height<Dim>(g, 0);
  for (int a = 1; a < corners<Dim>; ++a) size = std::min(size, smallest_height<Dim>(g, a));
  return size;
}

template <int Dim>
std::array<Index, Dim> Mesh<Dim>::counts() const {
  return impl_->grid().counts;
}
template <int Dim>
Vec<Dim> Mesh<Dim>::origin() const {
  return impl_->grid().origin;
}
template <int Dim>
Vec<Dim> Mesh<Dim>::spacing() const {
  return impl_->grid().spacing;
}

template class Mesh<2>;
template class Mesh<3>;

}  // namespace lahar
