/// \file What a run says on the terminal and in its log.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "io/base/text.h"
#include "io/run/history.h"
#include "physics/base/error.h"

namespace lahar {

/// Who hears what a run says, where another program than `lahar` runs it.
struct ConsoleListener {
  std::function<void(const std::string&)> line = {}, warn = {};
};

/// Lines go to standard output (unless quiet) and to the log. On a terminal a bar shows progress.
class Console {
 public:
  enum class Voice { normal, quiet, silent };  ///< silent: not even warnings, as on most ranks
  /// A listener, if there is one, takes the place of standard output and standard error.
  explicit Console(Voice voice, ConsoleListener listener = {});
  explicit Console(bool quiet) : Console(quiet ? Voice::quiet : Voice::normal) {}
  /// Also hand every line to `sink` from now on; lines said before are handed over at once.
  void log_to(std::function<void(const std::string&)> sink);
  /// Text may have what was in the input: it is shown as printable_lines().
  void line(const std::string& text);
  void warn(const std::string& text);  ///< to standard error, also when quiet
  void warn(const std::vector<Problem>& warnings);
  /// Redraw the bar (terminals only, a few times a second).
  void bar(double share, double rate);
  void clear_bar();

 private:
  void keep(const std::string& text);
  void tell(const std::string& text);

  Voice voice_;
  ConsoleListener listener_;
  bool terminal_;
  bool bar_shown_ = false;
  std::chrono::steady_clock::time_point last_bar_{};
  std::vector<std::string> early_;
  std::function<void(const std::string&)> sink_;
};

/// True if somebody looks at a terminal there, which knows escape codes. Launchers of MPI give
/// ranks a terminal wherever their own output goes, so below one it is false. LAHAR_TERMINAL (0 or
/// 1) says otherwise.
bool is_terminal(int file_descriptor);

/// True if messages may have colours: a terminal, and NO_COLOR not set.
bool use_colour(int file_descriptor);

/// A text without the escape codes of colours.
std::string without_colours(const std::string& text);

std::string format_seconds(double seconds);

/// A bar filled to `share` (0 to 1; what is beyond is moved there), and particle-steps per second.
std::string progress_bar(double share, double rate);

/// Column heads and one line of the progress table.
std::string progress_head();
std::string progress_line(const HistoryRow& row, double energy_scale, double rate,
                          double seconds_left);

}  // namespace lahar
