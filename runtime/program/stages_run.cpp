#include "runtime/program/stages_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "io/json/json_text.h"
#include "io/run/manifest.h"
#include "io/run/run_folder.h"
#include "io/scenario/scenario_difference.h"
#include "io/scenario/stages.h"
#include "runtime/base/exit_codes.h"
#include "runtime/program/ranks_begin.h"
#include "runtime/program/signals.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

/// Whether a run folder is that of a run that has come to its end.
bool has_finished(const fs::path& folder) {
  const auto manifest = read_manifest(folder);
  return manifest && text_in(*manifest, "status") == "finished";
}

bool same(const Problem& a, const Problem& b) {
  return a.file == b.file && a.line == b.line && a.column == b.column && a.hint == b.hint &&
         (a.message.ends_with(b.message) || b.message.ends_with(a.message));
}

}  // namespace

Console::Voice voice_of(const RunArguments& arguments) {
  return arguments.execution.ranks.rank() > 0 ? Console::Voice::silent
         : arguments.quiet                    ? Console::Voice::quiet
                                              : Console::Voice::normal;
}

void end_before_steps(const RunArguments& arguments, bool goes_on) {
  std::string text = "before the first step; nothing was written.";
  if (goes_on)
    text = arguments.can_restart
               ? "before the first step. To continue: the same command with --restart latest."
               : "before the first step. To begin again: the same command with --overwrite.";
  if (arguments.execution.ranks.rank() > 0) text.clear();
  end_at_signals(text, goes_on && arguments.can_restart ? exit_stopped : 0);
}

void StageWarnings::say(const std::vector<Problem>& warnings, Console& console) {
  std::vector<Problem> more;
  for (const Problem& one : warnings)
    if (std::none_of(said_.begin(), said_.end(), [&](const auto& s) { return same(s, one); }))
      more.push_back(one);
  if (!more.empty()) console.warn(more);
  said_.insert(said_.end(), more.begin(), more.end());
}

std::string stage_line(const Scenario& scenario) {
  return fmt::format("stage      {} of {}: {}", scenario.stage + 1, scenario.stages.size(),
                     scenario.stages[scenario.stage]);
}

StagesRun::StagesRun(const RunArguments& arguments, Read read, Scenario first, Console& console)
    : arguments_(arguments),
      read_(std::move(read)),
      console_(console),
      folder_(arguments.output),
      names_(first.stages) {
  StageBody before = body_of(first);
  if (folder_.empty())
    folder_ = std::visit([](const auto& model) { return model.output.folder; }, first.model);
  StageWarnings warnings;
  warnings.say(first.warnings, console);
  full_.push_back(first.full);
  first = {};  // read again when it begins: there is never more than one model in memory
  for (std::size_t k = 1; k < names_.size(); ++k) {
    const Scenario stage = read_(k);
    check_body(before, stage);
    warnings.say(stage.warnings, console);
    warnings.say(changes_of_method(std::exchange(before, body_of(stage)), stage), console);
    full_.push_back(stage.full);
  }
}

std::string StagesRun::folder(std::size_t stage) const {
  return (fs::path(folder_) / names_[stage]).string();
}

StagesRun::Begin StagesRun::begin() const {
  const std::string& from = arguments_.restart;
  if (from.empty()) return {};
  std::size_t stage = 0;
  if (from != "latest") {
    std::error_code error;
    while (stage < names_.size() &&
           !fs::equivalent(fs::path(from).parent_path(), checkpoint_folder(folder(stage)), error))
      ++stage;
    if (arguments_.execution.ranks.any(stage == names_.size()))
      throw InputError(
          {Problem{.message = fmt::format("{} is not a checkpoint of a stage in {}", from, folder_),
                   .hint = "name one in RUN/STAGE/checkpoints, or go on with --restart latest"}});
    return {stage, from};
  }
  while (stage + 1 < names_.size() && has_finished(folder(stage))) ++stage;
  stage = static_cast<std::size_t>(  // as the last rank sees it that sees least
      arguments_.execution.ranks.min(static_cast<Index>(stage)));
  // A stage that ended before its first checkpoint begins again where the one before ended.
  const bool goes_on = stage == 0 || !checkpoints_in(checkpoint_folder(folder(stage))).empty();
  return {stage, arguments_.execution.ranks.any(goes_on) ? "latest" : ""};
}

std::unique_ptr<CheckpointReader> StagesRun::end_of(std::size_t stage, Console& console) const {
  auto reader =
      open_checkpoint("latest", folder(stage), arguments_.execution.ranks,
                      [&](const std::string& text) { console.warn("lahar: warning: " + text); });
  for (const ScenarioDifference& one : differences(reader->header().scenario, full_[stage]))
    if (!one.allowed)
      throw InputError({Problem{
          .message = fmt::format("stage {} has ended with another scenario: {} is {}, there it is "
                                 "{}",
                                 names_[stage], one.where, one.now, one.before),
          .hint = "begin again with --overwrite, or leave stages that have ended as they were"}});
  return reader;
}

void StagesRun::refuse_other_stages() const {
  on_first_rank(arguments_.execution.ranks, [&] {
    for (const FolderOfRun& one : stages_in(folder_)) {
      const std::string name = one.folder.filename().string();
      if (std::find(names_.begin(), names_.end(), name) == names_.end())
        throw InputError({Problem{
            .message = fmt::format("{} has the results of a stage {}, which the scenario does not "
                                   "have",
                                   folder_, name),
            .hint = "begin again with --overwrite, or leave stages that have ended as they were"}});
    }
  });
}

void StagesRun::clear(std::size_t first) {
  if (!arguments_.overwrite && arguments_.restart.empty()) return;  // there was nothing
  const auto later = names_.begin() + static_cast<std::ptrdiff_t>(first) + 1;
  const bool all = arguments_.restart.empty();
  if (all) remove_unstaged_run(folder_);
  left_ = remove_stages(folder_, [&](const std::string& name) {
    return (all && name != names_[first]) || std::find(later, names_.end(), name) != names_.end();
  });
}

int StagesRun::run(std::size_t stage, const Begin& from, Console& console) {
  const std::string restart = stage == from.stage ? from.restart : "";
  end_before_steps(arguments_, stage > 0 || !restart.empty());
  Scenario scenario = read_(stage);
  console.line(stage_line(scenario));
  RunArguments arguments = arguments_;
  arguments.output = folder(stage);
  arguments.restart = restart;
  // Stages are checked before any begins. One that goes on from the one before replaces its own.
  arguments.overwrite = restart.empty() && (arguments_.overwrite || !arguments_.restart.empty());
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begun_;
  if (arguments_.wall_time > 0)
    arguments.wall_time = std::max(arguments_.wall_time - elapsed.count(), 1e-3);
  CaseStage of{.name = names_[stage], .goes_before = stage + 1 < names_.size()};
  of.cleared = std::find(left_.begin(), left_.end(), names_[stage]) != left_.end();
  if (stage == from.stage) of.before_folder = [this, stage] { clear(stage); };
  if (stage > 0 && restart.empty()) {
    of.before = end_of(stage - 1, console);
    of.alike = goes_on_alike(full_[stage - 1], full_[stage]);
  }
  return CaseRun(arguments, scenario, console, std::move(of)).execute();
}

int StagesRun::execute() {
  check_output(arguments_, folder_, names_);
  if (!arguments_.restart.empty()) refuse_other_stages();
  const Begin from = begin();
  for (std::size_t k = from.stage; k < names_.size(); ++k) {
    Console own(voice_of(arguments_), arguments_.listener);  // each has the log of its run folder
    Console& console = k == from.stage ? console_ : own;
    if (k > from.stage) console.line("");
    try {
      const int code = run(k, from, console);
      if (code != 0) return code;
    } catch (const InputError& error) {
      std::vector<Problem> problems = error.problems();
      for (Problem& problem : problems)
        if (!problem.message.starts_with("stage "))
          problem.message = fmt::format("stage {}: {}", names_[k], problem.message);
      throw InputError(std::move(problems));
    } catch (const IoError& error) {
      throw IoError(fmt::format("stage {}: {}", names_[k], error.what()));
    }
  }
  return 0;
}

std::optional<Problem> distant_output(const RunArguments& arguments, const std::string& planned) {
  const fs::path& given = arguments.options.folder;
  const fs::path own = given.empty() ? fs::path(arguments.scenario).parent_path() : given;
  const fs::path base = (fs::absolute(own.empty() ? "." : own) / "").lexically_normal();
  const fs::path folder = fs::absolute(planned).lexically_normal();
  if (*folder.lexically_relative(base).begin() != "..") return {};
  return Problem{
      .where = "/post_processing/path",
      .message = fmt::format("results would be in {}, which is not in the folder of the scenario, "
                             "{}",
                             folder.string(), base.string()),
      .hint =
          "take a folder in there, such as \"results/\", or say --output FOLDER: a scenario of "
          "others must not write where it likes"};
}

void check_output(const RunArguments& arguments, const std::string& planned,
                  const std::vector<std::string>& stages) {
  if (arguments.output.empty())
    if (const auto problem = distant_output(arguments, planned)) throw InputError({*problem});
  if (!arguments.restart.empty()) return;
  const fs::path folder = arguments.output.empty() ? planned : arguments.output;
  on_first_rank(arguments.execution.ranks,
                [&] { check_run_folder(folder, stages, arguments.overwrite); });
}

int run_scenario(const RunArguments& arguments, StagesRun::Read read, Scenario scenario,
                 Console& console) {
  if (!scenario.stages.empty())
    return StagesRun(arguments, std::move(read), std::move(scenario), console).execute();
  if (!scenario.warnings.empty()) console.warn(scenario.warnings);
  return CaseRun(arguments, scenario, console).execute();
}

}  // namespace lahar
