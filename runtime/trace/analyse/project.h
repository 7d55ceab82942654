/// \file Projections: how long steps of a recorded run would take on many more cores.
///
/// Weak scaling: copies of the recorded patches, each on as many cores as were recorded, arranged
/// as a torus (of as many dimensions as the patches' neighbours suggest) in which the outer patches
/// of a copy exchange with those of the next. Every copy takes the times of its tasks from recorded
/// steps of its own choice, so that what varied in the record varies among the copies. Strong
/// scaling: a fixed number of patches on more and more cores, until each core has one: patches are
/// not split.
///
/// Where there are more cores than can be simulated, a part of the torus is: neighbours of what is
/// simulated are all there, and what concerns all ranks is corrected. A reduction takes as many
/// hops as all ranks need, and waits for the last of them: if the times at which simulated ranks
/// come vary by sigma, the last of P comes sigma (e(P) - e(n)) later than that of the n simulated,
/// with e(n) the expected largest of n standard normal deviates (Blom 1958). The same is done for
/// the barriers of bulk-synchronous steps.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/trace/analyse/log.h"
#include "runtime/trace/analyse/network.h"

namespace lahar {

struct ProjectionAsk {
  int threads = 0;  ///< of each rank; 0 = as recorded
  Network network = {};
  double cores = 100'000;  ///< the most
  bool steady = false;     ///< tasks take their median time instead of what they took
};

struct ProjectionPoint {
  std::int64_t cores = 1, ranks = 1;
  std::int64_t simulated = 1;  ///< ranks
  double patches = 1;          ///< per core
  double graph = 0, bulk = 0;  ///< [s] per step: as a task graph, and with barriers
  /// Time in tasks of own patches over that of all cores.
  double graph_efficiency = 1, bulk_efficiency = 1;
};

/// What the run of a trace would take on larger machines.
struct ScalingProjection {
  int threads = 1;
  Network network = {};
  bool steady = false;
  int patches = 0, cores = 1;                 ///< recorded
  std::vector<ProjectionPoint> weak = {};     ///< ascending cores
  std::vector<ProjectionPoint> strong = {};   ///< of the recorded patches
  std::vector<ProjectionPoint> largest = {};  ///< of one patch per core of the largest machine
  std::vector<std::string> notes = {};        ///< what was assumed
};

/// Throws InputError if the trace lacks tasks.
ScalingProjection project(const TraceLog& log, const ProjectionAsk& ask = {});

/// For people, and for programs (JSON).
std::string text_of(const ScalingProjection& projection);
std::string json_of(const ScalingProjection& projection);

}  // namespace lahar
