// Options of `lahar verify`.
#include "runtime/verify/verify_command.h"

#include "runtime/program/commands.h"

namespace lahar {

Action add_verify(CLI::App& command) {
  const auto arguments = std::make_shared<VerifyArguments>();
  command.add_option("CASE", arguments->name, "Name of the case (default: list the cases)");
  command
      .add_option("--threads,-t", arguments->threads,
                  "Largest number of threads (default: all cores)")
      ->check(CLI::Range(1, 4096));
  command.add_option("--output,-o", arguments->output,
                     "Folder for pictures and tables (default: verify/CASE)");
  command.add_flag("--published", arguments->published,
                   "Use the published time step and duration: minutes instead of seconds");
  return [arguments](const Words&) {
    refuse_several_ranks("verify");
    return verify_command(*arguments);
  };
}

}  // namespace lahar
