#include "runtime/program/signals.h"

#include <array>
#include <csignal>
#include <cstddef>
#include <initializer_list>
#include <mutex>

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

/// What watch_signals() changes.
constexpr std::array watched{SIGPIPE, SIGINT, SIGTERM, SIGHUP, SIGUSR1};

/// Of all SignalWatch.
std::mutex watch_mutex;
int watches = 0;
std::array<struct sigaction, watched.size()> handlers_before;

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

SignalWatch::SignalWatch() {
  const std::lock_guard lock(watch_mutex);
  if (watches++ > 0) return;
  stop_received = 0;
  checkpoint_received = 0;
  for (std::size_t k = 0; k < watched.size(); ++k)
    sigaction(watched[k], nullptr, &handlers_before[k]);
  watch_signals();
}

SignalWatch::~SignalWatch() {
  const std::lock_guard lock(watch_mutex);
  if (--watches > 0) return;
  for (std::size_t k = 0; k < watched.size(); ++k)
    sigaction(watched[k], &handlers_before[k], nullptr);
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
