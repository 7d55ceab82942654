#include "runtime/program/safety_search.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "io/base/atomic_file.h"
#include "io/run/run_folder.h"
#include "runtime/program/run_description.h"
#include "runtime/program/signals.h"
#include "runtime/step/restart.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

/// `lahar run` would go on with an earlier run, this does not.
void refuse_earlier_results(const RunArguments& arguments, const fs::path& folder) {
  on_first_rank(arguments.execution.ranks, [&] {
    if (!arguments.overwrite && holds_run(folder))
      throw InputError({Problem{
          .message = fmt::format("folder {} holds the results of an earlier run", folder.string()),
          .hint = "add --overwrite to replace them, or choose another folder with --output"}});
  });
}

/// The run of the scenario with full strength. Returns the exit status.
int come_to_rest(const RunArguments& given, const StagesRun::Read& read, Scenario scenario,
                 const fs::path& folder) {
  Console console(voice_of(given), given.listener);  // with the log of its run folder
  RunArguments arguments = given;
  arguments.output = folder.string();
  arguments.checkpoint_minutes = 1e6;  // there is one at the end
  return run_scenario(arguments, read, std::move(scenario), console);
}

std::string table_of(const std::vector<SafetyTrial>& trials) {
  std::string text = "factor,stable,steps,displacement [m],end\n";
  for (const SafetyTrial& trial : trials)
    text += fmt::format("{},{},{},{},{}\n", trial.factor, trial.stable() ? 1 : 0, trial.steps,
                        trial.displacement, name_of(trial.end));
  return text;
}

SafetyTrial tell(const SafetyTrial& trial, Console& console) {
  std::string line = fmt::format("{:8.4f}  {:12} {:>8} steps   moves by {:.4g} m", trial.factor,
                                 trial.stable() ? "equilibrium" : "fails",
                                 format_count(trial.steps), trial.displacement);
  if (trial.end == SafetyTrial::End::restless) line += " and does not come to rest";
  if (trial.end == SafetyTrial::End::settles) line += " and settles";
  console.line(line);
  if (!trial.problem.empty()) console.line("          " + trial.problem);
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

/// The state from which trials begin; null, with a message, where there is no equilibrium.
std::unique_ptr<CheckpointReader> equilibrium_in(const fs::path& folder, bool tests_rest,
                                                 const Communicator& ranks, Console& console) {
  auto end = open_checkpoint("latest", folder, ranks, [](const std::string&) {});
  if (!tests_rest || end->header().run.rest.reached) return end;
  console.warn(
      "lahar: error: the run with full strength has ended before it came to rest: let it take "
      "longer (analysis.end_time, nsteps), or damp it (analysis.damping).");
  return nullptr;
}

/// What `run` returns, or exit_stopped where a signal ended it.
int unless_stopped(Console& console, auto&& run) {
  try {
    return run();
  } catch (const SafetyStopped&) {
    console.warn(fmt::format("lahar: stopped by signal {}; safety.csv has the trials that ended",
                             stop_signal()));
    return exit_stopped;
  }
}

int look_for_factor(const RunArguments& arguments, const SafetyBounds& bounds,
                    const SafetyTrials& trials, const fs::path& folder, Console& console) {
  console.line("\n  factor  strength / factor");
  std::vector<SafetyTrial> made;
  const SafetyResult result = find_factor(bounds, [&](double factor) {
    made.push_back(tell(trials(factor), console));
    if (arguments.execution.ranks.rank() == 0)  // a search that is stopped leaves what it found
      write_text_file(folder / "safety.csv", table_of(made));
    return made.back();
  });
  const SafetyTrial* failure = result.failure();
  if (failure) trials.write_run(*failure, folder / "mechanism");
  console.line("");
  tell_result(result, bounds, console);
  console.line(fmt::format("trials     {}", (folder / "safety.csv").string()));
  if (failure)
    console.line(
        fmt::format("mechanism  {}: displacements from full strength on, strength / {:.4g}",
                    (folder / "mechanism").string(), failure->factor));
  return exit_ok;
}

}  // namespace

int find_safety(const RunArguments& arguments, const SafetyBounds& bounds,
                const StagesRun::Read& read, Console& console) {
  const Communicator& ranks = arguments.execution.ranks;
  Scenario first = read(0);
  const std::size_t last = first.stages.empty() ? 0 : first.stages.size() - 1;
  const auto [tests_rest, strength] = [&] {
    const Scenario later = last == 0 ? Scenario() : read(last);
    const Scenario& of_trials = last == 0 ? first : later;
    const bool tests = check_safety(of_trials, ranks);
    return std::pair(tests,
                     describe_strength(of_trials.model, strength_of(of_trials.model, ranks)));
  }();
  if (arguments.output.empty())
    if (const auto far = distant_output(arguments, outline_of(first.model).output.folder))
      throw InputError({first.place(*far)});
  const std::string name = first.stages.empty() ? "" : first.stages[last];
  const fs::path folder = arguments.output.empty()
                              ? outline_of(first.model).output.folder + "-safety"
                              : arguments.output;
  const fs::path rest = folder / "equilibrium";
  refuse_earlier_results(arguments, rest);
  if (const int code = come_to_rest(arguments, read, std::move(first), rest)) {
    if (code != exit_stopped)
      console.warn(
          "lahar: error: there is no equilibrium with full strength to begin with: the "
          "factor of safety is below 1, or the run has another cause to fail (see above).");
    return code;
  }
  auto end = equilibrium_in(name.empty() ? rest : rest / name, tests_rest, ranks, console);
  if (!end) return exit_simulation;
  const SafetyTrials trials(
      arguments, [&] { return read(last); }, std::move(end));
  console.line("\ndivided    " + strength);
  return unless_stopped(
      console, [&] { return look_for_factor(arguments, bounds, trials, folder, console); });
}

}  // namespace lahar
