/// \file Signals by which a user, a terminal or a batch system speaks to a run.
#pragma once

namespace lahar {

/// From now on, SIGINT, SIGTERM and SIGHUP ask the run to stop, and SIGUSR1 asks for a checkpoint.
void watch_signals();

/// The same within a program that has handlers of its own, which have come back when the last of
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
