/// \file Putting together what belongs together in a trace.
#pragma once

#include <vector>

#include "runtime/trace/analyse/log.h"

namespace lahar {

/// The two ends of messages, as the ranks recorded them.
struct MessageEnds {
  std::vector<TraceMessage> sent, came;
};

/// Sort the tasks by their beginning; find messages from their ends, what each task waited for, and
/// the extent of the log.
void link(TraceLog& log, MessageEnds ends);

}  // namespace lahar
