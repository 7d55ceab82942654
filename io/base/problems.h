/// \file The list that collects every problem of a scenario and its side files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "physics/base/error.h"

namespace lahar {

/// The first problems of a kind, and how many there were besides: a file with a million bad lines
/// has one cause, and one screen shows it.
struct FirstProblems {
  static constexpr std::size_t cap = 100;

  void add(Problem problem);
  std::size_t count() const { return kept.size() + dropped; }

  std::vector<Problem> kept;
  std::size_t dropped = 0;
};

/// Errors and warnings in the order in which they were found.
class ProblemList {
 public:
  void error(Problem problem) { errors_.add(std::move(problem)); }
  void warning(Problem problem) { warnings_.add(std::move(problem)); }
  /// After those of this list.
  void add(FirstProblems errors, FirstProblems warnings);

  bool empty() const { return errors_.kept.empty(); }
  std::size_t count() const { return errors_.count(); }
  const FirstProblems& found_errors() const { return errors_; }
  const FirstProblems& found_warnings() const { return warnings_; }
  /// The errors: the command line's, those of `file` in its order, then the side files'; the last
  /// one says how many more there are, if so.
  std::vector<Problem> errors(const std::string& file) const;
  /// The warnings; the last one says how many more there are, if so.
  std::vector<Problem> take_warnings(const std::string& file);

 private:
  FirstProblems errors_, warnings_;
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
