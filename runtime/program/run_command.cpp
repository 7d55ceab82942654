/// \file `lahar run` and `lahar check`.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <span>

#include "io/base/sha256.h"
#include "lahar_version.h"
#include "runtime/comm/rank_team.h"
#include "runtime/program/case_run.h"
#include "runtime/program/commands.h"
#include "runtime/program/run_description.h"
#include "runtime/program/signals.h"
#include "runtime/program/startup_progress.h"
#include "runtime/terminal/console.h"
#include "runtime/terminal/version.h"

namespace lahar {

namespace {

Scenario read(const RunArguments& arguments, Console& console, const Team* team = nullptr) {
  ScenarioOptions options = arguments.options;
  options.team = team;
  options.memory = arguments.execution.memory;
  Scenario scenario = [&] {
    StartupProgress progress(arguments.execution.ranks.rank() == 0 && !arguments.quiet);
    options.phase = [&](const std::string& text) { progress.phase(text); };
    return read_scenario(arguments.scenario, options);
  }();
  if (!scenario.warnings.empty()) console.warn(scenario.warnings);
  return scenario;
}

/// All ranks must compute the same, to the last bit, or the result would be nobody's. Before the
/// scenario is read, which they do together.
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

/// What each rank may take: the least of all ranks, so that all decide alike.
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

}  // namespace

int run_command(const RunArguments& given) {
  RunArguments arguments = given;
  watch_signals();
  Console console(arguments.execution.ranks.rank() > 0 ? Console::Voice::silent
                  : arguments.quiet                    ? Console::Voice::quiet
                                                       : Console::Voice::normal);
  console.line("Lahar " + version_line());
  console.line("built with " + compiler_line());
  check_alike(arguments);
  arguments.execution.memory = limit_of_ranks(arguments);
  const RankTeam team(arguments.execution.ranks);
  Scenario scenario = read(arguments, console, &team);
  return CaseRun(arguments, scenario, console).execute();
}

int check_command(const RunArguments& given) {
  RunArguments arguments = given;
  arguments.execution.memory = memory_limit(arguments.memory, 1);
  Console console(false);
  Scenario scenario = read(arguments, console);
  const ModelOutline outline = outline_of(scenario.model);
  const Simulation simulation = [&] {
    StartupProgress progress(true);
    progress.phase("patches and particles");
    return make_simulation(scenario, arguments.execution);
  }();
  const SimulationInfo info = simulation.info();
  describe(console, outline, info);
  describe_frames(console, outline.output, outline.analysis, info);
  console.line(fmt::format("output     {}", outline.output.folder));
  if (arguments.ranks > 0)
    describe_ranks(console, simulation.patch_graph(), simulation.patch_counts(), arguments.ranks,
                   arguments.partitioner);
  console.line(fmt::format("next: lahar run {}", arguments.scenario));
  return exit_ok;
}

}  // namespace lahar
