// `lahar report`.
#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "io/base/atomic_file.h"
#include "io/base/text.h"
#include "runtime/program/commands.h"
#include "runtime/report/report_page.h"

namespace lahar {

namespace {

struct ReportArguments {
  std::vector<std::string> runs;
  std::string output;
  ReportOptions options;
};

int report_command(const ReportArguments& arguments) {
  namespace fs = std::filesystem;
  std::vector<RunResults> runs;
  for (const std::string& run : arguments.runs) runs.push_back(read_run(run));
  // Runs of the same name, such as those in folders of two studies, are told apart by their place.
  std::map<std::string, int> count;
  for (const RunResults& run : runs) ++count[run.label];
  for (std::size_t k = 0; k < runs.size(); ++k)
    if (count[runs[k].label] > 1) runs[k].label = arguments.runs[k];
  const std::string page = report_page(runs, arguments.options);
  const fs::path output = arguments.output.empty() ? fs::path(arguments.runs[0]) / "report.html"
                                                   : fs::path(arguments.output);
  write_text_file(output, page);
  fmt::print("{}\n", printable(output.string()));
  return exit_ok;
}

}  // namespace

Action add_report(CLI::App& command) {
  const auto arguments = std::make_shared<ReportArguments>();
  command.add_option("RUN", arguments->runs, "Run folder; several are compared")->required();
  command
      .add_option("--field", arguments->options.fields,
                  "What colours show (repeatable; default: speed, displacement and a field of the "
                  "material)")
      ->expected(1)
      ->take_all();
  CLI::Option* times =
      command
          .add_option("--times", arguments->options.times, "Pictures of the first field over time")
          ->check(CLI::Range(1, 24))
          ->capture_default_str();
  command
      .add_option("--at", arguments->options.at,
                  "Times of these pictures [s] (repeatable); the nearest frames are taken")
      ->expected(1)
      ->take_all()
      ->check(CLI::NonNegativeNumber)
      ->excludes(times);
  command
      .add_option("--points", arguments->options.budget.points,
                  "Particles of the 3D view in a frame, of all runs together")
      ->check(CLI::Range(100, 200000))
      ->capture_default_str();
  command.add_option("--frames", arguments->options.budget.frames, "Frames of the 3D view")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_option("--output,-o", arguments->output, "Page to write (default: RUN/report.html)");
  return [arguments](const Words&) {
    refuse_several_ranks("report");
    return report_command(*arguments);
  };
}

}  // namespace lahar
