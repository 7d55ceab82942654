#include "runtime/step/restart.h"

#include <fmt/format.h>

#include "io/scenario/scenario_difference.h"
#include "physics/base/error.h"

namespace lahar {

namespace {

namespace fs = std::filesystem;

/// Open and verify one file; all ranks come to the same end. Returns why it cannot be used.
std::string try_open(const fs::path& file, const Communicator& ranks,
                     std::unique_ptr<CheckpointReader>& reader) {
  std::string why;
  try {
    reader = std::make_unique<CheckpointReader>(file);
    reader->verify(static_cast<std::size_t>(ranks.rank()), static_cast<std::size_t>(ranks.size()));
  } catch (const IoError& error) {
    why = error.what();
  }
  if (!ranks.any(!why.empty())) return "";
  reader.reset();
  return why.empty() ? fmt::format("cannot read {}: another rank found it damaged", file.string())
                     : why;
}

[[noreturn]] void refuse(std::string message, std::string hint) {
  throw InputError({Problem{.message = std::move(message), .hint = std::move(hint)}});
}

}  // namespace

std::unique_ptr<CheckpointReader> open_checkpoint(
    const std::string& which, const fs::path& folder, const Communicator& ranks,
    const std::function<void(const std::string&)>& warn) {
  std::unique_ptr<CheckpointReader> reader;
  if (which != "latest") {
    if (ranks.any(!fs::exists(which)))
      refuse(fmt::format("there is no checkpoint {}", which),
             "name a file, or take the latest of the run folder with --restart latest");
    const std::string why = try_open(which, ranks, reader);
    if (!why.empty()) throw IoError(why);
    return reader;
  }
  const std::vector<CheckpointFile> files = checkpoints_in(checkpoint_folder(folder));
  for (auto file = files.rbegin(); file != files.rend(); ++file) {
    const std::string why = try_open(file->file, ranks, reader);
    if (why.empty()) return reader;
    warn(fmt::format("{}; the checkpoint before it is tried.", why));
  }
  refuse(files.empty() ? fmt::format("run folder {} holds no checkpoint", folder.string())
                       : fmt::format("run folder {} holds no checkpoint that is not damaged",
                                     folder.string()),
         "start the run anew, without --restart (checkpoint_steps and checkpoint_minutes in "
         "post_processing have checkpoints written)");
}

std::vector<std::string> check_same_scenario(const CheckpointReader& checkpoint,
                                             const CheckpointHeader& now,
                                             const Scenario& scenario) {
  const CheckpointHeader& before = checkpoint.header();
  std::vector<ScenarioDifference> found = differences(before.scenario, now.scenario);
  const auto of_files = differences(before.side_files, now.side_files);
  found.insert(found.end(), of_files.begin(), of_files.end());
  std::vector<std::string> allowed;
  std::vector<Problem> problems;
  for (const ScenarioDifference& one : found) {
    const std::string text =
        fmt::format("{} is {}, in the checkpoint it is {}", one.where, one.now, one.before);
    if (one.allowed)
      allowed.push_back(text);
    else
      problems.push_back(scenario.place({.where = one.where, .message = text}));
  }
  if (problems.empty()) return allowed;
  std::string may_differ;
  for (const char* key : allowed_differences())
    may_differ += fmt::format("{}{}", may_differ.empty() ? "" : ", ", key);
  problems.back().hint = fmt::format(
      "{} was made with another scenario. A run can go on with the same one only; "
      "what may differ: {}",
      checkpoint.file().string(), may_differ);
  throw InputError(std::move(problems));
}

SimulationState state_in(const CheckpointReader& checkpoint) {
  SimulationState state{.run = checkpoint.header().run, .patches = {}, .sizes = {}, .bytes = {}};
  for (const CheckpointPatch& patch : checkpoint.patches()) {
    state.patches.push_back(patch.id);
    state.sizes.push_back(patch.bytes);
  }
  state.bytes = [&checkpoint](std::size_t i) { return checkpoint.patch(i); };
  return state;
}

SimulationState state_at_start(const CheckpointReader& checkpoint, bool alike) {
  return state_at_start(state_in(checkpoint), alike);
}

SimulationState state_at_start(SimulationState end, bool alike) {
  const RunState before = end.run;
  // What is not of the clock, or of the accounts of work.
  end.run = {.dim = before.dim,
             .particles = before.particles,
             .next_id = before.next_id,
             .cells_per_patch = before.cells_per_patch,
             .least_mass = before.least_mass,
             .columns = before.columns,
             .splits = before.splits,
             .rigid_bodies = before.rigid_bodies};
  end.use = alike ? StateUse::alike : StateUse::other_run;
  return end;
}

}  // namespace lahar
