#include "runtime/program/signals.h"

#include <csignal>
#include <initializer_list>

namespace lahar {

namespace {

// Signal handlers can reach nothing but a global.
volatile std::sig_atomic_t stop_received = 0, checkpoint_received = 0;

void on_stop(int number) {
  stop_received = number;
}
void on_checkpoint(int) {
  checkpoint_received = 1;
}

}  // namespace

void watch_signals() {
  struct sigaction action {};
  action.sa_handler = on_stop;
  std::signal(SIGPIPE, SIG_IGN);  // a reader of the progress that goes away does not end the run
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaction(number, &action, nullptr);
  action.sa_handler = on_checkpoint;
  action.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &action, nullptr);
}

void ignore_file_size_signal() {
  std::signal(SIGXFSZ, SIG_IGN);
}

int stop_signal() {
  return stop_received;
}

bool take_checkpoint_request() {
  const bool received = checkpoint_received != 0;
  checkpoint_received = 0;
  return received;
}

}  // namespace lahar
