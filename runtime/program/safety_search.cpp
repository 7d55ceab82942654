#include "runtime/program/safety_search.h"

#include <fmt/format.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "io/base/atomic_file.h"
#include "io/base/sha256.h"
#include "io/json/json_text.h"
#include "io/run/run_folder.h"
#include "io/run/safety_record.h"
#include "runtime/base/exit_codes.h"
#include "runtime/program/case_run.h"
#include "runtime/program/ranks_begin.h"
#include "runtime/program/run_description.h"
#include "runtime/program/signals.h"
#include "runtime/step/restart.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse_folder(std::string message, std::string hint) {
  throw InputError({Problem{.message = std::move(message), .hint = std::move(hint)}});
}

/// What the manifest of a run says, or "".
std::string told_by_manifest(const fs::path& run, const char* key) {
  const auto manifest = read_manifest(run);
  return manifest ? text_in(*manifest, key) : "";
}

constexpr const char* no_equilibrium =
    "there is no equilibrium with full strength: the factor of safety is below 1, or the run has "
    "another cause to fail";

class SafetySearch {
 public:
  SafetySearch(const RunArguments& arguments, const SafetyBounds& bounds,
               const StagesRun::Read& read, Console& console);
  ~SafetySearch();
  SafetySearch(const SafetySearch&) = delete;
  SafetySearch& operator=(const SafetySearch&) = delete;
  /// Returns the exit status. Throws InputError, IoError.
  int execute();

 private:
  bool goes_on() const { return !arguments_.restart.empty(); }
  bool has_folder() const { return arguments_.execution.ranks.rank() == 0; }
  std::filesystem::path rest_folder() const { return folder_ / "equilibrium"; }
  std::filesystem::path mechanism_folder() const { return folder_ / "mechanism"; }

  /// What it divides, and where its results go. Returns the scenario, or its first stage.
  Scenario begin();
  /// Makes the folder, or takes the one of the search that goes on. Collective.
  void claim_folder();
  void claim();
  /// The run with full strength, unless it is there. Returns the exit status.
  int come_to_rest(Scenario scenario);
  bool has_equilibrium() const;
  /// The state from which trials begin; null if the run has not come to rest.
  std::unique_ptr<CheckpointReader> equilibrium();
  /// Trials that an earlier search made from the same state. Collective.
  void take_known_trials(const CheckpointReader& equilibrium);
  SafetyTrial told(const SafetyTrial& trial);
  int look_for_factor(const SafetyTrials& trials);
  /// Returns the exit status.
  int write_mechanism(const SafetyTrials& trials, const SafetyTrial& failure);
  void tell_result();
  /// The share of the search that is done, to RunArguments::on_step.
  void count_share();

  void write_record();
  int stop(const std::string& why);
  int fail(const std::string& message, const std::string& said);

  RunArguments arguments_;
  SafetyBounds bounds_;
  const StagesRun::Read& read_;
  Console& console_;
  std::filesystem::path folder_;
  std::optional<OutputFile> log_;  ///< locked while the search works; on rank 0
  std::string last_stage_;         ///< its name; empty without stages
  std::size_t stage_ = 0;          ///< the last one
  bool tests_rest_ = false;        ///< as check_safety() says
  CheckpointHeader header_;        ///< of the last stage
  SafetyRecord record_;
  SafetyResult result_;
  bool begun_ = false;         ///< the record in the folder is that of this search
  double done_ = 0, all_ = 1;  ///< runs and trials, for the share
};

SafetySearch::SafetySearch(const RunArguments& arguments, const SafetyBounds& bounds,
                           const StagesRun::Read& read, Console& console)
    : arguments_(arguments), bounds_(bounds), read_(read), console_(console) {
  if (!arguments.on_step) return;
  arguments_.on_step = [this, tell = arguments.on_step](Index step, double time, double share) {
    return tell(step, time, std::min(1.0, (done_ + std::clamp(share, 0.0, 1.0)) / all_));
  };
}

SafetySearch::~SafetySearch() {
  if (log_) console_.log_to({});
  if (!begun_ || record_.status != RunStatus::running) return;
  try {
    record_.status = RunStatus::failed;
    record_.message = "ended by an error";
    write_record();
  } catch (const std::exception&) {
    // What has ended the search is said already.
  }
}

void SafetySearch::write_record() {
  if (!has_folder()) return;
  if (record_.status != RunStatus::running) record_.ended = utc_now();
  write_safety_record(folder_, record_, result_);
}

void SafetySearch::count_share() {
  constexpr double mechanism = 1;
  all_ = done_ + trials_left(bounds_, result_) + mechanism;
  if (done_ == 0) all_ += 1;  // the run with full strength
}

Scenario SafetySearch::begin() {
  const Communicator& ranks = arguments_.execution.ranks;
  Scenario first = read_(0);
  stage_ = first.stages.empty() ? 0 : first.stages.size() - 1;
  if (!first.stages.empty()) last_stage_ = first.stages[stage_];
  {
    const Scenario later = stage_ == 0 ? Scenario() : read_(stage_);
    const Scenario& of_trials = stage_ == 0 ? first : later;
    tests_rest_ = check_safety(of_trials, ranks);
    header_ = checkpoint_header(of_trials);
    record_.divided = describe_strength(of_trials.model, strength_of(of_trials.model, ranks));
    record_.title = outline_of(of_trials.model).title;
  }
  const std::string planned = outline_of(first.model).output.folder;
  if (arguments_.output.empty())
    if (const auto far = distant_output(arguments_, planned)) throw InputError({first.place(*far)});
  folder_ = arguments_.output.empty() ? planned + "-safety" : arguments_.output;
  record_.version = header_.version;
  record_.commit = header_.commit;
  record_.compiler = header_.compiler;
  record_.command = arguments_.command;
  record_.bounds = bounds_;
  record_.started = utc_now();
  return first;
}

void SafetySearch::claim() {
  const std::string shown = folder_.string();
  const std::optional<SafetyResults> before = read_safety(folder_);
  if (goes_on() && !before)
    refuse_folder(fmt::format("folder {} holds no search that could be continued", shown),
                  "start it without --restart latest, or name its folder with --output");
  if (is_run_folder(folder_))
    refuse_folder(fmt::format("folder {} holds the results of a run", shown),
                  "choose another folder for the search");
  if (!goes_on() && !arguments_.overwrite && (before || holds_run(rest_folder())))
    refuse_folder(fmt::format("folder {} holds the results of an earlier search", shown),
                  "add --restart latest to continue it, --overwrite to replace them, or choose "
                  "another folder with --output");
  make_folder(folder_);
  log_.emplace(folder_ / "log.txt", OutputFile::Mode::append);
  if (::flock(log_->descriptor(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    refuse_folder(fmt::format("folder {} is being written to by another search", shown),
                  "wait for it to end, or choose another folder");
  if (goes_on()) {
    record_.started = before->record.started;
    return;
  }
  remove_safety(folder_);
  remove_unstaged_run(mechanism_folder());
  log_->truncate();
}

void SafetySearch::claim_folder() {
  on_first_rank(arguments_.execution.ranks, [this] { claim(); });
  if (!log_) return;
  console_.log_to([this](const std::string& text) {
    log_->write(text);
    log_->write("\n");
    log_->flush();
  });
}

bool SafetySearch::has_equilibrium() const {
  const fs::path folder = rest_folder() / last_stage_;
  const bool there = goes_on() && told_by_manifest(folder, "status") == "finished" &&
                     !checkpoints_in(checkpoint_folder(folder)).empty();
  const Communicator& ranks = arguments_.execution.ranks;
  if (ranks.any(!there)) return false;
  const auto end = open_checkpoint("latest", folder, ranks, [](const std::string&) {});
  return end->header().scenario == header_.scenario &&
         end->header().side_files == header_.side_files;
}

int SafetySearch::come_to_rest(Scenario scenario) {
  if (has_equilibrium()) {
    console_.line(fmt::format("equilibrium {}", rest_folder().string()));
    return exit_ok;
  }
  Console console(voice_of(arguments_), arguments_.listener);  // with the log of its run folder
  RunArguments arguments = arguments_;
  arguments.output = rest_folder().string();
  const OutputPlan& plan = outline_of(scenario.model).output;
  if (plan.checkpoint_minutes == 0 && plan.checkpoint_steps == 0)
    arguments.checkpoint_minutes = 1e6;  // there is one at the end
  return run_scenario(arguments, read_, std::move(scenario), console);
}

std::unique_ptr<CheckpointReader> SafetySearch::equilibrium() {
  auto end = open_checkpoint("latest", rest_folder() / last_stage_, arguments_.execution.ranks,
                             [](const std::string&) {});
  if (!tests_rest_ || end->header().run.rest.reached) return end;
  return nullptr;
}

void SafetySearch::take_known_trials(const CheckpointReader& equilibrium) {
  const Communicator& ranks = arguments_.execution.ranks;
  std::string known;
  if (has_folder()) {
    record_.equilibrium = {.file = equilibrium.file().lexically_relative(folder_).generic_string(),
                           .sha256 = sha256_of_file(equilibrium.file())};
    const auto before = goes_on() ? read_safety(folder_) : std::nullopt;
    if (before && !before->result.trials.empty()) {
      const SafetyRecord& record = before->record;
      if (record.equilibrium.sha256 != record_.equilibrium.sha256) {
        console_.line("Earlier trials began with another state: they are made again.");
      } else {
        known = safety_table_text(before->result);
        record_.mechanism = record.mechanism;
        if (record.version != record_.version || record.commit != record_.commit ||
            record.compiler != record_.compiler)
          console_.warn(fmt::format(
              "lahar: warning: another build of Lahar made the trials of {} ({} {}, {}); those "
              "that "
              "follow may differ from its own by rounding.",
              safety_table(folder_).string(), record.version, record.commit, record.compiler));
      }
    }
  }
  ranks.broadcast(known);
  if (!known.empty()) result_ = safety_result_of(known);
}

SafetyTrial SafetySearch::told(const SafetyTrial& trial) {
  std::string line = fmt::format("{:8.4f}  {:12} {:>8} steps   moves by {:.4g} m", trial.factor,
                                 trial.stable() ? "equilibrium" : "fails",
                                 format_count(trial.steps), trial.displacement);
  if (trial.end == SafetyTrial::End::restless) line += " and does not come to rest";
  if (trial.end == SafetyTrial::End::settles) line += " and settles";
  console_.line(line);
  if (!trial.problem.empty()) console_.line("          " + trial.problem);
  return trial;
}

void SafetySearch::tell_result() {
  console_.line("");
  if (result_.fails)
    console_.line(fmt::format(
        "factor of safety {:.4g}: equilibrium with strength / {:.4g}, none with strength / {:.4g}",
        result_.factor(), result_.stable, *result_.fails));
  else
    console_.line(
        fmt::format("the factor of safety is above {}; --most raises the bound", result_.stable));
  console_.line(fmt::format("trials     {}", safety_table(folder_).string()));
  if (const SafetyTrial* failure = result_.failure())
    console_.line(
        fmt::format("mechanism  {}: displacements from full strength on, strength / {:.4g}",
                    mechanism_folder().string(), failure->factor));
}

int SafetySearch::write_mechanism(const SafetyTrials& trials, const SafetyTrial& failure) {
  const bool there = record_.mechanism == failure.factor &&
                     told_by_manifest(mechanism_folder(), "status") == "finished";
  if (!arguments_.execution.ranks.any(has_folder() && !there)) return exit_ok;
  record_.mechanism = {};
  // A trial that broke breaks again, and shows where.
  const int code = trials.write_run(failure, mechanism_folder());
  if (code != exit_stopped) record_.mechanism = failure.factor;
  return code;
}

int SafetySearch::look_for_factor(const SafetyTrials& trials) {
  console_.line("\n  factor  strength / factor");
  for (const SafetyTrial& trial : result_.trials) told(trial);
  const auto write = [this] {
    if (has_folder()) write_text_file(safety_table(folder_), safety_table_text(result_));
    write_record();
  };
  write();
  done_ = 1;
  count_share();
  result_ = find_factor(
      bounds_,
      [&](double factor) {
        const SafetyTrial trial = told(trials(factor));
        result_.add(trial);
        write();
        ++done_;
        count_share();
        return trial;
      },
      result_);
  if (const SafetyTrial* failure = result_.failure())
    if (write_mechanism(trials, *failure) == exit_stopped) throw SafetyStopped{};
  tell_result();
  record_.status = RunStatus::finished;
  write_record();
  return exit_ok;
}

int SafetySearch::stop(const std::string& why) {
  record_.status = RunStatus::stopped;
  record_.message = why;
  write_record();
  return exit_stopped;
}

int SafetySearch::fail(const std::string& message, const std::string& said) {
  console_.warn("lahar: error: " + said);
  record_.status = RunStatus::failed;
  record_.message = message;
  write_record();
  return exit_simulation;
}

int SafetySearch::execute() {
  Scenario first = begin();
  claim_folder();
  count_share();
  // A search that goes on keeps what an earlier one has said until the scenario is known to be the
  // same.
  begun_ = !goes_on();
  if (begun_) write_record();
  const auto why = [] {
    return stop_signal() != 0 ? fmt::format("signal {}", stop_signal()) : std::string("request");
  };
  if (const int code = come_to_rest(std::move(first))) {
    begun_ = true;
    if (code == exit_stopped) return stop(why());
    const std::string cause = told_by_manifest(rest_folder() / last_stage_, "message");
    return fail(fmt::format("{}{}{}", no_equilibrium, cause.empty() ? "" : ": ", cause),
                fmt::format("{} (see above).", no_equilibrium));
  }
  begun_ = true;
  auto end = equilibrium();
  if (!end) {
    const std::string text =
        "the run with full strength has ended before it came to rest: let it take longer "
        "(analysis.end_time, nsteps), or damp it (analysis.damping)";
    return fail(text, text + ".");
  }
  take_known_trials(*end);
  const SafetyTrials trials(
      arguments_, [this] { return read_(stage_); }, std::move(end));
  console_.line("\ndivided    " + record_.divided);
  try {
    return look_for_factor(trials);
  } catch (const SafetyStopped&) {
    console_.warn(fmt::format(
        "lahar: stopped by {}; {} has the trials so far. To continue: the same command with "
        "--restart latest.",
        why(), safety_table(folder_).string()));
    return stop(why());
  }
}

}  // namespace

int find_safety(const RunArguments& arguments, const SafetyBounds& bounds,
                const StagesRun::Read& read, Console& console) {
  return SafetySearch(arguments, bounds, read, console).execute();
}

}  // namespace lahar
