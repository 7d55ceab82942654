#include "runtime/trace/command.h"

#include <fmt/format.h>

#include "runtime/commands.h"
#include "runtime/trace/analysis.h"
#include "runtime/trace/chrome.h"

namespace lahar {

namespace {

int check(const TraceLog& log) {
  const std::vector<std::string> problems = problems_of(log);
  for (const std::string& problem : problems) fmt::print("{}\n", problem);
  if (problems.empty())
    fmt::print("sound: {} tasks, {} messages, steps {} to {}\n", log.tasks.size(),
               log.messages.size(), log.run.first, log.run.last);
  return problems.empty() ? exit_ok : exit_internal;
}

}  // namespace

int trace_command(const TraceArguments& arguments) {
  const TraceLog log = read_trace(arguments.run);
  if (arguments.check) return check(log);
  if (!arguments.chrome.empty()) {
    write_chrome(log, arguments.chrome);
    fmt::print("{}\nopen it at https://ui.perfetto.dev\n", arguments.chrome);
    return exit_ok;
  }
  const TraceReport report = analyse(log);
  fmt::print("{}", arguments.json ? json_of(log, report) + "\n" : text_of(log, report));
  return exit_ok;
}

}  // namespace lahar
