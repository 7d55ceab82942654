#include "runtime/program/ranks_begin.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "io/base/sha256.h"
#include "runtime/terminal/version.h"

namespace lahar {

void check_alike(const RunArguments& arguments) {
  const Communicator& ranks = arguments.execution.ranks;
  if (!ranks.several()) return;
  std::string options;  // but for the program's name, and for threads, which may differ
  for (std::size_t k = 1; k < arguments.command.size(); ++k) {
    const std::string& word = arguments.command[k];
    if (word == "-t" || word == "--threads")
      ++k;
    else if (!word.starts_with("-t") && !word.starts_with("--threads="))
      options += word + "\n";
  }
  std::string scenario;
  try {
    scenario = sha256_of_file(arguments.scenario);
  } catch (const IoError&) {
    // Reading it says so.
  }
  const std::array texts{version_line() + compiler_line(), scenario, options};
  const std::array names{"programs (version, commit or compiler)", "scenario files", "options"};
  for (std::size_t k = 0; k < texts.size(); ++k) {
    const std::string own = sha256(texts[k]);
    const std::vector<char> all = ranks.gather_all(std::span<const char>(own));
    std::string different;
    for (std::size_t r = 1; r < static_cast<std::size_t>(ranks.size()); ++r)
      if (!std::equal(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(own.size()),
                      all.begin() + static_cast<std::ptrdiff_t>(own.size() * r)))
        different += fmt::format("{}{}", different.empty() ? "" : ", ", r);
    if (!different.empty())
      throw RankError(
          fmt::format("the ranks were started with different {}: rank 0 against {}. "
                      "Start all of them with the same.",
                      names[k], different));
  }
}

void on_first_rank(const Communicator& ranks, const std::function<void()>& work) {
  std::vector<Problem> problems;
  if (ranks.rank() == 0) {
    try {
      work();
    } catch (const InputError& error) {
      problems = error.problems();
    }
  }
  if (!ranks.any(!problems.empty())) return;
  Problem problem = problems.empty() ? Problem{} : problems.front();
  ranks.broadcast(problem.message);
  ranks.broadcast(problem.hint);
  throw InputError({Problem{.message = problem.message, .hint = problem.hint}});
}

MemoryLimit limit_of_ranks(const RunArguments& arguments) {
  const Communicator& ranks = arguments.execution.ranks;
  if (!ranks.several()) return memory_limit(arguments.memory, 1);
  Communicator machine = ranks.on_machine();
  const int processes = machine.size();
  machine.release();
  MemoryLimit own = memory_limit(arguments.memory, processes);
  const auto all = ranks.gather_all(std::span<const double>(&own.bytes, 1));
  const auto least = std::min_element(all.begin(), all.end()) - all.begin();
  own.bytes = all[static_cast<std::size_t>(least)];
  ranks.broadcast(own.source, static_cast<int>(least));
  return own;
}

}  // namespace lahar
