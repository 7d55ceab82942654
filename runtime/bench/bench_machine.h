/// \file The machine that `lahar bench` runs on: what it is, and what its memory and cores can do.
#pragma once

#include "runtime/bench/bench_result.h"

namespace lahar {

/// Everything but the rates; what cannot be read is "unknown" or 0.
BenchMachine describe_machine();

/// [B] that processes can still get: MemAvailable, or what the control group leaves.
double available_memory();

/// Memory bandwidth and multiply-add peak on `threads` threads, `passes` times; `bytes` [B] are
/// those of one of the three arrays of a thread. Starts threads.
BenchRates measure_rates(int threads, int passes, std::size_t bytes);

/// [B] of an array far beyond the caches: four times the last level, 64 to 256 MiB.
std::size_t bench_array_bytes();

}  // namespace lahar
