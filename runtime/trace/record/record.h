/// \file What a trace is made of: fixed-size records of what tasks, messages and threads did.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "graph/stage.h"

namespace lahar {

/// What a record tells of. Numbers are part of the file format: add at the end.
enum class TraceKind : std::uint8_t {
  task,        ///< a phase of a patch of the rank
  unpack,      ///< the task that a message fires; the patch is the sender's
  dt,          ///< the global minimum is taken over and dt of `step` set; in loops of solvers:
               ///< the sums of the round before are taken over
  send,        ///< a message is packed and posted
  arrival,     ///< from when a message was found to when it was handed to the graph
  agreement,   ///< a reduction, from when this rank gave its part to when it was found complete
  completed,   ///< what is done when all patches (several ranks: of all) have finished the step
  poll,        ///< a thread without a task looked for messages
  frame,       ///< output of a frame, by a thread in the background
  checkpoint,  ///< the same of a checkpoint
  trace,       ///< writing the trace itself
  counter,     ///< a value at a time
  delay,       ///< a thread was kept busy on purpose, by a switch for studies
  rounds,      ///< a loop of a solver from its first round to its last: tasks are within
  direct,      ///< a linear system is solved directly: no task runs
};
inline constexpr int trace_kinds = 15;
std::string_view name_of(TraceKind kind);

/// Which reduction an agreement was. In loops of solvers `time_step` is that of a round's sums.
enum class TraceAgreement : std::uint8_t { step, time_step };

/// Which value a counter is.
enum class TraceCounter : std::uint8_t {
  particles,  ///< of the rank's patches, as they take part in a step
  memory,     ///< [bytes] of the process
  load,       ///< share of the time of the rank's workers in tasks of own patches; from the tasks
};
inline constexpr int trace_counters = 3;

/// Most stages of a phase, whose times a task's record holds.
inline constexpr std::size_t trace_stages = 8;

/// One record. Times are ticks of the rank's clock (runtime/base/stage_clock.h).
///
/// `ready` is taken when the task graph counts the last thing that a task waited for: the end of
/// the body of another task, which has by then posted its messages and, where it ended a step, done
/// what is done then; a message that was found; a permit to begin a step; an agreement. It counts
/// on several ranks, where it has to, and when it is verified. Else `ready` is 0, and readers take
/// the latest end of all this (log_links.cpp), which comes before what is noted by what a body does
/// at its end: passing on to its successors, 0.1 us at the median, 2 us in one of 100 tasks.
struct TraceRecord {
  struct Message {
    std::int64_t bytes;
    std::int32_t peer;  ///< the other rank
    std::int32_t unused = 0;
    std::uint64_t sent;  ///< arrival: ticks of the sender's clock when it was posted
    std::uint64_t unused_too = 0;
  };
  union Detail {
    std::array<std::uint32_t, trace_stages> stage;  ///< task: ticks of each of the phase's stages
    Message message;                                ///< send, arrival
    std::uint64_t missed;                           ///< unpack: begin of the last look without it
    double value;                                   ///< counter
  };

  std::uint64_t begin = 0, end = 0;
  std::uint64_t ready = 0;  ///< task, unpack, dt; 0 = not known
  Step step = -1;           ///< from 0; frame, checkpoint: steps done, as in the file's name
  std::int32_t round = -1;  ///< in loops of solvers: from 0, counted over the run; else -1
  std::int32_t loop = 0;    ///< which list of stages: 0 = the time step, then those of solvers
  std::int32_t patch = -1;  ///< its number in the whole mesh
  TraceKind kind = TraceKind::task;
  /// task, unpack, send, arrival: of the loop; else TraceAgreement, TraceCounter.
  std::uint8_t phase = 0;
  std::uint16_t thread = 0;  ///< of the rank, in the order in which they first recorded something
  Detail detail{.stage = {}};
};
static_assert(sizeof(TraceRecord) == 80 && std::is_trivially_copyable_v<TraceRecord>);

/// Steps that are recorded: [first, last].
struct TraceWindow {
  Step first = 0, last = INT64_MAX;
  bool has(Step step) const { return first <= step && step <= last; }
};

// --- the file -----------------------------------------------------------------------------------

/// A file per rank: this line, then sections, each with a header, in the order of their writing.
/// Little-endian.
inline constexpr std::string_view trace_magic = "Lahar trace 3\n\n\n";
static_assert(trace_magic.size() == 16);

struct TraceSection {
  enum class Kind : std::uint32_t {
    head = 1,     ///< JSON: the run, the rank and its loops of phases; first
    graph = 2,    ///< JSON: the patches of the rank from a step on
    records = 3,  ///< TraceRecords of one thread
    tail = 4,     ///< JSON: clocks; last, so that a file without it is not complete
  } kind;
  std::uint32_t crc;    ///< of the bytes (zlib's crc32)
  std::uint64_t bytes;  ///< that follow
};
static_assert(sizeof(TraceSection) == 16);

}  // namespace lahar
