/// \file `lahar run` and `lahar check`.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>

#include "io/base/atomic_file.h"
#include "io/scenario/stages.h"
#include "runtime/comm/rank_team.h"
#include "runtime/program/case_run.h"
#include "runtime/program/commands.h"
#include "runtime/program/model_picture.h"
#include "runtime/program/ranks_begin.h"
#include "runtime/program/run_description.h"
#include "runtime/program/stages_run.h"
#include "runtime/program/startup_progress.h"
#include "runtime/program/study_options.h"
#include "runtime/terminal/console.h"
#include "runtime/terminal/version.h"

namespace lahar {

namespace {

Scenario read(const RunArguments& arguments, const Team* team = nullptr, std::size_t stage = 0,
              std::vector<ModelMark>* marks = nullptr,
              decltype(ScenarioOptions::planned) planned = {}) {
  ScenarioOptions options = arguments.options;
  options.planned = std::move(planned);
  options.marks = marks;
  options.stage = stage;
  options.team = team;
  options.memory = arguments.execution.memory;
  StartupProgress progress(arguments.execution.ranks.rank() == 0 && !arguments.quiet);
  options.phase = [&](const std::string& text) { progress.phase(text); };
  return read_scenario(arguments.scenario, options);
}

int run_command(const RunArguments& given) {
  RunArguments arguments = given;
  end_before_steps(arguments, !arguments.restart.empty());
  Console console(voice_of(arguments));
  console.line("Lahar " + version_line());
  console.line("built with " + compiler_line());
  check_alike(arguments);
  arguments.execution.memory = limit_of_ranks(arguments);
  const RankTeam team(arguments.execution.ranks);
  Scenario scenario = read(
      arguments, &team, 0, nullptr,
      [&](const auto& folder, const auto& stages) { check_output(arguments, folder, stages); });
  const auto read_stage = [&](std::size_t k) { return read(arguments, &team, k); };
  return run_scenario(arguments, read_stage, std::move(scenario), console);
}

/// What a run of the scenario, or of one of its stages, would be.
void check_one(const RunArguments& arguments, Scenario& scenario, Console& console) {
  const ModelOutline outline = outline_of(scenario.model);
  const Simulation simulation = [&] {
    StartupProgress progress(true);
    progress.phase("patches and particles");
    return make_simulation(scenario, arguments.execution);
  }();
  const SimulationInfo info = simulation.info();
  describe(console, outline, info);
  describe_loads(console, scenario.loads);
  describe_duration(console, outline, info);
  describe_frames(console, outline.output, outline.analysis, info);
  const std::string of_stage = scenario.stages.empty() ? "" : "/" + scenario.stages[scenario.stage];
  console.line(fmt::format("output     {}{}", outline.output.folder, of_stage));
  if (arguments.ranks > 0)
    describe_ranks(console, simulation.patch_graph(), simulation.patch_counts(), arguments.ranks,
                   arguments.partitioner);
}

/// Warns where `lahar run` needs --output, and returns what to write behind it.
std::string tell_distant_output(const RunArguments& arguments, const Scenario& scenario,
                                Console& console) {
  const auto problem = distant_output(arguments, outline_of(scenario.model).output.folder);
  if (!problem) return "";
  console.warn(std::vector{scenario.place(*problem)});
  return " --output FOLDER";
}

int check_command(const RunArguments& given) {
  RunArguments arguments = given;
  arguments.execution.memory = memory_limit(arguments.memory, 1);
  Console console(false);
  std::size_t stages = 1;
  StageBody before;
  StageWarnings warnings;
  std::string with;
  for (std::size_t k = 0; k < stages; ++k) {
    const bool draws = k == 0 && !arguments.picture.empty();
    std::vector<ModelMark> marks;
    Scenario scenario = read(arguments, nullptr, k, draws ? &marks : nullptr);
    if (draws) write_text_file(arguments.picture, model_picture(scenario.model, marks));
    warnings.say(scenario.warnings, console);
    if (k == 0) with = tell_distant_output(arguments, scenario, console);
    if (!scenario.stages.empty()) {
      stages = scenario.stages.size();
      if (k == 0) before = body_of(scenario);
      check_body(before, scenario);
      warnings.say(changes_of_method(std::exchange(before, body_of(scenario)), scenario), console);
      console.line((k > 0 ? "\n" : "") + stage_line(scenario));
    }
    check_one(arguments, scenario, console);
  }
  if (!arguments.picture.empty()) console.line(fmt::format("picture    {}", arguments.picture));
  console.line(fmt::format("next: lahar run {}{}", arguments.scenario, with));
  return exit_ok;
}

/// --partition, of run and check.
CLI::Option* add_partition(CLI::App& command, Partitioner& chosen, const std::string& text) {
  const auto choose = [&chosen](const std::string& name) {
    chosen = name == "scotch" ? Partitioner::scotch : Partitioner::curve;
  };
  return command.add_option_function<std::string>("--partition", choose, text)
      ->check(CLI::IsMember({"curve", "scotch"}))
      ->type_name("NAME");
}

const std::map<std::string, std::uint64_t> size_units{
    {"KiB", 1ULL << 10}, {"MiB", 1ULL << 20}, {"GiB", 1ULL << 30}, {"TiB", 1ULL << 40}};

/// --memory, of run and check.
void add_memory(CLI::App& command, double& bytes) {
  command
      .add_option_function<std::string>(
          "--memory", [&bytes](const std::string& text) { bytes = bytes_of(text); },
          "Memory of the machine that the case may use, such as 64G or 500M (default: all of it, "
          "or the limit of its control group). A case that needs more is refused")
      ->type_name("SIZE");
}

/// What --balance says.
BalanceOptions balance_options(const std::string& text, Partitioner partitioner) {
  using When = BalanceOptions::When;
  if (text == "auto") return {.partitioner = partitioner};
  if (text == "off") return {.when = When::never, .partitioner = partitioner};
  const bool digits = !text.empty() && text.size() < 10 &&
                      text.find_first_not_of("0123456789") == std::string::npos;
  const Step every = digits ? std::stoll(text) : 0;
  if (every <= 0)
    throw InputError("--balance must be auto, off or a number of steps, found '" + text + "'.");
  return {.when = When::forced, .every = every, .partitioner = partitioner};
}

struct RunOptions {
  RunArguments run;
  StudyOptions study;
  bool serial = false, bulk = false;
  std::string balance = "auto";
};

/// What `options` ask for, together with the words of the command line.
RunArguments arguments_of(const RunOptions& options, const Words& words) {
  RunArguments run = options.run;
  run.command = words;
  run.execution.ranks = Communicator::world();
  options.study.give(run);
  if (options.serial && run.execution.ranks.several())
    throw InputError("--serial is for one rank: on several, only the task graph runs.");
  if (options.serial && options.bulk)
    throw InputError("--serial and --bulk-synchronous exclude each other; give one of them.");
  if (options.serial) run.execution.mode = ExecutionOptions::Mode::serial;
  if (options.bulk) run.execution.mode = ExecutionOptions::Mode::bulk;
  run.execution.balance = balance_options(options.balance, run.execution.balance.partitioner);
  return run;
}

}  // namespace

Action add_run(CLI::App& command) {
  const auto options = std::make_shared<RunOptions>();
  RunArguments& run = options->run;
  add_scenario(command, run.scenario, run.options);
  command.add_option("--threads,-t", run.execution.threads, "Threads (default: all cores)")
      ->check(CLI::Range(1, 4096));
  command.add_flag("--serial", options->serial,
                   "Use a serial loop instead of the task graph; same results");
  command
      .add_option("--balance", options->balance,
                  "Move patches between ranks: auto (where it pays by measured work), off, or for "
                  "tests a number of steps after which patches move at random")
      ->default_str("auto");
  add_partition(command, run.execution.balance.partitioner,
                "Distribute patches among ranks by curve (space-filling curve, default) or scotch");
  command
      .add_option("--writers", run.writers,
                  "Number of MPI ranks that write frames (default: all). The others send them "
                  "their particles. For file systems that slow down with many writers")
      ->check(CLI::Range(1, 1'000'000));
  command
      .add_option("--staging", run.execution.staging_bytes,
                  "Largest frame or checkpoint per rank that is copied and written in the "
                  "background, with at most three copies of frames and two of checkpoints at a "
                  "time. Steps wait while a larger one is written")
      ->transform(CLI::AsNumberWithUnit(size_units, CLI::AsNumberWithUnit::UNIT_REQUIRED))
      ->type_name("SIZE")
      ->default_str("64MiB");
  command.add_flag("--bulk-synchronous", options->bulk,
                   "For comparison: all wait for all after each phase; same results");
  options->study.add_to(command, run);
  command.add_option("--output,-o", run.output, "Run folder (default: from the scenario)");
  command.add_flag("--overwrite", run.overwrite, "Replace earlier results in the run folder");
  command
      .add_option("--wall-time", run.wall_time,
                  "Write a checkpoint and stop before this many seconds of wall time; exit code 75")
      ->check(above_zero);
  auto* restart = command.add_option(
      "--restart", run.restart,
      "Continue the run in its folder, from its latest checkpoint or from a file");
  restart->type_name("latest|FILE")->excludes("--overwrite");
  command
      .add_option("--checkpoint-steps", run.checkpoint_steps,
                  "Steps between checkpoints; 0: none (default: from the scenario)")
      ->check(not_below_zero);
  command
      .add_option("--checkpoint-minutes", run.checkpoint_minutes,
                  "Minutes between checkpoints; 0: none (default: from the scenario)")
      ->check(not_below_zero);
  add_memory(command, run.memory);
  command.add_flag("--quiet,-q", run.quiet, "Print only warnings and errors");
  return [options](const Words& words) { return run_command(arguments_of(*options, words)); };
}

Action add_check(CLI::App& command) {
  const auto arguments = std::make_shared<RunArguments>();
  add_scenario(command, arguments->scenario, arguments->options);
  auto* ranks_option =
      command
          .add_option("--ranks", arguments->ranks,
                      "Show how patches would be distributed among this many MPI ranks")
          ->check(CLI::Range(1, 1'000'000));
  add_memory(command, arguments->memory);
  command
      .add_option("--picture", arguments->picture,
                  "Draw the model to this SVG file: plan and sections, materials, constraints, "
                  "loads, gravity and water table. Of stages the first")
      ->type_name("FILE");
  add_partition(command, arguments->partitioner,
                "Distribute them by curve (space-filling curve, default) or scotch")
      ->needs(ranks_option);
  return [arguments](const Words&) {
    refuse_several_ranks("check");
    return check_command(*arguments);
  };
}

}  // namespace lahar
