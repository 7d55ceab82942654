#include "io/scenario/surface_faces.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace lahar {

namespace {

template <int Dim>
Vec<Dim> vector_of(const typename CellFace<Dim>::Point& x) {
  return Eigen::Map<const Vec<Dim>>(x.data());
}
template <int Dim>
typename CellFace<Dim>::Point point_of(const Vec<Dim>& x) {
  typename CellFace<Dim>::Point point;
  std::copy_n(x.data(), Dim, point.begin());
  return point;
}

/// The nodes of a face of a cell, ascending.
template <int Dim>
std::array<Index, most_face_corners> nodes_of_face(const ElementInfo& element,
                                                   const CellNodes<Dim>& nodes, int face) {
  std::array<Index, most_face_corners> found;
  found.fill(-1);
  for (std::size_t c = 0; c < most_face_corners; ++c)
    if (const int corner = element.face[static_cast<std::size_t>(face)][c]; corner >= 0)
      found[c] = nodes.id[static_cast<std::size_t>(corner)];
  std::sort(found.begin(), found.end());
  return found;
}

/// All pieces of a face, small and alike, one after the other.
template <int Dim>
void cut_into_pieces(const CellFace<Dim>& face, auto&& visit) {
  const Vec<Dim> a = vector_of<Dim>(face.x[0]), b = vector_of<Dim>(face.x[1]);
  const auto outward = [&](const Vec<Dim>& x, Vec<Dim> area) {
    if (area.dot(x - vector_of<Dim>(face.centre)) < 0) area = -area;
    visit(FacePiece<Dim>{x, area});
  };
  if constexpr (Dim == 2) {
    constexpr int pieces = 64;
    const Vec<2> along = (b - a) / pieces;
    for (int i = 0; i < pieces; ++i) outward(a + (i + 0.5) * along, {along.y(), -along.x()});
  } else if (face.corners == 3) {
    constexpr int pieces = 12;  // along an edge
    const Vec<3> u = (b - a) / pieces, v = (vector_of<3>(face.x[2]) - a) / pieces;
    const Vec<3> area = 0.5 * u.cross(v);
    for (int j = 0; j < pieces; ++j)
      for (int i = 0; i + j < pieces; ++i) {
        constexpr double third = 1.0 / 3;
        outward(a + (i + third) * u + (j + third) * v, area);
        if (i + j + 1 < pieces) outward(a + (i + 2 * third) * u + (j + 2 * third) * v, area);
      }
  } else {
    constexpr int pieces = 12;  // along an edge
    const Vec<3> c = vector_of<3>(face.x[2]), d = vector_of<3>(face.x[3]);
    for (int j = 0; j < pieces; ++j)
      for (int i = 0; i < pieces; ++i) {
        const double s = (i + 0.5) / pieces, t = (j + 0.5) / pieces;
        const Vec<3> along_s = (1 - t) * (b - a) + t * (c - d),
                     along_t = (1 - s) * (d - a) + s * (c - b);
        outward((1 - s) * ((1 - t) * a + t * d) + s * ((1 - t) * b + t * c),
                along_s.cross(along_t) / (pieces * pieces));
      }
  }
}

}  // namespace

template <int Dim>
CellFace<Dim> face_of(const Mesh<Dim>& mesh, Index cell, int face) {
  const ElementInfo& element = info(mesh.element());
  const ElementGeometry<Dim> geometry = mesh.element_geometry(cell);
  CellFace<Dim> made{.nodes = nodes_of_face<Dim>(element, mesh.element_nodes(cell), face),
                     .cell = cell,
                     .corners = 0,
                     .x = {},
                     .centre = point_of<Dim>(mesh.cell_centre(cell))};
  for (const int corner : element.face[static_cast<std::size_t>(face)])
    if (corner >= 0)
      made.x[static_cast<std::size_t>(made.corners++)] =
          point_of<Dim>(geometry.X[static_cast<std::size_t>(corner)]);
  return made;
}

template <int Dim>
FacePiece<Dim> whole_face(const CellFace<Dim>& face) {
  FacePiece<Dim> whole{Vec<Dim>::Zero(), Vec<Dim>::Zero()};
  for (int k = 0; k < face.corners; ++k)
    whole.x += vector_of<Dim>(face.x[static_cast<std::size_t>(k)]) / face.corners;
  cut_into_pieces(face, [&](const FacePiece<Dim>& piece) { whole.area += piece.area; });
  return whole;
}

template <int Dim>
std::vector<CellFace<Dim>> faces_of_surface(const Mesh<Dim>& mesh, std::span<const Index> cells,
                                            std::span<const Index> filled, const Team& team) {
  const ElementInfo& element = info(mesh.element());
  std::vector<CellFace<Dim>> own;
  for (const Index cell : cells)
    for (int face = 0; face < element.faces; ++face) own.push_back(face_of(mesh, cell, face));
  std::vector<CellFace<Dim>> all = joined(team.gather(own));
  const auto key = [](const CellFace<Dim>& face) { return std::tie(face.nodes, face.cell); };
  std::sort(all.begin(), all.end(),
            [&](const auto& one, const auto& other) { return key(one) < key(other); });
  all.erase(std::unique(all.begin(), all.end(),
                        [&](const auto& one, const auto& other) { return key(one) == key(other); }),
            all.end());
  std::vector<double> covered(all.size(), 0.0);
  for (const Index cell : filled)
    for (int face = 0; face < element.faces; ++face) {
      const auto nodes = nodes_of_face<Dim>(element, mesh.element_nodes(cell), face);
      auto at = std::lower_bound(all.begin(), all.end(), nodes,
                                 [](const auto& one, const auto& of) { return one.nodes < of; });
      for (; at != all.end() && at->nodes == nodes; ++at)
        if (at->cell != cell) covered[static_cast<std::size_t>(at - all.begin())] = 1.0;
    }
  covered = team.most(std::move(covered));
  std::size_t k = 0;
  std::erase_if(all, [&](const auto&) { return covered[k++] != 0.0; });
  return all;
}

template <int Dim>
std::vector<SurfaceShare<Dim>> areas_of(std::span<const CellFace<Dim>> faces,
                                        std::span<const FaceParticle<Dim>> particles,
                                        const Analysis& analysis) {
  constexpr double more = 3;     // than 1, squares of distances
  constexpr double along = 0.9;  // least cosine of a face that looks along an axis
  std::vector<SurfaceShare<Dim>> shares(particles.size());
  for (const CellFace<Dim>& face : faces) {
    const auto begin = std::lower_bound(particles.begin(), particles.end(), face.cell,
                                        [](const auto& p, Index cell) { return p.cell < cell; });
    cut_into_pieces(face, [&](const FacePiece<Dim>& piece) {
      const Vec<Dim> normal = piece.area.normalized();
      double least = std::numeric_limits<double>::infinity();
      auto nearest = particles.end();
      for (auto p = begin; p != particles.end() && p->cell == face.cell; ++p) {
        const Vec<Dim> way = piece.x - vector_of<Dim>(p->x);
        const double depth = way.dot(normal), distance = way.squaredNorm() + more * depth * depth;
        if (distance >= least) continue;
        least = distance;
        nearest = p;
      }
      if (nearest == particles.end()) return;
      SurfaceShare<Dim>& of = shares[static_cast<std::size_t>(nearest - particles.begin())];
      for (int d = 0; d < Dim; ++d) {
        of.seen[static_cast<std::size_t>(2 * d + (piece.area[d] > 0 ? 1 : 0))] +=
            std::abs(piece.area[d]) * depth_at(analysis, piece.x[0]);
        if (std::abs(normal[d]) > along) of.across[static_cast<std::size_t>(d)] = true;
      }
    });
  }
  return shares;
}

template <int Dim>
std::array<double, static_cast<std::size_t>(Dim)> edges_with(
    const std::array<double, static_cast<std::size_t>(Dim)>& areas) {
  if constexpr (Dim == 2)
    return {areas[1], areas[0]};
  else
    return {std::sqrt(areas[1] * areas[2] / areas[0]), std::sqrt(areas[2] * areas[0] / areas[1]),
            std::sqrt(areas[0] * areas[1] / areas[2])};
}

template CellFace<2> face_of<2>(const Mesh<2>&, Index, int);
template CellFace<3> face_of<3>(const Mesh<3>&, Index, int);
template FacePiece<2> whole_face<2>(const CellFace<2>&);
template FacePiece<3> whole_face<3>(const CellFace<3>&);
template std::vector<CellFace<2>> faces_of_surface<2>(const Mesh<2>&, std::span<const Index>,
                                                      std::span<const Index>, const Team&);
template std::vector<CellFace<3>> faces_of_surface<3>(const Mesh<3>&, std::span<const Index>,
                                                      std::span<const Index>, const Team&);
template std::vector<SurfaceShare<2>> areas_of<2>(std::span<const CellFace<2>>,
                                                  std::span<const FaceParticle<2>>,
                                                  const Analysis&);
template std::vector<SurfaceShare<3>> areas_of<3>(std::span<const CellFace<3>>,
                                                  std::span<const FaceParticle<3>>,
                                                  const Analysis&);
template std::array<double, 2> edges_with<2>(const std::array<double, 2>&);
template std::array<double, 3> edges_with<3>(const std::array<double, 3>&);

}  // namespace lahar
