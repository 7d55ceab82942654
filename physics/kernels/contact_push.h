/// \file Forces by which pushes of particles act at the end of their material (rigid_contact.h).
#pragma once

#include <algorithm>

#include "physics/kernels/particle_forces.h"

namespace lahar {

/// A push of one newton along the unit normal `n` that acts `arm` [m] from the place of a particle;
/// `extent` [m] is the arm without load.
template <int Dim>
struct UnitPush {
  Vec<Dim> n;
  double arm, extent;
};

/// Call add(i, f_i) for the nodes of a particle, for a node more than once: what takes a force of
/// contact to the end of the material, `extent` [m] away, by its couple [N m].
template <int Dim, class Basis, class Add>
void give_couple(const Basis& basis, Local p, const Vec<Dim>& force, ContactCouple<Dim> couple,
                 double extent, Add add) {
  if constexpr (TensorBasis<Basis>)
    if (const SidePush<Dim> side(force, couple, extent); side.share > 0.0) {
      side.take_from(couple);
      give_shift_to_side<Dim>(basis, p, side,
                              [&](int i, double shift) { add(i, Vec<Dim>(shift * side.push)); });
    }
  if (couple.isZero(0.0)) return;
  give_gradients<Dim>(basis, p, 1u, [&](int) {
    return [&](int i, const double(&dN)[Dim]) {
      add(i, Vec<Dim>(-couple * Eigen::Map<const Vec<Dim>>(dN)));
    };
  });
}

/// The same of a push.
template <int Dim, class Basis, class Add>
void give_shift(const Basis& basis, Local p, const UnitPush<Dim>& push, Add add) {
  const ContactCouple<Dim> couple = std::max(0.0, push.arm) * push.n * push.n.transpose();
  give_couple<Dim>(basis, p, push.n, couple, push.extent, add);
}

/// All of a push: call add(i, part of w_i).
template <int Dim, class Basis, class Add>
void give_push(const Basis& basis, Local p, const UnitPush<Dim>& push, Add add) {
  give_functions<Dim>(basis, p, 1u,
                      [&](int) { return [&](int i, double N) { add(i, Vec<Dim>(N * push.n)); }; });
  give_shift<Dim>(basis, p, push, add);
}

}  // namespace lahar
