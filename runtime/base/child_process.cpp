#include "runtime/base/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <new>
#include <thread>

#include "physics/base/error.h"

namespace lahar {

namespace {

void write_all(int file, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = write(file, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw IoError("the connection to a measuring process is lost");
    data += n;
    size -= static_cast<std::size_t>(n);
  }
}

/// False at the end of the pipe.
bool read_all(int file, char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t n = read(file, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    data += n;
    size -= static_cast<std::size_t>(n);
  }
  return true;
}

/// Close what a child has of other children's pipes: they wait for these to end.
void close_all_but(int a, int b) {
  const auto low = static_cast<unsigned>(std::min(a, b)),
             high = static_cast<unsigned>(std::max(a, b));
  constexpr unsigned first = STDERR_FILENO + 1;
  if (low > first) close_range(first, low - 1, 0);
  if (high > low + 1) close_range(low + 1, high - 1, 0);
  close_range(high + 1, ~0u, 0);
}

/// What a text from the child is.
enum Kind : char {
  answer = 'a',
  input_error = 'i',
  io_error = 'f',
  simulation_error = 's',
  other_error = 'o'
};

}  // namespace

ChildProcess::ChildProcess(const std::function<void(ChildProcess&)>& work) {
  int to_child[2], to_parent[2];
  if (pipe2(to_child, O_CLOEXEC) != 0 || pipe2(to_parent, O_CLOEXEC) != 0)
    throw IoError("cannot make a pipe");
  std::signal(SIGPIPE, SIG_IGN);  // a child that ended is reported by receive()
  std::fflush(nullptr);
  child_ = fork();
  if (child_ < 0) throw IoError("cannot start a process");
  if (child_ == 0) {
    in_ = to_child[0];
    out_ = to_parent[1];
    close_all_but(in_, out_);
    run_child(work);
  }
  close(to_child[0]);
  close(to_parent[1]);
  in_ = to_parent[0];
  out_ = to_child[1];
}

void ChildProcess::run_child(const std::function<void(ChildProcess&)>& work) {
  const auto report = [&](Kind kind, const std::string& text) {
    const std::uint64_t size = text.size() + 1;
    write_all(out_, reinterpret_cast<const char*>(&size), sizeof size);
    write_all(out_, std::string(1, kind).append(text).data(), size);
  };
  try {
    try {
      work(*this);
    } catch (const InputError& error) {
      report(input_error, error.what());
    } catch (const IoError& error) {
      report(io_error, error.what());
    } catch (const SimulationError& error) {
      report(simulation_error, error.what());
    } catch (const std::bad_alloc&) {
      report(io_error, "not enough memory for this benchmark");
    } catch (const std::exception& error) {
      report(other_error, error.what());
    }
  } catch (...) {  // nobody listens any more
  }
  _exit(0);  // what belongs to the parent (its streams, its handlers) is not ours to end
}

ChildProcess::~ChildProcess() {
  close(in_);
  close(out_);  // a child that waits for a command tidies up and ends
  constexpr std::chrono::milliseconds patience(10'000), pause(1);
  for (auto waited = pause * 0; waited < patience; waited += pause) {
    if (waitpid(child_, nullptr, WNOHANG) != 0) return;
    std::this_thread::sleep_for(pause);
  }
  kill(child_, SIGKILL);
  waitpid(child_, nullptr, 0);
}

void ChildProcess::send(const std::string& text) {
  const std::uint64_t size = text.size() + 1;
  std::string message(reinterpret_cast<const char*>(&size), sizeof size);
  message += answer;
  message += text;
  try {
    write_all(out_, message.data(), message.size());
  } catch (const IoError&) {
    // A child that failed has said why; receive() finds it.
  }
}

std::string ChildProcess::receive() {
  std::uint64_t size = 0;
  if (!read_all(in_, reinterpret_cast<char*>(&size), sizeof size)) explain_end();
  std::string message(size, '\0');
  if (!read_all(in_, message.data(), size)) explain_end();
  const std::string text = message.substr(1);
  switch (message[0]) {
    case input_error:
      throw InputError(text);
    case io_error:
      throw IoError(text);
    case simulation_error:
      throw SimulationError(text);
    case other_error:
      throw std::runtime_error(text);
    default:
      return text;
  }
}

void ChildProcess::explain_end() {
  siginfo_t end{};
  if (child_ > 0 && waitid(P_PID, static_cast<id_t>(child_), &end, WEXITED | WNOWAIT) == 0 &&
      end.si_code != CLD_EXITED)
    throw IoError(fmt::format(
        "a measuring process was killed by signal {}; signal 9 usually means that memory ran out",
        end.si_status));
  throw IoError("a measuring process ended too early");
}

}  // namespace lahar
