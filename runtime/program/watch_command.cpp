// `lahar watch`.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <limits>
#include <optional>
#include <thread>

#include "io/base/text.h"
#include "runtime/program/commands.h"
#include "runtime/report/run_progress.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

using Clock = std::chrono::steady_clock;

struct WatchArguments {
  std::string run;
  double every = 1;  ///< [s]
};

/// What somebody who waits for a run wants to know, line by line or in one line of a terminal.
class Watch {
 public:
  explicit Watch(const WatchArguments& arguments)
      : arguments_(arguments), terminal_(is_terminal(STDOUT_FILENO)) {}

  /// Returns when the run has ended, with its exit code.
  int follow() {
    for (;;) {
      const RunProgress now = read_progress(arguments_.run);
      if (now.status != "running") {
        if (!next_stage_begins(now)) return end(now);
        continue;
      }
      show(now);
      std::this_thread::sleep_for(std::chrono::duration<double>(arguments_.every));
    }
  }

 private:
  struct Seen {
    Clock::time_point at;
    RunProgress progress;
  };

  static bool is_another(const RunProgress& before, const RunProgress& now) {
    return before.stage != now.stage || before.started != now.started;
  }

  void show(const RunProgress& now) {
    const Clock::time_point at = Clock::now();
    if (!begin_ || is_another(begin_->progress, now)) {
      begin_ = Seen{at, now};
      if (!now.stage.empty()) line("stage " + now.stage);
    }
    const double elapsed = std::chrono::duration<double>(at - begin_->at).count();
    const double gained = now.share() - begin_->progress.share();
    const double rate =
        elapsed > 0 ? (now.step - begin_->progress.step) * now.particles / elapsed : 0;
    const double left =
        gained > 0 ? elapsed * (1 - now.share()) / gained : std::numeric_limits<double>::infinity();
    const std::string where =
        fmt::format("step {}, t = {:.5g} s", format_count(static_cast<Index>(now.step)), now.time);
    const std::string remaining = gained > 0 ? format_seconds(left) + " left" : "";
    if (terminal_) {
      std::fputs(("\r\033[K" + progress_bar(now.share(), rate) + where + "  " + remaining).c_str(),
                 stdout);
      std::fflush(stdout);
      shown_ = true;
    } else if (!last_ || last_->step != now.step || is_another(*last_, now)) {
      line(fmt::format("{:3.0f} %  {}, {:.4g} m/s at most, {:.1f} M particle-steps/s{}{}",
                       100 * now.share(), where, now.max_speed, rate * 1e-6,
                       remaining.empty() ? "" : ", ", remaining));
    }
    last_ = now;
  }

  /// After a stage has finished, the next one has a folder soon.
  bool next_stage_begins(const RunProgress& ended) const {
    constexpr int tries = 6;
    if (ended.stage.empty() || ended.status != "finished" || !last_) return false;
    for (int k = 0; k < tries; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      if (read_progress(arguments_.run).stage != ended.stage) return true;
    }
    return false;
  }

  int end(const RunProgress& now) {
    const std::string at =
        fmt::format("{}step {}, t = {:.5g} s", now.stage.empty() ? "" : "stage " + now.stage + ", ",
                    format_count(static_cast<Index>(now.step)), now.time);
    if (now.status == "finished") {
      line(fmt::format("finished: {}, {} of run time", at, format_seconds(now.wall_seconds)));
      return exit_ok;
    }
    if (now.status == "stopped") {
      line(fmt::format("stopped: {}: {}", at, now.message));
      return exit_stopped;
    }
    clear();
    const std::string why =
        now.status == "lost" ? "its process does not exist any more; continue with --restart latest"
                             : now.message;
    std::fputs((printable_lines(fmt::format("failed: {}: {}", at, why)) + "\n").c_str(), stderr);
    return exit_simulation;
  }

  void clear() {
    if (shown_) std::fputs("\r\033[K", stdout);
    shown_ = false;
  }
  void line(const std::string& text) {
    clear();
    std::fputs((printable_lines(text) + "\n").c_str(), stdout);
    std::fflush(stdout);
  }

  const WatchArguments& arguments_;
  bool terminal_, shown_ = false;
  std::optional<Seen> begin_;
  std::optional<RunProgress> last_;
};

}  // namespace

Action add_watch(CLI::App& command) {
  const auto arguments = std::make_shared<WatchArguments>();
  command.add_option("RUN", arguments->run, "Run folder")->required();
  command.add_option("--every", arguments->every, "Seconds between two looks")
      ->check(CLI::Range(0.1, 86400.0))
      ->capture_default_str();
  return [arguments](const Words&) {
    refuse_several_ranks("watch");
    return Watch(*arguments).follow();
  };
}

}  // namespace lahar
