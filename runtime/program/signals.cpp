#include "runtime/program/signals.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <mutex>
#include <string>

namespace lahar {

namespace {

constexpr std::array stops{SIGINT, SIGTERM, SIGHUP};

// Signal handlers can reach nothing but globals.
volatile std::sig_atomic_t stop_received = 0, checkpoint_received = 0;
volatile std::sig_atomic_t early_status = 0;  ///< 0 = the signal's own
/// What is said of each signal; ready before there is a handler that says it.
std::array<std::string, stops.size()> early_texts;

void on_stop(int number) {
  stop_received = number;
}
void on_checkpoint(int) {
  checkpoint_received = 1;
}
void on_early_stop(int number) {
  for (std::size_t k = 0; k < stops.size(); ++k)
    // An error cannot be said either.
    if (stops[k] == number && write(STDERR_FILENO, early_texts[k].data(), early_texts[k].size())) {
    }
  if (early_status != 0) _exit(early_status);
  std::signal(number, SIG_DFL);
  raise(number);
}

/// What a SignalWatch changes.
constexpr std::array watched{SIGPIPE, SIGINT, SIGTERM, SIGHUP, SIGUSR1};

/// Of all SignalWatch.
std::mutex watch_mutex;
int watches = 0;
bool ends_early = false;
std::array<struct sigaction, watched.size()> handlers_before;

/// A signal that is ignored stays so: that is how nohup and shells protect a program.
void handle(int number, void (*handler)(int), int flags = 0) {
  struct sigaction now {};
  sigaction(number, nullptr, &now);
  if (now.sa_handler == SIG_IGN) return;
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  sigaction(number, &action, nullptr);
}

void watch_signals() {
  std::signal(SIGPIPE, SIG_IGN);  // a reader of the progress that goes away does not end the run
  for (const int number : stops) handle(number, on_stop);
  handle(SIGUSR1, on_checkpoint, SA_RESTART);
}

}  // namespace

void end_at_signals(const std::string& text, int status) {
  const std::lock_guard lock(watch_mutex);
  if (watches > 0) return;
  ends_early = true;
  watch_signals();  // which use none of what is written here
  early_status = status;
  const char* after_progress = isatty(STDERR_FILENO) != 0 ? "\n" : "";
  for (std::size_t k = 0; k < stops.size(); ++k)
    early_texts[k] = text.empty() ? ""
                                  : fmt::format("{}lahar: stopped by signal {} {}\n",
                                                after_progress, stops[k], text);
  for (const int number : stops) handle(number, on_early_stop);
  if (stop_received != 0) raise(stop_received);
}

void ask_at_signals() {
  const std::lock_guard lock(watch_mutex);
  if (ends_early) watch_signals();
  ends_early = false;
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
