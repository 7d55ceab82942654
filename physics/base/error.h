/// \file The kinds of failure a user can meet, and the exit code of each.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace lahar {

/// One mistake in the input: where, what was found, what is allowed, what to do.
struct Problem {
  std::string file = {};     ///< as the user wrote it; empty for the command line
  int line = 0;              ///< 1-based; 0 = the file as a whole
  int column = 0;            ///< 1-based; 0 = the line as a whole
  std::string where = {};    ///< JSON pointer, for JSON files
  std::string message = {};  ///< found / allowed, one sentence
  std::string hint = {};     ///< what to do ("did you mean ..."), may be empty
  std::string source = {};   ///< the offending line, for the caret display; may be empty
};

/// Invalid command line, scenario or side file; carries every problem found (exit code 2).
class InputError : public std::runtime_error {
 public:
  explicit InputError(std::vector<Problem> problems)
      : std::runtime_error(problems.empty() ? "invalid input" : problems.front().message),
        problems_(std::move(problems)) {}
  explicit InputError(const std::string& message) : InputError({Problem{.message = message}}) {}
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

/// A file cannot be read or written (exit code 4).
class IoError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The simulation itself failed: lost particle, NaN, unstable step (exit code 3).
class SimulationError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The ranks of a run cannot work together: one was lost, or they are not alike (exit code 5).
class RankError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace lahar
