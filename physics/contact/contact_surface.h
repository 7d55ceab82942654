/// \file Where the surfaces of bodies lie that meet at a node: the direction in which they meet,
/// and the gap between them.
///
/// A body ends, along a direction n, where the outermost of its particles ends that are near the
/// line through the node along n or, if there are none, of those in all cells that the node has
/// functions in: s = max_p n.x_p + R_p(n), with R_p(n) = |(n.r_1, ... n.r_d)| the half width of the
/// ellipsoid inside of the particle's domain, whose edges are 2 r_k. Two bodies are apart by
/// g(n) = -s_b(-n) - s_a(n). Convex bodies that are apart have an n with g(n) > 0; of the normals
/// of a, of b and their mean, the one with the largest gap between all particles around is that of
/// the contact: at an edge of one body it is the normal of the other's surface (compare the
/// separating axis theorem; Nairn, Hammerquist & Smith 2020 find n by logistic regression). The
/// mean is of what is left of the two normals without the axes along which both bodies end on the
/// same side: there they lie beside each other, as at a wall of the mesh, and do not meet. With the
/// near particles alone, a plane would seem to end along every n, and edges that are pressed into
/// it would meet it askew. A maximum depends neither on the order of particles nor on that of
/// patches.
#pragma once

#include <algorithm>

#include "physics/particles/patch.h"

namespace lahar {

/// Find the nodes where several bodies have enough mass to meet (Patch::least_mass), with sums over
/// all patches that share a node. Only there does anybody ask for surfaces.
template <int Dim>
void find_nodes_between(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Whether a cell has functions at such nodes.
template <int Dim>
bool has_nodes_between(const Patch<Dim>& patch, Local cell);

/// Call some(bins) for runs of those bins whose cells have.
template <int Dim, class Some>
void for_bins_between(const Patch<Dim>& patch, ParticleBins bins, Some some) {
  if (patch.contact.nodes_between.empty()) return;
  for (std::size_t from = 0, to = 0; to <= bins.size(); ++to) {
    if (to < bins.size() && has_nodes_between(patch, bins[to].cell)) continue;
    if (to > from) some(bins.subspan(from, to - from));
    from = to + 1;
  }
}

/// The normals of bodies at nodes between them, the directions of sum_p V_p grad N with sums over
/// all patches that share a node, and the directions that they give. Surfaces (map_surface()) begin
/// at zero.
template <int Dim>
void set_directions(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Where a body ends along the directions at a node, from the node and `surface_offset()` more: 0
/// where it has no particles.
struct SurfaceEnds {
  NodeVector near;    ///< of particles near the line through the node along the direction
  NodeVector around;  ///< of all particles in cells that the node has functions in
  double at(int k) const { return near[k] > 0.0 ? near[k] : around[k]; }
};

/// Add the ends of the particles of some bins.
template <int Dim>
void map_surface(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// [m] More than any extent of a body; the same for all patches.
template <int Dim>
double surface_offset(const Model<Dim>& model);

/// Add the meetings at one of the nodes: `ends` are, by body, the maxima over all patches.
template <int Dim>
void add_meetings(Patch<Dim>& patch, const NodeBetween<Dim>& at, std::span<const SurfaceEnds> ends,
                  double offset);

#define LAHAR_EXTERN(Dim)                                                               \
  extern template void find_nodes_between(Patch<Dim>&, const StepContext<Dim>&);        \
  extern template bool has_nodes_between(const Patch<Dim>&, Local);                     \
  extern template void set_directions(Patch<Dim>&, const StepContext<Dim>&);            \
  extern template void map_surface(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  extern template double surface_offset(const Model<Dim>&);                             \
  extern template void add_meetings(Patch<Dim>&, const NodeBetween<Dim>&,               \
                                    std::span<const SurfaceEnds>, double);
LAHAR_EXTERN(2)
LAHAR_EXTERN(3)
#undef LAHAR_EXTERN

}  // namespace lahar
