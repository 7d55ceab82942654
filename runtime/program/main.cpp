/// \file The program: one place that turns errors into messages and exit codes. What it can do is
/// in commands.h.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string_view>
#include <system_error>

#include "io/base/text.h"
#include "physics/base/error.h"
#include "runtime/comm/communicator.h"
#include "runtime/program/commands.h"
#include "runtime/program/processor_level.h"
#include "runtime/program/signals.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

/// Says what went wrong, on all ranks that know; returns the exit code.
int leave(int code, const std::string& message) {
  MpiSession::leave(code, message);
  return code;
}

constexpr const char* no_memory =
    "lahar: error: not enough memory. Use fewer cells or particles; `lahar check` prints the sizes "
    "of a case.\n";

/// Libraries ask for memory where they may not throw: in destructors, for instance.
[[noreturn]] void end_at_once() {
  if (const auto exception = std::current_exception()) try {
      std::rethrow_exception(exception);
    } catch (const std::bad_alloc&) {
      std::fputs(no_memory, stderr);
      std::_Exit(exit_file);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "lahar: internal error: %s\n", error.what());
    } catch (...) {
    }
  std::abort();
}

int leave_without_thread() {
  return leave(exit_file,
               "lahar: error: the system starts no more threads. Use fewer (--threads), or raise "
               "the limit of processes (ulimit -u).\n");
}

int guarded(int argc, char** argv) {
  try {
    const int code = run_program(commands, Words(argv, argv + argc));
    if (std::fflush(stdout) != 0 || std::ferror(stdout))
      throw IoError("standard output could not be written");
    return code;
  } catch (const InputError& error) {
    return leave(exit_input, format_problems(error.problems(), "error", use_colour(STDERR_FILENO)));
  } catch (const IoError& error) {
    return leave(exit_file, fmt::format("lahar: error: {}\n", printable_lines(error.what())));
  } catch (const SimulationError& error) {
    return leave(exit_simulation, fmt::format("lahar: error: {}\n", printable_lines(error.what())));
  } catch (const RankError& error) {
    return leave(exit_rank, fmt::format("lahar: error: {}\n", printable_lines(error.what())));
  } catch (const std::bad_alloc&) {
    return leave(exit_file, no_memory);
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) return leave_without_thread();
    return leave(exit_file, fmt::format("lahar: error: {}\n", printable_lines(error.what())));
  } catch (const std::exception& error) {
    if (std::string_view(error.what()).starts_with("pthread_create")) return leave_without_thread();
    return leave(exit_internal,
                 fmt::format("lahar: internal error: {}\n", printable_lines(error.what())));
  }
}

}  // namespace

}  // namespace lahar

int main(int argc, char** argv) {
  lahar::become_best_level(argv);
  std::set_terminate(lahar::end_at_once);
  lahar::ignore_file_size_signal();  // before MPI makes files of its own
  try {
    const lahar::MpiSession session(argc, argv);
    return lahar::guarded(argc, argv);
  } catch (const lahar::RankError& error) {
    fmt::print(stderr, "lahar: error: {}\n", error.what());
    return lahar::exit_rank;
  }
}
