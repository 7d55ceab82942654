// The command line: which command is asked for.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "physics/base/error.h"
#include "runtime/comm/communicator.h"
#include "runtime/program/command_errors.h"
#include "runtime/program/commands.h"
#include "runtime/terminal/version.h"

namespace lahar {

void add_scenario(CLI::App& command, std::string& scenario, ScenarioOptions& options) {
  command.add_option("SCENARIO", scenario, "Scenario file (JSON)")->required();
  command
      .add_option("--set", options.overrides,
                  "Replace a value: analysis.nsteps=100 or /analysis/nsteps=100 (repeatable)")
      ->type_name("KEY=VALUE");
  command
      .add_option("--folder,-f", options.folder,
                  "Folder for relative file names in the scenario (default: the scenario's folder)")
      ->type_name("FOLDER");
  command.add_flag("--as-cbgeo", options.as_cbgeo,
                   "Run what CB-Geo MPM would run (it ignores \"stress_update\", for example)");
}

std::function<std::string(const std::string&)> step_or(std::vector<std::string> words) {
  return [words = std::move(words)](const std::string& text) -> std::string {
    const bool number = !text.empty() && text.size() < 19 &&
                        text.find_first_not_of("0123456789") == std::string::npos;
    if (number || std::find(words.begin(), words.end(), text) != words.end()) return "";
    return fmt::format("must be a step, {}", fmt::join(words.rbegin(), words.rend(), " or "));
  };
}

std::string above_zero(const std::string& text) {
  double value = 0;
  const bool number = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
  return number && value > 0 ? "" : fmt::format("must be a number above 0, found '{}'", text);
}

std::string not_below_zero(const std::string& text) {
  double value = 0;
  const bool number = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
  return number && value >= 0 ? ""
                              : fmt::format("must be 0 or a number above it, found '{}'", text);
}

void refuse_several_ranks(const char* command) {
  if (const Communicator ranks = Communicator::world(); ranks.several())
    throw InputError(
        fmt::format("`lahar {}` is not for several ranks, found {}; only `lahar run` is. Start it "
                    "without mpirun.",
                    command, ranks.size()));
}

int run_program(std::span<const Command> known, const Words& words) {
  CLI::App app{
      "Material Point Method engine: large deformations of soils, fluids and solids.\n"
      "A time step is a graph of tasks over patches of the mesh. Results are bitwise identical\n"
      "for any number of threads and MPI ranks (mpirun lahar run ...).",
      "lahar"};
  app.set_version_flag("--version", "lahar " + version_line());
  app.require_subcommand(1);
  app.footer(
      "Start with:  lahar run examples/plate-with-hole.json\n"
      "Exit codes: 0 finished, 1 internal error or comparison failed, 2 invalid input,\n"
      "3 simulation failed, 4 file not read or written, 5 MPI ranks are incompatible or one was\n"
      "lost, 75 stopped on request.");
  int code = exit_ok;
  for (const Command& command : known) {
    CLI::App* options = app.add_subcommand(command.name, command.help);
    options->callback([&, action = command.add_options(*options)] { code = action(words); });
  }
  try {
    std::vector<const char*> texts;
    for (const std::string& word : words) texts.push_back(word.c_str());
    app.parse(static_cast<int>(texts.size()), texts.data());
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) throw InputError(argument_problems(app, error));
    if (Communicator::world().rank() == 0) app.exit(error);  // help, version
  }
  return code;
}

}  // namespace lahar
