#include "runtime/terminal/console.h"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "runtime/base/launcher.h"
#include "runtime/comm/communicator.h"
#include "runtime/program/startup_progress.h"

using namespace lahar;

// An adaptive run may take more steps than its first one promised.
TEST_CASE("the bar is full at the end and stays full beyond it") {
  const std::string empty(40, ' '), half = std::string(20, '=') + std::string(20, ' '),
                                    full(40, '=');
  CHECK(progress_bar(0, 1e6) == "  [" + empty + "]   0 %  1.0 M particle-steps/s ");
  CHECK(progress_bar(0.5, 1e6) == "  [" + half + "]  50 %  1.0 M particle-steps/s ");
  CHECK(progress_bar(1, 1e6) == "  [" + full + "] 100 %  1.0 M particle-steps/s ");
  CHECK(progress_bar(1.7, 1e6) == progress_bar(1, 1e6));
  CHECK(progress_bar(-1, 1e6) == progress_bar(0, 1e6));
}

TEST_CASE("counts have separators, times the unit that suits them") {
  CHECK(format_count(7) == "7");
  CHECK(format_count(40155) == "40,155");
  CHECK(format_count(-1234567) == "-1,234,567");
  CHECK(format_seconds(3.14159) == "3.1 s");
  CHECK(format_seconds(125) == "2 min 05 s");
  CHECK(format_seconds(7260) == "2 h 01 min");
  CHECK(format_bytes(512) == "512 B");
  CHECK(format_bytes(1.5 * 1024 * 1024) == "1.5 MiB");
}

TEST_CASE("the log has no escape codes") {
  CHECK(without_colours("plain\n") == "plain\n");
  CHECK(without_colours("\033[1ma.json\033[0m:3: \033[1;31merror:\033[0m no m") ==
        "a.json:3: error: no m");
  CHECK(without_colours("\033[1") == "");
  CHECK(without_colours("") == "");
}

TEST_CASE("below a launcher of MPI nobody looks at the terminal that ranks are given") {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE(terminal >= 0);
  const char* kind = std::getenv("TERM");
  const std::string before = kind ? kind : "";
  unsetenv("OMPI_COMM_WORLD_SIZE");
  setenv("TERM", "xterm", 1);
  if (!is_launched()) {
    CHECK(is_terminal(terminal));
    setenv("TERM", "dumb", 1);
    CHECK(!is_terminal(terminal));
    setenv("TERM", "xterm", 1);
    setenv("OMPI_COMM_WORLD_SIZE", "1", 1);
    CHECK(!is_terminal(terminal));
    CHECK(!use_colour(terminal));
    setenv("LAHAR_TERMINAL", "1", 1);
    CHECK(is_terminal(terminal));
    unsetenv("OMPI_COMM_WORLD_SIZE");
    setenv("LAHAR_TERMINAL", "0", 1);
    CHECK(!is_terminal(terminal));
    unsetenv("LAHAR_TERMINAL");
  }
  setenv("TERM", before.c_str(), 1);
  close(terminal);
}

namespace {

/// What a start whose parts take so many milliseconds says on standard error, which is a pipe.
std::string said_by_start(bool shown, int first, int second) {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  std::fflush(stderr);
  const int before = dup(STDERR_FILENO);
  dup2(ends[1], STDERR_FILENO);
  {
    StartupProgress progress(shown);
    progress.phase("mesh\x1b");
    std::this_thread::sleep_for(std::chrono::milliseconds(first));
    progress.phase("particles");
    std::this_thread::sleep_for(std::chrono::milliseconds(second));
  }
  std::fflush(stderr);
  dup2(before, STDERR_FILENO);
  close(before);
  close(ends[1]);
  std::string text(4096, '\0');
  const ssize_t size = read(ends[0], text.data(), text.size());
  close(ends[0]);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  return text;
}

}  // namespace

TEST_CASE(
    "a start that takes more than a second says what it does, in plain lines outside terminals") {
  CHECK(said_by_start(true, 50, 50) == "");
  CHECK(said_by_start(false, 1500, 0) == "");
  const std::string said = said_by_start(true, 1900, 50);
  CHECK(said.starts_with("starting   mesh\\x1b, "));
  CHECK(said.find("particles") == std::string::npos);
  CHECK(said.find('\x1b') == std::string::npos);
  CHECK(said.find('\n') == said.size() - 1);
}
