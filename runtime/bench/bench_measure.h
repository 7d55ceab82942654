/// \file Taking the measurements of `lahar bench`.
#pragma once

#include <functional>
#include <string>

#include "runtime/bench/bench_cases.h"
#include "runtime/bench/bench_result.h"

namespace lahar {

/// Told what is being done, a few words.
using BenchProgress = std::function<void(const std::string&)>;

/// Samples of one plan, taken in turn over its jobs. `machine` has the bandwidth that times are
/// held against. Throws what a run throws.
BenchCase measure(const BenchPlan& plan, const BenchProtocol& protocol, const BenchMachine& machine,
                  const BenchProgress& progress);

/// Rates of one thread and of all, measured in a process of their own.
std::vector<BenchRates> measure_machine(int threads, const BenchProtocol& protocol);

}  // namespace lahar
