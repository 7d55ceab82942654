#include "runtime/terminal/console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "io/base/problems.h"
#include "runtime/base/launcher.h"

namespace lahar {

bool is_terminal(int file_descriptor) {
  if (const char* told = std::getenv("LAHAR_TERMINAL"); told && *told)
    return std::string_view(told) != "0";
  const char* kind = std::getenv("TERM");
  return isatty(file_descriptor) && !is_launched() && !(kind && std::string_view(kind) == "dumb");
}

bool use_colour(int file_descriptor) {
  const char* no_color = std::getenv("NO_COLOR");
  return is_terminal(file_descriptor) && !(no_color && *no_color);
}

std::string without_colours(const std::string& text) {
  std::string plain;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t escape = std::min(text.find("\033[", at), text.size());
    plain.append(text, at, escape - at);
    at = std::min(text.find('m', escape), text.size() - 1) + 1;
  }
  return plain;
}

Console::Console(Voice voice, ConsoleListener listener)
    : voice_(voice),
      listener_(std::move(listener)),
      terminal_(!listener_.line && is_terminal(STDOUT_FILENO)) {}

void Console::log_to(std::function<void(const std::string&)> sink) {
  sink_ = std::move(sink);
  for (const std::string& text : early_) sink_(text);
  early_.clear();
}

void Console::keep(const std::string& text) {
  if (sink_)
    sink_(text);
  else
    early_.push_back(text);
}

void Console::line(const std::string& said) {
  clear_bar();
  const std::string text = printable_lines(said);
  if (listener_.line) {
    listener_.line(text);
  } else if (voice_ == Voice::normal) {
    std::fputs((text + "\n").c_str(), stdout);
    std::fflush(stdout);
  }
  keep(text);
}

void Console::warn(const std::string& text) {
  tell(printable_lines(text));
}

void Console::warn(const std::vector<Problem>& warnings) {
  const bool colour = !listener_.warn && use_colour(STDERR_FILENO);
  tell(format_problems(warnings, "warning", colour));
}

/// Safe text, perhaps with colours.
void Console::tell(const std::string& text) {
  clear_bar();
  const std::string end = text.ends_with('\n') ? "" : "\n";
  if (listener_.warn)
    listener_.warn(text);
  else if (voice_ != Voice::silent)
    std::fputs((text + end).c_str(), stderr);
  keep(without_colours(text));
}

std::string progress_bar(double share, double rate) {
  constexpr int width = 40;
  share = std::clamp(share, 0.0, 1.0);
  const int full = static_cast<int>(share * width);
  return fmt::format("  [{:=<{}}{: <{}}] {:3.0f} %  {:.1f} M particle-steps/s ", "", full, "",
                     width - full, 100 * share, rate * 1e-6);
}

void Console::bar(double share, double rate) {
  constexpr auto redraw_every = std::chrono::milliseconds(200);
  const auto now = std::chrono::steady_clock::now();
  if (voice_ != Voice::normal || !terminal_ || now - last_bar_ < redraw_every) return;
  last_bar_ = now;
  std::fputs(("\r" + progress_bar(share, rate)).c_str(), stdout);
  std::fflush(stdout);
  bar_shown_ = true;
}

void Console::clear_bar() {
  if (!bar_shown_) return;
  std::fputs("\r\033[K", stdout);
  bar_shown_ = false;
}

std::string format_seconds(double seconds) {
  if (!std::isfinite(seconds)) return "?";
  if (seconds < 100) return fmt::format("{:.1f} s", seconds);
  const auto s = static_cast<long>(seconds);
  if (s < 3600) return fmt::format("{} min {:02} s", s / 60, s % 60);
  return fmt::format("{} h {:02} min", s / 3600, s / 60 % 60);
}

std::string progress_head() {
  return fmt::format("{:>12} {:>11} {:>10} {:>12} {:>13} {:>12} {:>10}", "step", "time [s]",
                     "dt [s]", "kinetic [J]", "energy drift", "Mpart-st/s", "left");
}

std::string progress_line(const HistoryRow& row, double energy_scale, double rate,
                          double seconds_left) {
  constexpr double rounding = 1e-20;  // [J/kg] of material at rest
  const std::string drift = energy_scale > rounding * row.mass
                                ? fmt::format("{:.2e}", row.balance / energy_scale)
                                : std::string("-");
  return fmt::format("{:>12} {:>11.5g} {:>10.3g} {:>12.4g} {:>13} {:>12.1f} {:>10}",
                     format_count(row.step), row.time, row.dt, row.kinetic, drift, rate * 1e-6,
                     format_seconds(seconds_left));
}

}  // namespace lahar
