#include "runtime/comm/rank_watch.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string>
#include <utility>

#include "runtime/base/exit_codes.h"

namespace lahar {

namespace {

/// False for a process that has ended, also before its parent has looked.
bool is_alive(Index process) {
  if (kill(static_cast<pid_t>(process), 0) != 0 && errno == ESRCH) return false;
  std::ifstream file(fmt::format("/proc/{}/stat", process));
  std::string text;
  if (!std::getline(file, text)) return kill(static_cast<pid_t>(process), 0) == 0;
  const std::size_t name_end = text.rfind(')');  // the name may contain anything
  const char state = name_end + 2 < text.size() ? text[name_end + 2] : '?';
  return state != 'Z' && state != 'X';
}

using HostName = std::array<char, 256>;

HostName host_name() {
  HostName name{};
  gethostname(name.data(), name.size() - 1);
  return name;
}

}  // namespace

RankWatch::RankWatch(const Communicator& ranks, std::function<bool()> stop_asked)
    : rank_(ranks.rank()), stop_asked_(std::move(stop_asked)) {
  if (!ranks.several()) return;
  struct Self {
    HostName host;
    Index process;
  };
  const Self self{host_name(), static_cast<Index>(getpid())};
  const std::vector<Self> all = ranks.gather_all(std::span(&self, 1));
  for (int r = 0; r < ranks.size(); ++r) {
    const Self& other = all[static_cast<std::size_t>(r)];
    // A process that cannot be seen, as in another container, cannot be watched.
    if (r != rank_ && other.host == self.host && is_alive(other.process))
      peers_.push_back({r, other.process});
  }
  ranks.wait_for_all();  // all have looked while all were there
  thread_ = std::thread([this] { loop(); });
}

RankWatch::~RankWatch() {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    ends_ = true;
  }
  ending_.notify_all();
  thread_.join();
}

void RankWatch::loop() {
  // Signals are for the threads that compute.
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  std::unique_lock lock(mutex_);
  while (!ending_.wait_for(lock, std::chrono::milliseconds(100), [this] { return ends_; })) {
    look_at_peers();
    look_at_clock();
  }
}

void RankWatch::look_at_peers() const {
  for (const Peer& lost : peers_) {
    if (is_alive(lost.process)) continue;
    for (const Peer& other : peers_)  // one of those that are left speaks
      if (other.rank < rank_ && is_alive(other.process)) {
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        std::_Exit(exit_rank);
      }
    end(fmt::format(
        "rank {} (process {}) is gone: it was killed, for example because memory ran out, or it "
        "crashed. The last step that all ranks finished is {}. If there are checkpoints, "
        "`--restart latest` goes on, on any number of ranks.",
        lost.rank, lost.process, steps_done_.load()));
  }
}

void RankWatch::look_at_clock() {
  if (ended_.load(std::memory_order_relaxed)) return;
  const Step done = steps_done_.load();
  const auto now = std::chrono::steady_clock::now();
  const bool first_asked = stop_asked_() && !std::exchange(asked_, stop_asked_());
  if (done != moved_step_ || first_asked) {
    if (!asked_) longest_ = std::max(longest_, now - moved_);
    moved_step_ = done;
    moved_ = now;
  }
  const auto allowed = std::max<std::chrono::steady_clock::duration>(patience, 3 * longest_);
  if (asked_ && now - moved_ > allowed)
    end(fmt::format(
        "rank {} was asked to stop, but no step was completed for {} s. It ends "
        "without writing its state; the last step that all ranks finished is {}.",
        rank_, std::chrono::duration_cast<std::chrono::seconds>(allowed).count(), done));
}

void RankWatch::end(const std::string& message) const {
  std::fputs(("lahar: error: " + message + "\n").c_str(), stderr);
  std::fflush(nullptr);
  // Others look whether this rank is there, to be silent.
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  std::_Exit(exit_rank);
}

}  // namespace lahar
