/// \file Contact of particles with rigid bodies inside of the mesh: terrain, obstacles, tools.
///
/// A particle is a ball. It touches a body where its centre is nearer to the surface than its reach
/// r: half of the edge of its volume at the start, or its distance at the start if that is less. So
/// nothing is pushed at the start, but what begins with stresses presses at once as these say: r is
/// longer by -n.(sigma n) A / k (press_at_start()). With the gap g = distance - r < 0, the unit
/// normal n out of the body, and the velocity w of the particle relative to the body:
///
///     N = max(0, -k g - c w.n)
///     T = (1 - n n^T) (T - k dt w),  S = T - (1 - n n^T) c w,  |T|, |S| <= mu N + cohesion A
///     f_i += sum_p N_ip (N n + S)_p - C_p grad N_ip,  C = <N> d n n^T,  d = max(0, e + g)
///
/// The couple C takes N n to the end of the material, which is e away where contact begins:
/// N(x) - d n . grad N is the function there, to first order. It is the surface, e = r, but where
/// parts of cells count as a whole and rows of particles lie along it: there it is half an edge. So
/// a pressure that ends at a surface is in balance at each node, and water rests beside a body;
/// with N n at centres some nodes were pushed on, others back. Where n is an axis and functions are
/// products, that balance is exact (SidePush in particle_forces.h): else nodes of little mass
/// beyond a surface let an elastic body yield to a plate, by a fifth of its load.
///
/// <N> is N smoothed in time, from zero on when contact begins, with T = 3 h / 2 c_w and the speed
/// of waves c_w. With N itself springs would act at other places than those at which their
/// length is measured. Such forces have no energy: bodies at rest began to shake. What is faster
/// than T acts at centres, where lengths are measured, and only there. In a sequence of equilibria
/// T is 0: nothing shakes.
///
///     A = V / 2r, within V^(1 - 1/Dim) and (h/2)^(Dim - 1)
///     k = min(2 M A / h, 3 m / 2 dt^2),  c = 2 zeta sqrt(k min(rho A h / 2, m))
///
/// M is the longitudinal modulus of the material at the start, rho its density then, V and m the
/// volume and mass of the particle, h the size of the cell. A is the surface by which it touches: a
/// particle that a surface has cut is thin, and has the surface of a whole one. So particles yield
/// to a pressure p by p/M of half a cell, about as much as half a cell of the material does.
/// 3 m / 2 dt^2 is what a step allows of a particle that flies alone; dt is the longest step of
/// such particles in the run, so that k is constant. It bounds particles whose reach is less than
/// 2/3 (c dt)^2 / h with the speed of waves c.
///
/// A free body moves by explicit steps, too. Its springs all together have at most half of its mass
/// over dt^2: k <= M_b A / (2 A_b dt^2), M_b its mass, A_b the product of its larger extents, and
/// c has M_b A / A_b in place of a larger mass of the particle. This bounds bodies that are lighter
/// than some part of a cell of the material.
///
/// Particles of axisymmetric models are rings: V / 2 pi r is in place of V, and A is 2 pi r times
/// the length of the section. The reaction along r is the sum over the circle. Couples of a ring
/// cancel: bodies get no torque.
///
/// A particle whose centre would come to lie inside of a body is put on its surface, and its reach
/// grows by as much (keep_outside()): forces, momentum and the energy of springs do not change.
///
/// T is an elastic force, as in the discrete element method (Cundall and Strack 1979): what sticks
/// does not creep. Forces of contact lie in the column `contact_force`, are mapped to nodes as
/// tractions are, and act with the opposite sign on the body: momentum is kept. Implicit steps have
/// k = 2 M A / h and no dashpots.
///
/// A liquid in pores is held beside this (liquid_contact.h): M is then that of the skeleton, and N
/// of the effective stress.
///
/// Energy: work of moving bodies is external, that of the springs internal, and what slides or is
/// damped counts as friction.
#pragma once

#include "physics/kernels/velocity_gradients.h"
#include "physics/particles/patch.h"

namespace lahar {

/// Before particles move: work of the forces of contact in this step, and the forces of the next
/// one at the places to which the nodal velocities move particles. begin_contact() comes first.
template <int Dim>
void begin_contact(Patch<Dim>& patch, const StepContext<Dim>& step);
template <int Dim>
void touch_bodies(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Work that couples take in a step, from the velocities from which strains are taken. `gradients`
/// (optional) are those of the particles.
template <int Dim>
void count_couples(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                   const VelocityGradients<Dim>* gradients = nullptr);

/// When particles have moved: no centre of theirs remains inside of a body. With CPDI2 places
/// follow from corners, and are left.
template <int Dim>
void keep_outside(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins);

/// Patch::reactions are complete: what moving bodies do is external work.
template <int Dim>
void end_contact(Patch<Dim>& patch, const StepContext<Dim>& step);

/// Implicit steps: contact of a particle that the step moves by `move` [m], without dashpots, with
/// bodies where they are at the end of the step.
template <int Dim>
struct ImplicitContact {
  Vec<Dim> force;                             ///< [N]
  Eigen::Matrix<double, Dim, Dim> stiffness;  ///< [N/m] -d force / d move
  bool touches = false, slides = false;       ///< a particle that slides: not symmetric
  /// A push in `force`, which acts at the end of the material.
  struct Push {
    Vec<Dim> n;
    double arm, extent;       ///< [m] as in UnitPush
    double force, stiffness;  ///< [N], [N/m] -d force / d move.n
  };
  std::vector<Push> pushes;
  double share_of_now = 1;  ///< of them in the couple C after the step
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
