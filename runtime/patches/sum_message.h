/// \file Where the messages of a step have the node sums of other ranks.
#pragma once

#include <array>

#include "physics/particles/patch.h"

namespace lahar {

/// Which message of a step brings a kind of node sum from other ranks, and which of the message's
/// arrays holds it.
struct SumMessage {
  int number = 0;
  int array = 0;
};
using SumMessages = std::array<SumMessage, n_node_sums>;

}  // namespace lahar
