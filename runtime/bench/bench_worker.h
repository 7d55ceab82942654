/// \file A process that runs one model of `lahar bench`, step by step on command.
///
/// Every measurement has processes of its own: caches, memory and failures of one do not touch
/// another, and several run side by side as users' runs do. The process that commands them has a
/// single thread, so that forking it is safe.
#pragma once

#include <string>

#include "runtime/base/child_process.h"
#include "runtime/bench/bench_cases.h"
#include "runtime/bench/bench_result.h"

namespace lahar {

/// A simulation in a process of its own. Commands come in pairs, begin and wait, so that several
/// workers can work at the same time.
class BenchWorker {
 public:
  explicit BenchWorker(const BenchJob& job);

  /// Before the first step: the variant with everything but times (waits for it).
  struct Ready {
    BenchVariant variant;
    double read_seconds = 0, construct_seconds = 0;  ///< [s] model, and simulation of it
  };
  Ready ready();

  /// Run until speeds are steady.
  void begin_warm_up();
  double wait_warm_up();  ///< [s] a step takes
  void begin_steps(Index steps);
  struct Times {
    double wall = 0, cpu = 0;  ///< [s]; cpu: of all threads
    // Linear solves: iterations and their [s]; products, [s] of all threads, and bytes.
    double iterations = 0, solving = 0, products = 0, multiplying = 0, product_bytes = 0;
  };
  Times wait_steps();

  /// At the end: time per stage since the warm-up, and memory.
  struct End {
    std::vector<BenchStage> stages;
    double resident = 0, peak = 0;  ///< [B] now, and at most since the process began
  };
  End finish();
  /// Particles that change their cell, per particle and step, counted over a few steps.
  double count_crossings();

 private:
  ChildProcess process_;
};

}  // namespace lahar
