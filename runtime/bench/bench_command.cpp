#include "runtime/bench/bench_command.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <optional>

#include "graph/executor.h"
#include "io/base/atomic_file.h"
#include "runtime/base/exit_codes.h"
#include "runtime/bench/bench_machine.h"
#include "runtime/bench/bench_measure.h"
#include "runtime/terminal/console.h"
#include "runtime/terminal/version.h"

namespace lahar {

namespace {

/// What is being done, on standard error: one line that changes on a terminal, one per case
/// otherwise. Standard output has the report alone.
class Progress {
 public:
  ~Progress() { clear(); }
  void begin(const std::string& name) {
    name_ = name;
    if (!terminal_) fmt::print(stderr, "lahar bench: {}\n", name);
  }
  void say(const std::string& what) {
    if (!terminal_) return;
    fmt::print(stderr, "\r\033[K{}: {}", name_, what);
    std::fflush(stderr);
  }
  void clear() {
    if (terminal_) fmt::print(stderr, "\r\033[K");
  }

 private:
  bool terminal_ = is_terminal(STDERR_FILENO);
  std::string name_;
};

BenchProtocol protocol_of(const BenchArguments& arguments) {
  BenchProtocol protocol;
  constexpr int quick_repeats = 3;
  constexpr double quick_seconds = 0.1;
  if (arguments.quick) {
    protocol.repeats = quick_repeats;
    protocol.sample_seconds = quick_seconds;
  }
  if (arguments.repeats > 0) protocol.repeats = arguments.repeats;
  protocol.steps = arguments.steps;
  protocol.threads = arguments.threads > 0 ? arguments.threads : available_threads();
  return protocol;
}

void list(const std::vector<BenchPlan>& plans) {
  for (const BenchPlan& plan : plans)
    fmt::print("{:<18} {:<62} {:>9}{}\n", plan.name, plan.title, format_bytes(plan.bytes()),
               plan.large ? "  large" : "");
}

BenchResult measure_all(const std::vector<BenchPlan>& plans, const BenchProtocol& protocol) {
  BenchResult result;
  result.date = fmt::format(
      "{:%Y-%m-%dT%H:%M:%SZ}",
      fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
  result.version = version_line();
  result.build = compiler_line();
  result.protocol = protocol;
  result.machine = describe_machine();
  Progress progress;
  progress.begin("machine");
  progress.say("bandwidth and multiply-add peak");
  result.machine.rates = measure_machine(protocol.threads, protocol);
  for (const BenchPlan& plan : plans) {
    progress.begin(plan.name);
    result.cases.push_back(measure(plan, protocol, result.machine,
                                   [&](const std::string& what) { progress.say(what); }));
  }
  return result;
}

void announce_large(const std::vector<BenchPlan>& plans, int repeats) {
  for (const BenchPlan& plan : plans)
    if (plan.large)
      fmt::print(stderr, "lahar bench: {} needs about {} of memory and {}\n", plan.name,
                 format_bytes(plan.bytes()), format_seconds(plan.seconds(repeats)));
}

/// Throws IoError, before the measurement, where its result could not be written.
void check_writable(const std::string& file) {
  if (file.empty()) return;
  const AtomicFile atomic(file);
  OutputFile(atomic.temporary(), OutputFile::Mode::truncate, file).close();
}

BenchResult read_result(const std::string& file) {
  return parse_bench_json(read_text_file(file), file);
}

}  // namespace

int bench_command(const BenchArguments& arguments) {
  const BenchProtocol protocol = protocol_of(arguments);
  const std::vector<BenchPlan> all = bench_plans(protocol.threads);
  if (arguments.list) {
    list(all);
    return exit_ok;
  }
  // Whatever can be wrong is found before minutes are spent.
  std::vector<BenchPlan> plans =
      choose_plans(all, arguments.cases, arguments.large, protocol.threads);
  if (arguments.quick)
    for (BenchPlan& plan : plans)
      for (BenchJob& job : plan.jobs) job.steps = 0;
  std::optional<BenchResult> earlier;
  if (!arguments.compare.empty()) earlier = read_result(arguments.compare);
  check_writable(arguments.json);
  check_writable(arguments.markdown);
  BenchResult result;
  if (arguments.from.empty()) {
    check_bench_memory(plans, available_memory());
    announce_large(plans, protocol.repeats);
    result = measure_all(plans, protocol);
  } else {
    result = read_result(arguments.from);
  }

  std::string report = bench_markdown(result);
  if (earlier) report += bench_comparison(result, *earlier, arguments.compare);
  fmt::print("{}", report);
  if (!arguments.json.empty()) write_text_file(arguments.json, bench_json(result));
  if (!arguments.markdown.empty()) write_text_file(arguments.markdown, report);
  return exit_ok;
}

}  // namespace lahar
