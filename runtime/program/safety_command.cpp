/// \file `lahar safety`: the factor of safety by strength reduction.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "io/base/atomic_file.h"
#include "io/base/memory_limit.h"
#include "io/base/team.h"
#include "io/scenario/stages.h"
#include "runtime/program/case_run.h"
#include "runtime/program/commands.h"
#include "runtime/program/run_description.h"
#include "runtime/program/safety_run.h"
#include "runtime/program/signals.h"
#include "runtime/program/stages_run.h"
#include "runtime/step/restart.h"
#include "runtime/terminal/console.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

struct SafetyOptions {
  RunArguments run;
  SafetyBounds bounds;
};

Scenario read(const RunArguments& arguments, std::size_t stage) {
  ScenarioOptions options = arguments.options;
  options.stage = stage;
  options.memory = arguments.execution.memory;
  return read_scenario(arguments.scenario, options);
}

/// The run of the scenario with full strength. Returns the exit status.
int come_to_rest(const RunArguments& given, Scenario scenario, const fs::path& folder) {
  Console console(voice_of(given));  // with the log of its run folder
  RunArguments arguments = given;
  arguments.output = folder.string();
  arguments.checkpoint_minutes = 1e6;  // there is one at the end
  return run_scenario(
      arguments, [&](std::size_t k) { return read(arguments, k); }, std::move(scenario), console);
}

std::string table_of(const SafetyResult& result) {
  std::string text = "factor,stable,iterations,displacement\n";
  for (const SafetyTrial& trial : result.trials)
    text += fmt::format("{},{},{},{}\n", trial.factor, trial.stable ? 1 : 0, trial.iterations,
                        trial.displacement >= 0 ? fmt::format("{}", trial.displacement) : "");
  return text;
}

SafetyTrial tell(const SafetyTrial& trial, Console& console) {
  std::string line = fmt::format("{:8.4f}  {:12} {:4} iterations", trial.factor,
                                 trial.stable ? "equilibrium" : "fails", trial.iterations);
  if (trial.displacement >= 0) line += fmt::format("   moves by {:.4g} m", trial.displacement);
  console.line(line);
  return trial;
}

void tell_result(const SafetyResult& result, const SafetyBounds& bounds, Console& console) {
  if (!result.fails)
    return console.line(
        fmt::format("the factor of safety is above {}; --most raises the bound", bounds.most));
  console.line(fmt::format(
      "factor of safety {:.4g}: equilibrium with strength / {:.4g}, none with strength / {:.4g}",
      result.factor(), result.stable, *result.fails));
}

int safety_command(const SafetyOptions& given) {
  RunArguments arguments = given.run;
  watch_signals();
  arguments.execution.memory = memory_limit(arguments.memory, 1);
  Console console(voice_of(arguments));
  Scenario first = read(arguments, 0);
  const std::size_t last = first.stages.empty() ? 0 : first.stages.size() - 1;
  check_safety(last == 0 ? first : read(arguments, last));
  const std::string name = first.stages.empty() ? "" : first.stages[last];
  const fs::path folder = arguments.output.empty()
                              ? outline_of(first.model).output.folder + "-safety"
                              : arguments.output;
  const fs::path rest = folder / "equilibrium";
  if (const int code = come_to_rest(arguments, std::move(first), rest)) {
    console.warn(
        "lahar: error: there is no equilibrium with full strength to begin with: the "
        "factor of safety is below 1, or the run has another cause to fail (see above).");
    return code;
  }
  const auto no_warning = [](const std::string&) {};
  SafetyTrials trials(
      arguments, [&] { return read(arguments, last); },
      open_checkpoint("latest", name.empty() ? rest : rest / name, arguments.execution.ranks,
                      no_warning));
  console.line("\n  factor  strength / factor");
  const SafetyResult result =
      find_factor(given.bounds, [&](double factor) { return tell(trials(factor), console); });
  write_text_file(folder / "safety.csv", table_of(result));
  if (result.stable > 1) trials.write_run(result.stable, folder / "mechanism");
  console.line("");
  tell_result(result, given.bounds, console);
  console.line(fmt::format("trials     {}", (folder / "safety.csv").string()));
  if (result.stable > 1)
    console.line(fmt::format("mechanism  {}: displacements from full strength to strength / {:.4g}",
                             (folder / "mechanism").string(), result.stable));
  return exit_ok;
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
      .add_option("--tolerance", options->bounds.tolerance,
                  "Width of the bracket of the factor, as a share of it")
      ->check(CLI::Range(1e-6, 0.5))
      ->default_str("0.01");
  command.add_option("--most", options->bounds.most, "Largest factor that is looked for")
      ->check(CLI::Range(1.01, 1e6))
      ->default_str("16");
  command.add_flag("--quiet,-q", run.quiet, "Print only warnings and errors");
  return [options](const Words& words) {
    refuse_several_ranks("safety");
    options->run.command = words;
    return safety_command(*options);
  };
}

}  // namespace lahar
