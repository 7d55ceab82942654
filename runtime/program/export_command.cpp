// `lahar export`.
#include <fmt/format.h>

#include "io/base/text.h"
#include "io/results/export.h"
#include "runtime/program/commands.h"

namespace lahar {

namespace {

struct ExportArguments {
  std::string run, format, step = "last", output;
  double spacing = 0;
};

int export_command(const ExportArguments& arguments) {
  std::vector<Problem> warnings;
  for (const auto& file :
       export_run(arguments.run, export_format(arguments.format), frame_choice(arguments.step),
                  arguments.output, arguments.spacing, &warnings))
    fmt::print("{}\n", printable(file.string()));
  if (!warnings.empty()) fmt::print(stderr, "{}", format_problems(warnings, "warning", false));
  return exit_ok;
}

}  // namespace

Action add_export(CLI::App& command) {
  const auto arguments = std::make_shared<ExportArguments>();
  command.add_option("RUN", arguments->run, "Run folder or frame")->required();
  command.add_option("--to", arguments->format, "csv, vtu, cbgeo; stl, vtp: free surface")
      ->required();
  command.add_option("--step", arguments->step, "Step number, last (default) or all")
      ->check(step_or({"all", "last"}));
  command.add_option("--output,-o", arguments->output,
                     "File or folder to write (default: RUN/export)");
  command
      .add_option("--spacing", arguments->spacing,
                  "Spacing of the grid for a free surface [m] (default: two distances of "
                  "particles; below 1.3 it has holes)")
      ->check(above_zero);
  return [arguments](const Words&) {
    refuse_several_ranks("export");
    return export_command(*arguments);
  };
}

}  // namespace lahar
