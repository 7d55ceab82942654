/// \file A simulation: the model cut into patches, stepped by an executor of the task graph.
#pragma once

#include <functional>
#include <memory>

#include "io/frame.h"
#include "io/history.h"
#include "physics/model.h"

namespace lahar {

/// How the timestep's tasks are executed. Results are bitwise the same for all of them.
struct ExecutionOptions {
  enum class Mode { flow_graph, serial, random_order } mode = Mode::flow_graph;
  int threads = 0;         ///< flow graph only; 0 = all cores this process may use
  std::uint64_t seed = 1;  ///< random order only
};

/// Receives what a simulation produces while it runs; called from worker threads, one at a time.
struct Observer {
  std::function<void(Frame&&)> frame;               ///< every OutputPlan::frame_steps, and at the end
  std::function<void(const HistoryRow&)> history;   ///< every OutputPlan::history_steps
};

template <int Dim>
class Simulation {
 public:
  /// Cuts the mesh, places the particles. Throws InputError (fixed step above the limit, ...).
  explicit Simulation(Model<Dim> model, ExecutionOptions options = {}, Observer observer = {});
  ~Simulation();

  /// Take `steps` steps (fewer where the end time comes first). Throws SimulationError.
  void advance(Index steps);
  /// Take all steps of the scenario.
  void run();

  Frame frame() const;        ///< present state, ascending particle id
  HistoryRow history() const; ///< present sums
  Index step() const;
  double time() const;        ///< [s]

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

extern template class Simulation<2>;
extern template class Simulation<3>;

}  // namespace lahar
