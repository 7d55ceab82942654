/// \file The test of equilibrium that ends a run: when nothing moves and all forces are in balance.
///
/// Both measures do not depend on the mesh: the sum of the unbalanced forces of nodes over that of
/// all loads, and the kinetic energy over the elastic energy of the stresses. Free rigid bodies
/// count in both, and nothing is at rest while a body moves as prescribed. Sums are exact, so that
/// all ranks find the same.
#pragma once

#include <optional>
#include <string>

#include "graph/stage.h"
#include "io/run/checkpoint_header.h"
#include "physics/kernels/imbalance.h"
#include "runtime/patches/patch_set.h"
#include "runtime/step/rigid_motion.h"

namespace lahar {

/// Whether a run has come to rest.
bool is_at_rest(const UntilRest& until, const RestState& state);

/// "unbalanced forces are 9.1e-4 of the loads, kinetic energy is ... of the elastic energy".
std::string describe_rest(const RestState& state);

template <int Dim>
class RestTest {
 public:
  /// Both must outlive it.
  RestTest(const Model<Dim>& model, PatchSet<Dim>& patches, Communicator ranks)
      : model_(model), patches_(patches), ranks_(ranks) {}

  bool on() const { return model_.analysis.until.on(); }
  /// Whether equilibrium is tested when so many steps are done: all patches are then at rest.
  bool due(Step done) const {
    return on() && (is_implicit(model_.analysis) ? done > 0 : tests_rest(done));
  }
  /// Where the graph has to drain for the test, after `done` steps.
  Step drain_step(Step done, Step end) const {
    if (!on() || is_implicit(model_.analysis)) return end;
    return std::min(end, done == 0 ? 1 : (done / rest_steps + 1) * rest_steps);
  }

  /// At `time`, with what nodes had in the step before, or with what an implicit step will have.
  /// `kinetic` is that of particles. True: the run ends now. Collective.
  bool judge(double time, double kinetic, const RestOfBodies& bodies,
             std::optional<double> unbalanced = {});
  /// A run goes on, whose bounds may be others. True: it has ended.
  bool resume(const RestState& state);
  const RestState& state() const { return state_; }

 private:
  double sum(auto&& part) const;

  const Model<Dim>& model_;
  PatchSet<Dim>& patches_;
  Communicator ranks_;
  RestState state_;
};

extern template class RestTest<2>;
extern template class RestTest<3>;

}  // namespace lahar
