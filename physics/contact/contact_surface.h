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
/// separating axis theorem; Nairn, Hammerquist & Smith 2020 find n by logistic regression). With
/// the near particles alone, a plane would seem to end along every n, and edges that are pressed
/// into it would meet it askew. A maximum depends neither on the order of particles nor on that of
/// patches.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// A normal that some bodies at a node have in common.
template <int Dim>
struct SurfaceDirection {
  Vec<Dim> normal;  ///< points out of body `from`
  int from = 0;
  int to = -1;  ///< into this body; -1 = any other
};

/// The directions at a node, at most as many as a vector of sums has places: normals of the bodies,
/// then what they make two at a time, where there is room.
template <int Dim>
struct SurfaceDirections {
  std::array<SurfaceDirection<Dim>, node_width> of;
  int count = 0;
};

/// Directions at a node of the first body, from Patch::gradient.
template <int Dim>
SurfaceDirections<Dim> surface_directions(const Patch<Dim>& patch, Local node);

/// Make sum_p V_p grad N of the nodes the normals of their bodies, and mark those between bodies.
template <int Dim>
void set_normals(Patch<Dim>& patch);

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

/// Add the meetings at a node of the first body: `ends` are, by body, the maxima over all patches.
template <int Dim>
void add_meetings(Patch<Dim>& patch, Local node, std::span<const SurfaceEnds> ends, double offset);

#define LAHAR_EXTERN(Dim)                                                               \
  extern template SurfaceDirections<Dim> surface_directions(const Patch<Dim>&, Local);  \
  extern template void set_normals(Patch<Dim>&);                                        \
  extern template void map_surface(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  extern template double surface_offset(const Model<Dim>&);                             \
  extern template void add_meetings(Patch<Dim>&, Local, std::span<const SurfaceEnds>, double);
LAHAR_EXTERN(2)
LAHAR_EXTERN(3)
#undef LAHAR_EXTERN

}  // namespace lahar
