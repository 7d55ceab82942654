/// \file `lahar bench ranks`, `overlap` and `balance`: measurements that need several ranks.
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

/// A block that slides from one end of the mesh to the other over 4 ranks: how evenly they share it
/// on its way, and what moving patches costs.
int bench_balance(const RankBenchArguments& arguments);

}  // namespace lahar
