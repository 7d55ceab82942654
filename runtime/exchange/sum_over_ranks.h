/// \file Exact sums of all ranks.
#pragma once

#include <vector>

#include "runtime/comm/communicator.h"
#include "runtime/exchange/exact_sum.h"

namespace lahar {

/// The value of the sums of all ranks together, whatever their order. Collective.
inline double sum_over_ranks(const ExactSum& own, const Communicator& ranks) {
  std::vector<Index> elements(own.elements().begin(), own.elements().end());
  ranks.sum(elements);
  return ExactSum(std::span<const Index, ExactSum::size>(elements)).value();
}

}  // namespace lahar
