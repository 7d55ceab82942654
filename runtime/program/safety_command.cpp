/// \file `lahar safety`: the factor of safety by strength reduction.
#include <memory>

#include "runtime/comm/rank_team.h"
#include "runtime/program/commands.h"
#include "runtime/program/ranks_begin.h"
#include "runtime/program/safety_search.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

struct SafetyOptions {
  RunArguments run;
  SafetyBounds bounds;
};

Scenario read(const RunArguments& arguments, const Team& team, std::size_t stage) {
  ScenarioOptions options = arguments.options;
  options.stage = stage;
  options.team = &team;
  options.memory = arguments.execution.memory;
  return read_scenario(arguments.scenario, options);
}

int safety_command(const SafetyOptions& given) {
  RunArguments arguments = given.run;
  end_before_steps(arguments, !arguments.restart.empty());
  check_alike(arguments);
  arguments.execution.memory = limit_of_ranks(arguments);
  const RankTeam team(arguments.execution.ranks);
  Console console(voice_of(arguments));
  return find_safety(
      arguments, given.bounds, [&](std::size_t stage) { return read(arguments, team, stage); },
      console);
}

}  // namespace

Action add_safety(CLI::App& command) {
  const auto options = std::make_shared<SafetyOptions>();
  RunArguments& run = options->run;
  add_scenario(command, run.scenario, run.options);
  command.add_option("--threads,-t", run.execution.threads, "Threads (default: all cores)")
      ->check(CLI::Range(1, 4096));
  command.add_option("--output,-o", run.output,
                     "Folder of the results (default: that of the run, with -safety)");
  command.add_flag("--overwrite", run.overwrite, "Replace earlier results in this folder");
  command
      .add_option("--restart", run.restart,
                  "Continue the search in its folder: with the trials that it has")
      ->check(CLI::IsMember({"latest"}))
      ->type_name("latest")
      ->excludes("--overwrite");
  command
      .add_option("--tolerance", options->bounds.tolerance,
                  "Width of the bracket of the factor, as a share of it")
      ->check(CLI::Range(1e-6, 0.5))
      ->default_str("0.01");
  command.add_option("--most", options->bounds.most, "Largest factor that is looked for")
      ->check(CLI::Range(1.01, 1e6))
      ->default_str("16");
  command.add_flag("--quiet,-q", run.quiet, "Print only warnings and errors");
  return [options](const Words& words) {
    options->run.command = words;
    options->run.execution.ranks = Communicator::world();
    return safety_command(*options);
  };
}

}  // namespace lahar
