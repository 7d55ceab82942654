/// \file Signals by which a user, a terminal or a batch system speaks to a run.
#pragma once

#include <string>

namespace lahar {

/// From now on, SIGINT, SIGTERM and SIGHUP end the process at once: there is nothing to store yet.
/// It says "stopped by signal 15" and `text`, unless that is empty. `status`: 0 = the signal's own.
/// Signals that are ignored, as with nohup, remain so. Within a SignalWatch it does nothing.
void end_at_signals(const std::string& text, int status = 0);

/// From now on, they ask the run to stop, and SIGUSR1 asks for a checkpoint. After end_at_signals()
/// only.
void ask_at_signals();

/// Signals ask within a program that has handlers of its own, which have come back when the last of
/// these objects is gone. The first one forgets earlier signals. Any thread.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
};

/// A file that would exceed the limit of file sizes (ulimit -f) is an error of the write, as any
/// other, and not the silent end of the process.
void ignore_file_size_signal();

/// The signal that asked the run to stop; 0 = none.
int stop_signal();

/// Whether a checkpoint was asked for since the last call.
bool take_checkpoint_request();

}  // namespace lahar
