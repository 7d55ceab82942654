#include "runtime/trace/analyse/command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>

#include "io/base/text.h"
#include "physics/base/error.h"
#include "runtime/base/exit_codes.h"
#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/chrome.h"
#include "runtime/trace/analyse/otf2.h"
#include "runtime/trace/analyse/page.h"
#include "runtime/trace/analyse/project.h"
#include "runtime/trace/analyse/replay.h"

namespace lahar {

namespace {

/// With --json standard output has nothing but that.
void tell_file(const TraceArguments& arguments, const std::string& file, const char* hint) {
  fmt::print(arguments.json ? stderr : stdout, "{}\n{}", printable(file), hint);
}

/// The trace may be of anyone.
void print(const std::string& text) {
  fmt::print("{}", printable_lines(text));
}

int check(const TraceLog& log) {
  const std::vector<std::string> problems = problems_of(log);
  for (const std::string& problem : problems) print(problem + "\n");
  if (problems.empty())
    fmt::print("sound: {} tasks, {} messages, steps {} to {}\n", log.tasks.size(),
               log.messages.size(), log.run.first, log.run.last);
  return problems.empty() ? exit_ok : exit_internal;
}

void write_page(const TraceLog& log, const TraceReport& report, const std::string& file) {
  const std::string page = page_of(log, report);
  std::ofstream out(file, std::ios::binary);
  out.write(page.data(), static_cast<std::streamsize>(page.size()));
  out.close();
  if (!out) throw IoError("cannot write " + file + ": " + std::strerror(errno));
}

int print_replay(const TraceLog& log, const TraceArguments& arguments) {
  const Replay result = replay(log, {.ranks = arguments.ranks,
                                     .threads = arguments.threads,
                                     .network = read_network(arguments.replay),
                                     .bulk_synchronous = arguments.bulk});
  print(arguments.json ? json_of(result) + "\n" : text_of(result));
  return exit_ok;
}

int print_projection(const TraceLog& log, const TraceArguments& arguments) {
  ProjectionAsk ask{.threads = arguments.threads, .steady = arguments.steady};
  if (!arguments.replay.empty()) ask.network = read_network(arguments.replay);
  const ScalingProjection result = project(log, ask);
  print(arguments.json ? json_of(result) + "\n" : text_of(result));
  return exit_ok;
}

/// What is lost to messages with a network that takes no time is serialisation, the rest transfer.
void split_communication(const TraceLog& log, Efficiencies& efficiencies) {
  if (log.run.ranks == 1) return;
  const Replay ideal = replay(log, {.network = Network::ideal()});
  // Where tasks of a worker overlap, which no sound trace has, more than all is useful.
  efficiencies.transfer =
      std::max(efficiencies.communication, std::min(1.0, ideal.total / log.run.wall));
  efficiencies.serialisation = efficiencies.communication / efficiencies.transfer;
  efficiencies.replayed = true;
}

}  // namespace

int trace_command(const TraceArguments& arguments) {
  const TraceLog log = read_trace(arguments.run);
  if (arguments.check) return check(log);
  std::optional<TraceReport> report;
  const auto analysed = [&]() -> const TraceReport& {
    if (!report) {
      report = analyse(log);
      split_communication(log, report->efficiencies);
    }
    return *report;
  };
  // All that is asked for is written; text is for who asks for no file.
  const bool files =
      !arguments.chrome.empty() || !arguments.otf2.empty() || !arguments.html.empty();
  if (!arguments.chrome.empty()) {
    write_chrome(log, arguments.chrome);
    tell_file(arguments, arguments.chrome, "open it at https://ui.perfetto.dev\n");
  }
  if (!arguments.otf2.empty()) {
    write_otf2(log, arguments.otf2);
    tell_file(arguments, arguments.otf2 + "/trace.otf2", "");
  }
  if (!arguments.html.empty()) {
    write_page(log, analysed(), arguments.html);
    tell_file(arguments, arguments.html, "open it with a browser\n");
  }
  if (arguments.project) return print_projection(log, arguments);  // on the network of --replay
  if (!arguments.replay.empty()) return print_replay(log, arguments);
  if (!files || arguments.json)
    print(arguments.json ? json_of(log, analysed()) + "\n" : text_of(log, analysed()));
  return exit_ok;
}

}  // namespace lahar
