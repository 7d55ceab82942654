/// \file `lahar bench ranks` and `lahar bench overlap`: measurements that need several ranks.
#pragma once

#include <string>

namespace lahar {

struct RankBenchArguments {
  std::string program;  ///< to start under mpirun
  bool quick = false;   ///< short samples: a look, not a measurement
  int repeats = 5;      ///< samples of each
};

/// 2 ranks of one thread against one rank of 2 threads, and weak scaling over 1, 2 and 4 ranks.
int bench_ranks(const RankBenchArguments& arguments);
/// How much a latency of 600 us, injected per message, adds to a step: as a graph, and
/// bulk-synchronously.
int bench_overlap(const RankBenchArguments& arguments);

}  // namespace lahar
