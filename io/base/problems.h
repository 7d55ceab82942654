/// \file The list that collects every problem of a scenario and its side files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "physics/base/error.h"

namespace lahar {

/// Errors and warnings in the order in which they were found. At most `cap` errors are kept, the
/// rest is counted: a file with a million bad lines has one cause, and one screen shows it.
class ProblemList {
 public:
  static constexpr std::size_t cap = 100;

  void error(Problem problem);
  void warning(Problem problem) { warnings_.push_back(std::move(problem)); }

  bool empty() const { return errors_.empty(); }
  std::size_t count() const { return errors_.size() + dropped_; }
  /// The errors kept, in the order in which they were found, and how many were not.
  const std::vector<Problem>& kept() const { return errors_; }
  std::size_t dropped() const { return dropped_; }
  void drop(std::size_t more) { dropped_ += more; }
  /// The errors: the command line's, those of `file` in its order, then the side files'; the last
  /// one says how many more there are, if so.
  std::vector<Problem> errors(const std::string& file) const;
  std::vector<Problem> take_warnings() { return std::move(warnings_); }

 private:
  std::vector<Problem> errors_, warnings_;
  std::size_t dropped_ = 0;
};

/// The candidate that a misspelt name most likely means: smallest edit distance (insertion,
/// deletion, substitution, swap of neighbours; case ignored), at most a third of the length;
/// empty if none is near.
std::string nearest(std::string_view name, const std::vector<std::string>& candidates);

/// "did you mean 'x'?", or "<what>: a, b, c" where nothing is near.
std::string suggest(std::string_view name, const std::vector<std::string>& candidates,
                    std::string_view what);

/// a, b, c
std::string join(const std::vector<std::string>& words, std::string_view separator = ", ");

/// Compiler-like text of problems (file:line:column: error: ..., the line, a caret, a hint).
std::string format_problems(const std::vector<Problem>& problems, const char* severity = "error",
                            bool colour = false);

}  // namespace lahar
