/// \file A forked process to talk with. The parent must have a single thread.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>

namespace lahar {

/// A forked process and a pipe in each direction, over which texts travel.
class ChildProcess {
 public:
  /// `work` runs in the child; a failure there is thrown by the parent's receive().
  explicit ChildProcess(const std::function<void(ChildProcess&)>& work);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();  ///< ends the child and waits for it

  void send(const std::string& text);
  /// Waits. Throws what the child threw, or IoError if it was killed.
  std::string receive();

 private:
  [[noreturn]] void run_child(const std::function<void(ChildProcess&)>& work);
  [[noreturn]] void explain_end();
  pid_t child_ = -1;
  int in_ = -1, out_ = -1;
};

}  // namespace lahar
