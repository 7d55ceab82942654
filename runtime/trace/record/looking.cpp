#include "runtime/trace/record/looking.h"

#include "runtime/base/stage_clock.h"
#include "runtime/trace/record/recorder.h"

namespace lahar {

namespace {

/// When this thread began to look for messages; 0 = it does not.
thread_local std::uint64_t looking_since = 0;

}  // namespace

void trace_looking(bool over) {
  TraceRecorder* recorder = TraceRecorder::of_present();
  if (!recorder) {
    looking_since = 0;
    return;
  }
  if (over && looking_since > 0)
    recorder->add({.begin = looking_since,
                   .end = ticks(),
                   .step = recorder->present(),
                   .kind = TraceKind::poll});
  looking_since = over ? 0 : ticks();
}

TraceFound::TraceFound() : while_looking_(looking_since > 0) {
  if (while_looking_) trace_looking(true);
}

TraceFound::~TraceFound() {
  if (while_looking_) trace_looking(false);
}

std::uint64_t trace_clock() {
  return TraceRecorder::active() ? ticks() : 0;
}

}  // namespace lahar
