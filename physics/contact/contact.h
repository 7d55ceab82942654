/// \file Contact of bodies: each has velocities of its own at the nodes (fields), which meet where
/// bodies share a node.
///
/// Nodes and cells of a patch are there once for each body (repeat_for_bodies), so that all kernels
/// work on the fields of bodies as they do on one. A particle's body is its material's. Only the
/// integration of the nodes couples fields.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Give each body nodes and cells of its own: those of body b come after those of all before it, in
/// the same order. Ids of cells repeat; a node's id grows by `mesh_nodes` from body to body, so
/// that ids remain unique and ascending.
template <int Dim>
void repeat_for_bodies(PatchTopology<Dim>& topology, int bodies, Index mesh_nodes);

/// One body at a node.
template <int Dim>
struct BodyAtNode {
  double mass;        ///< [kg]
  Vec<Dim> velocity;  ///< [m/s]
  Eigen::Matrix<double, Dim, Dim> free =
      Eigen::Matrix<double, Dim, Dim>::Identity();  ///< takes from an impulse what constraints hold
};

/// What two bodies that meet do to each other.
template <int Dim>
struct ContactImpulse {
  Vec<Dim> impulse = Vec<Dim>::Zero();   ///< [N s] that b gets from a, and a with the other sign
  Vec<Dim> friction = Vec<Dim>::Zero();  ///< [N s] part of it that is friction
  bool pressed = false;
  bool stuck = false;  ///< nothing is left of the slip
};

/// Bodies approach each other along the normal n (from a to b) by at most `most` [m/s], which
/// closes the gap between them in the step. A faster approach is met by the normal impulse that
/// takes what exceeds it, and by friction: what makes the bodies stick, but at most `friction`
/// times the normal impulse (Bardenhagen et al. 2001, with a gap). An impulse j changes velocities
/// by F j / m, where F is BodyAtNode::free: of a direction that is held the constraint takes the
/// impulse, and velocities stay as prescribed.
template <int Dim>
ContactImpulse<Dim> contact_impulse(const BodyAtNode<Dim>& a, const BodyAtNode<Dim>& b,
                                    const Vec<Dim>& normal, double most, double friction,
                                    bool together = false);

/// Contact at all nodes where bodies meet, on velocities and accelerations at the end of the step,
/// which have their prescribed components, and its work. Impulses act on two bodies at a time,
/// ascending, so that the momentum of all is kept to rounding; where there are more than two bodies
/// all pairs are gone through several times (contact_sweeps). `gravity` [m/s^2] is that of the
/// step.
template <int Dim>
void apply_contact(Patch<Dim>& patch, const StepContext<Dim>& step, const Vec<Dim>& gravity);

/// Velocities of MUSL's second mapping, of which strains are taken, after apply_contact(): bodies
/// that were pressed together move along the normal as they then did, those that stuck together in
/// every direction. The mapping smooths what impulses did at a node, so bodies would approach or
/// part there, and strains do work that nothing pays for. The work of contact is then counted anew
/// (NodeImpulse::taken_again()).
template <int Dim>
void hold_together(Patch<Dim>& patch, const StepContext<Dim>& step);

inline constexpr int contact_sweeps = 4;

#define LAHAR_EXTERN(Dim)                                                                     \
  extern template void repeat_for_bodies(PatchTopology<Dim>&, int, Index);                    \
  extern template ContactImpulse<Dim> contact_impulse(                                        \
      const BodyAtNode<Dim>&, const BodyAtNode<Dim>&, const Vec<Dim>&, double, double, bool); \
  extern template void apply_contact(Patch<Dim>&, const StepContext<Dim>&, const Vec<Dim>&);  \
  extern template void hold_together(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_EXTERN(2)
LAHAR_EXTERN(3)
#undef LAHAR_EXTERN

}  // namespace lahar
