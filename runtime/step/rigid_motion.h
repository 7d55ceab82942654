/// \file Rigid bodies in a run: those that are free move once per step, on all ranks alike.
#pragma once

#include <span>
#include <vector>

#include "io/run/checkpoint_header.h"
#include "io/run/history.h"
#include "runtime/exchange/exact_sum.h"
#include "runtime/exchange/per_step.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/rigid_collisions.h"
#include "runtime/step/rigid_impulses.h"

namespace lahar {

/// Rigid bodies in the test of equilibrium. What is out of balance on a free body is its mass times
/// its acceleration: it has the pushes of other bodies, too.
struct RestOfBodies {
  double kinetic = 0;                ///< [J] of free bodies
  double unbalanced = 0, loads = 0;  ///< [N] on them
  bool moved = false;                ///< one moves as prescribed
};

/// Motion of free bodies by the forces of particles, gravity, and of other rigid bodies. With the
/// force F and torque M on a body at the beginning of a step of dt:
///
///     v += dt (F / m + g)      omega += dt I^-1 (M - omega x I omega)
///     x += dt v                R = exp(dt omega) R
///
/// (symplectic Euler: the same order as that of particles). Bodies that would be inside of each
/// other at the end of the step get impulses at its beginning (strike()), so that they just touch.
/// At a point where they strike with the speed u they part with e u, e being their restitution:
/// the larger of the two, as that of friction. It is less where together with friction it would
/// make energy. What is inside nevertheless, as surfaces bend, is brought out without a velocity, a
/// fifth of the way in a step, or a tenth of the distance of points. Forces are exact sums over
/// patches, so that bits do not depend on ranks.
template <int Dim>
class RigidMotion {
 public:
  explicit RigidMotion(Model<Dim>& model) : model_(model), collisions_(model) {}
  bool any_free() const { return model_.analysis.free_bodies; }

  /// Bodies are where they begin, at `time` [s]; nothing has touched them.
  void begin(Step first, double time);
  /// Before begin(): bodies that another run had, too, by name, are where it ended. Free ones keep
  /// their velocity, and what particles do to them. Throws InputError where others are in the way
  /// of particles. Collective.
  void take_over(const std::vector<RigidBodyState>& bodies, const PatchSet<Dim>& patches,
                 const Communicator& ranks);
  /// Bodies as a state has them, which goes on with `step`.
  void resume(Step step, double time, const std::vector<RigidBodyState>& bodies);
  /// At the beginning of `step`, at `time` [s].
  std::vector<RigidBodyState> state(Step step, double time) const;

  /// Sums over the reactions that patches found for the step that comes, as elements.
  std::span<const Index> sums(const PatchSet<Dim>& patches);
  /// Reactions of all ranks.
  void take(Step step, std::span<const Index> elements);
  /// Move the bodies in `step`, from `time` [s] on.
  void move(Step step, double time, double dt);
  /// What bodies have in the test of equilibrium before `step`, at `time` [s]; the step before
  /// took `dt` [s].
  RestOfBodies rest(Step step, double time, double dt) const;
  /// Names and places of all bodies at the end of a step, at `time` [s], for a row of the history.
  void describe(Step step, double time, HistoryRow& row) const;

  /// At the end of a step, by body; null without free bodies.
  const Placement<Dim>* after(Step step) const {
    return any_free() ? after_[step].data() : nullptr;
  }

 private:
  void need_room(const RigidBody<Dim>& body, const PatchSet<Dim>& patches,
                 const Communicator& ranks) const;
  Placement<Dim> placement(std::size_t body, Step slot, double time) const;
  std::vector<StruckBody> collide(const std::vector<Encounter<Dim>>& encounters,
                                  const std::vector<Placement<Dim>>& apart, double dt,
                                  std::vector<Placement<Dim>>& now) const;

  static constexpr std::size_t n_sums = 6;  ///< of a body
  Model<Dim>& model_;
  RigidCollisions<Dim> collisions_;
  PerStep<std::vector<Placement<Dim>>> after_;
  PerStep<std::vector<Reaction>> reactions_;  ///< at the beginning of the step
  std::vector<Reaction> taken_;               ///< reactions with which a run begins; empty = none
  std::vector<Index> elements_;
};

}  // namespace lahar
