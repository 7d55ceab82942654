/// \file Contact of particles with rigid bodies inside of the mesh: terrain, obstacles, tools.
///
/// A particle is a ball. It touches a body where its centre is nearer to the surface than its reach
/// r: half of the edge of its volume at the start, or its distance at the start if that is less. So
/// nothing is pushed at the start. With the gap g = distance - r < 0, the unit normal n out of the
/// body, and the velocity w of the particle relative to the body:
///
///     N = max(0, -k g - c w.n)                     k = 4 M V / h^2,  c = 2 zeta sqrt(k m)
///     T = (1 - n n^T) (T - k dt w),  S = T - (1 - n n^T) c w,  |T|, |S| <= mu N + cohesion V^(1 -
///     1/Dim) f_i += sum_p N_ip (N n + S)_p
///
/// M is the longitudinal modulus of the material at the start, V and m the volume and mass of the
/// particle, h the size of the cell. The stiffness k is that of the cell itself, so that contact
/// hardly limits the time step, and a pressure p lets bodies approach by p/M of half a cell or so.
/// T is an elastic force, as in the discrete element method (Cundall and Strack 1979): what sticks
/// does not creep. Forces of contact lie in the column `contact_force`, are mapped to nodes as
/// tractions are, and act with the opposite sign on the body: momentum is kept.
///
/// Energy: work of moving bodies is external, that of the springs internal, and what slides or is
/// damped counts as friction.
#pragma once

#include "physics/particles/patch.h"

namespace lahar {

/// Before particles move: work of the forces of contact in this step, and the forces of the next
/// one at the places to which the nodal velocities move particles. begin_contact() comes first.
template <int Dim>
void begin_contact(Patch<Dim>& patch, const StepContext<Dim>& step);
template <int Dim>
void touch_bodies(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Patch::reactions are complete: what moving bodies do is external work.
template <int Dim>
void end_contact(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Implicit steps: contact of a particle that the step moves by `move` [m], without dashpots.
/// Bodies do not move in these steps.
template <int Dim>
struct ImplicitContact {
  Vec<Dim> force;                             ///< [N]
  Eigen::Matrix<double, Dim, Dim> stiffness;  ///< [N/m] -d force / d move
  bool touches = false, slides = false;       ///< a particle that slides: not symmetric
};
template <int Dim>
ImplicitContact<Dim> contact_after(Patch<Dim>& patch, const StepContext<Dim>& step,
                                   const ParticleBin& bin, Local p, const Vec<Dim>& move);
/// Whether particles of a bin may touch a body.
template <int Dim>
bool meets_bodies(Patch<Dim>& patch, const StepContext<Dim>& step, const ParticleBin& bin);

/// Where body k is at the end of a step.
template <int Dim>
Placement<Dim> placement_after(const StepContext<Dim>& step, std::size_t k);

}  // namespace lahar
