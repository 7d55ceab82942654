/// \file What a run measures: from patches to rows of gauges and to maps.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <mutex>
#include <span>
#include <vector>

#include "io/run/checkpoint_header.h"
#include "io/run/gauge_rows.h"
#include "physics/particles/removed_particle.h"
#include "runtime/exchange/per_step.h"
#include "runtime/step/gauge_sums.h"
#include "runtime/step/map_sums.h"

namespace lahar {

/// Tasks of a step add what their patches have. Ranks add that up in the agreement of the step. All
/// sums are of whole numbers, so that no order matters.
template <int Dim>
class Gauges {
 public:
  /// `model` must outlive it. Throws InputError where particles have no such field.
  Gauges(const Model<Dim>& model, const ColumnLayout<Dim>& layout);

  bool any() const { return plan_.any(); }
  std::vector<GaugeTable> tables() const;

  /// After the step a patch is as it is now, at `time` [s].
  void add(Patch<Dim>& patch, Step step, double time);
  /// This rank's patches have done the step.
  void give(Step step, Agreement& own);
  /// The rows after a step; steps in order. `sum` and `least` are this part of the agreement.
  GaugeRows take(Step step, double time, std::span<const Index> sum, std::span<const Index> least);
  /// The same of patches at rest; what forces did since the row before is taken. Collective.
  GaugeRows present(std::span<Patch<Dim>* const> patches, Step at, double time,
                    const Communicator& ranks);
  /// They left the mesh, and patches do not list them any more; the same on all ranks.
  void add_removed(std::span<const RemovedParticle> particles);
  /// What came into a patch by these events did not pass a plane: add its mass beyond each one.
  void add_injected(const Patch<Dim>& patch, std::span<const Index> events,
                    std::vector<ExactSum>& beyond) const;
  /// The sums of a step over all ranks; steps in order, each before its rows are taken.
  void take_injected(std::span<const Index> beyond);

  std::size_t n_planes() const { return state_.beyond.size() / 2; }
  std::size_t n_sums() const;   ///< of Agreement::sum
  std::size_t n_least() const;  ///< of Agreement::lowest
  const GaugeState& state() const { return state_; }
  /// Go on from a state; gauges that it does not know begin anew.
  void resume(const GaugeState& state);

 private:
  /// What a step found on this rank.
  struct Found {
    tbb::enumerable_thread_specific<GaugeSums> of_threads;
    MapSums maps;
    std::mutex maps_mutex;
  };
  GaugeSums room() const;
  void add_to(Found& found, Patch<Dim>& patch, double time) const;
  void gather(Found& found, std::vector<Index>& sum, std::vector<Index>& least) const;
  std::vector<double> values_of(std::size_t k, const GaugeSums& all, double time);
  void add_places(const OpenGauge<Dim>& open, const GaugeSums& all, std::vector<double>& row) const;
  double area_of_weights(const std::array<double, 3>& place,
                         const std::array<double, 3>& radii) const;
  void add_tracks(const OpenGauge<Dim>& open, const GaugeSums& all, std::vector<double>& row) const;
  ExactSum removed_beyond(std::size_t plane) const;  ///< GaugeState::removed of a plane
  void set_removed_beyond(std::size_t plane, const ExactSum& sum);
  std::vector<double> plane_row(const OpenGauge<Dim>& open, const GaugeSums& all, double time);

  const Model<Dim>& model_;
  const GaugePlan& plan_;
  std::vector<OpenGauge<Dim>> gauges_;
  GaugeSlots size_;  ///< of all gauges: n_exact, n_added, n_least
  PerStep<Found> found_;
  GaugeState state_;
};

}  // namespace lahar
