/// \file Contact of bodies: each has velocities of its own at the nodes (fields), which meet where
/// bodies share a node.
///
/// Nodes and cells of a patch are there once for each body (repeat_for_bodies), so that all kernels
/// work on the fields of bodies as they do on one. A particle's body is its material's. Only the
/// integration of the nodes couples fields.
#pragma once

#include "physics/patch.h"

namespace lahar {

/// Give each body nodes and cells of its own: those of body b come after those of all before it, in
/// the same order. Ids of cells repeat; a node's id grows by `mesh_nodes` from body to body, so
/// that ids remain unique and ascending.
template <int Dim>
void repeat_for_bodies(PatchTopology<Dim>& topology, int bodies, Index mesh_nodes);

/// One body at a node.
template <int Dim>
struct BodyAtNode {
  double mass;                          ///< [kg]
  Eigen::Map<const Vec<Dim>> velocity;  ///< [m/s]
  Eigen::Map<const Vec<Dim>> gradient;  ///< sum_p V_p grad N_i [m^2], points out of the body
};

/// Impulse [N s] that b gets from a, and a with the other sign. Nothing unless they approach along
/// the normal n, that of the body with the larger gradient (of two equal ones, a's): at edges of
/// one body the surface of the other counts. Then what makes their normal velocities equal, and
/// along the surface what makes them stick, but at most `friction` times the normal impulse
/// (Bardenhagen et al. 2001).
template <int Dim>
Vec<Dim> contact_impulse(const BodyAtNode<Dim>& a, const BodyAtNode<Dim>& b, double friction);

/// Contact at all nodes that several bodies share, on velocities and accelerations at the end of
/// the step, and its work. Impulses act on two bodies at a time, ascending, so that the momentum of
/// all is kept to rounding; where there are more than two bodies all pairs are gone through several
/// times (contact_sweeps). `gravity` [m/s^2] is that of the step.
template <int Dim>
void apply_contact(Patch<Dim>& patch, const StepContext<Dim>& step, const Vec<Dim>& gravity);

inline constexpr int contact_sweeps = 4;

#define LAHAR_EXTERN(Dim)                                                                  \
  extern template void repeat_for_bodies(PatchTopology<Dim>&, int, Index);                 \
  extern template Vec<Dim> contact_impulse(const BodyAtNode<Dim>&, const BodyAtNode<Dim>&, \
                                           double);                                        \
  extern template void apply_contact(Patch<Dim>&, const StepContext<Dim>&, const Vec<Dim>&);
LAHAR_EXTERN(2)
LAHAR_EXTERN(3)
#undef LAHAR_EXTERN

}  // namespace lahar
