/// \file What ranks find out about each other before they read a scenario together.
#pragma once

#include <functional>

#include "io/base/memory_limit.h"
#include "runtime/program/run_arguments.h"

namespace lahar {

/// All ranks must compute the same, to the last bit, or the result would be nobody's. Throws
/// RankError where programs, scenario files or options differ. Collective.
void check_alike(const RunArguments& arguments);

/// What each rank may take: the least of all ranks, so that all decide alike. Collective.
MemoryLimit limit_of_ranks(const RunArguments& arguments);

/// Do something on rank 0. What it throws of InputError, all ranks throw, so that it is said once.
/// Collective.
void on_first_rank(const Communicator& ranks, const std::function<void()>& work);

}  // namespace lahar
