/// \file Workers of a trace, and when they had nothing to do.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "runtime/trace/analyse/log.h"

namespace lahar {

/// Threads that ran tasks, and those that the run had beside them.
struct Workers {
  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  std::vector<std::pair<int, int>> list;  ///< rank, thread
  std::map<std::pair<int, int>, std::size_t> places;

  std::size_t place(int rank, int thread) const {
    const auto found = places.find({rank, thread});
    return found == places.end() ? none : found->second;
  }
};
Workers workers_of(const TraceLog& log);

/// Worker time of each rank in which no task ran.
class IdleTime {
 public:
  IdleTime(const TraceLog& log, const Workers& workers);
  /// [s] summed over the workers of a rank between two times.
  double within(int rank, double begin, double end) const {
    return end > begin ? until(rank, end) - until(rank, begin) : 0.0;
  }

 private:
  struct Change {
    double time, idle;  ///< [s] summed until then
    int workers;        ///< that are idle from then on
  };
  double until(int rank, double time) const;

  std::vector<std::vector<Change>> changes_;
};

/// What workers did outside of tasks: polls, ends of steps, output, delays.
class OtherWork {
 public:
  OtherWork(const TraceLog& log, const Workers& workers);
  /// [s] of it of a worker between two times.
  double within(std::size_t worker, double begin, double end) const;

 private:
  std::vector<std::vector<std::pair<double, double>>> spans_;  ///< by worker: ascending, apart
};

}  // namespace lahar
