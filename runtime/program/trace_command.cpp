// Options of `lahar trace`.
#include "runtime/program/commands.h"
#include "runtime/trace/analyse/command.h"

namespace lahar {

Action add_trace(CLI::App& command) {
  const auto arguments = std::make_shared<TraceArguments>();
  command.add_option("RUN", arguments->run, "Run folder")->required();
  command.add_flag("--json", arguments->json, "Print all figures as JSON");
  command
      .add_option("--chrome", arguments->chrome,
                  "Write trace events for ui.perfetto.dev, as .json or .json.gz")
      ->type_name("FILE");
  command.add_option("--otf2", arguments->otf2, "Write an OTF2 archive, for Vampir (if built so)")
      ->type_name("FOLDER");
  command.add_option("--html", arguments->html, "Write a page for a browser, with a timeline")
      ->type_name("FILE");
  command.add_flag("--check", arguments->check, "Only check whether the trace is sound");
  auto* replay_option =
      command.add_option("--replay", arguments->replay,
                         "Simulate the run with another network: ideal, measured, or a JSON "
                         "file with latency, bandwidth and overhead");
  replay_option->type_name("NETWORK");
  command.add_option("--ranks", arguments->ranks, "Ranks of the replay (default: as recorded)")
      ->needs(replay_option)
      ->check(CLI::Range(1, 100'000));
  command
      .add_option("--threads,-t", arguments->threads,
                  "Threads per rank of the replay or projection (default: as recorded)")
      ->check(CLI::Range(1, 4096));
  command.add_flag("--bulk-synchronous", arguments->bulk, "Replay with a barrier after each phase")
      ->needs(replay_option);
  auto* project_option = command.add_flag(
      "--project", arguments->project,
      "Project weak and strong scaling to 100,000 cores, with the task graph and with barriers");
  command
      .add_flag("--steady", arguments->steady,
                "Project with the median time of each task, without noise of this machine")
      ->needs(project_option);
  return [arguments](const Words&) {
    refuse_several_ranks("trace");
    return trace_command(*arguments);
  };
}

}  // namespace lahar
