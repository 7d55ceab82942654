/// \file Where material ends in meshes whose cells are no boxes of a grid: the faces of its cells
/// that have none on their other side, and the parts of them that belong to loaded particles.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "io/base/team.h"
#include "physics/mesh/mesh.h"
#include "physics/model/model.h"

namespace lahar {

/// A face of a cell with material, by its corners.
template <int Dim>
struct CellFace {
  using Point = std::array<double, static_cast<std::size_t>(Dim)>;

  std::array<Index, most_face_corners> nodes;  ///< ascending; -1 where there are less
  Index cell;
  int corners;
  std::array<Point, most_face_corners> x;  ///< [m] around the face
  Point centre;                            ///< [m] of the cell
};

/// A face of a cell that `mesh` holds, as ElementInfo::face counts them.
template <int Dim>
CellFace<Dim> face_of(const Mesh<Dim>& mesh, Index cell, int face);

/// A face, or a piece of one: its middle, and its area times its normal, which points out of the
/// cell.
template <int Dim>
struct FacePiece {
  Vec<Dim> x, area;  ///< [m], [m^2; m per m of depth]
};
template <int Dim>
FacePiece<Dim> whole_face(const CellFace<Dim>& face);

/// The faces of `cells` that have no cell of `filled` on their other side. `cells` and `filled` are
/// this member's, ascending, and `mesh` holds them. All members get the faces of all members, in
/// the order of their nodes. Collective.
template <int Dim>
std::vector<CellFace<Dim>> faces_of_surface(const Mesh<Dim>& mesh, std::span<const Index> cells,
                                            std::span<const Index> filled, const Team& team);

/// A particle in a cell with such a face.
template <int Dim>
struct FaceParticle {
  Index cell, id;
  std::array<double, static_cast<std::size_t>(Dim)> x;  ///< [m]
  double volume;                                        ///< [m^3]
  bool loaded;
};

/// Areas [m^2; m per m of depth, of rings the whole one] as seen along each axis d: of faces that
/// look down the axis at 2 d, up the axis at 2 d + 1.
template <int Dim>
using SeenAreas = std::array<double, static_cast<std::size_t>(2 * Dim)>;

/// What of the faces belongs to a particle.
template <int Dim>
struct SurfaceShare {
  SeenAreas<Dim> seen{};
  std::array<bool, static_cast<std::size_t>(Dim)> across{};  ///< some face looks along the axis
};

/// The part of the faces that is nearer to each particle than to others of its cell. Depth counts
/// more than the distance along the face: the particles at a surface have it. `particles` are in
/// the order of their cells.
template <int Dim>
std::vector<SurfaceShare<Dim>> areas_of(std::span<const CellFace<Dim>> faces,
                                        std::span<const FaceParticle<Dim>> particles,
                                        const Analysis& analysis);

/// Edges of a particle whose faces across each axis have these areas [m].
template <int Dim>
std::array<double, static_cast<std::size_t>(Dim)> edges_with(
    const std::array<double, static_cast<std::size_t>(Dim)>& areas);

}  // namespace lahar
