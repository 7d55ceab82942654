/// \file Failures of a run: collected while the graph drains, the first one reported.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "graph/stage.h"
#include "physics/model/injection.h"
#include "physics/particles/patch.h"
#include "physics/particles/removed_particle.h"
#include "runtime/comm/communicator.h"

namespace lahar {

struct Failure {
  Step step = 0;        ///< steps done before the failing one
  int stage_index = 0;  ///< decides, then the patch, among failures of one step
  std::string stage;
  double time = 0;  ///< [s] at the beginning of the step
  Index patch = -1;
  std::string cause;
};

/// All patches reach the earliest failing step before they stop, so the first failure, by step and
/// patch, is the same for any number of threads.
class FailureList {
 public:
  void add(Failure failure);
  bool empty() const;
  /// True if some patch failed in `step` or before. Known for good once all have done `step`.
  bool by(Step step) const;
  /// The earliest failure, by step, stage and patch; not of an empty list.
  Failure earliest() const;
  /// Patches that failed in a step.
  Index count(Step step) const;

 private:
  mutable std::mutex mutex_;
  std::vector<Failure> failures_;
};

/// The text of the first rank that has one; if none has, texts stay. Collective.
void take_first_text(const Communicator& ranks, bool has, std::string& text);

/// The first failure of a run, of `failed` patches in its step. `counted`: what its steps are.
std::string failure_message(const Failure& first, int rank, Index failed,
                            std::string_view counted = "step");

/// "particle 12 at (1, 2) m, velocity (0, 3) m/s". Ids from `injected` on are not named: when
/// injected particles get those that frames know depends on output and restarts.
template <int Dim>
std::string describe_particle(const Particles<Dim>& particles, Local p,
                              Index injected = first_injected_id);

/// The same of a particle that has left the mesh.
template <int Dim>
std::string describe_particle(const RemovedParticle& particle);

/// What a fault is, and what to do; likewise.
template <int Dim>
std::string describe_fault(const ParticleFault& fault, const Model<Dim>& model, Index injected);

std::string unstable_message(double dt, double limit, const std::string& particle);
std::string unstable_hint(double limit);

}  // namespace lahar
