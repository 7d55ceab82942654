/// \file Options of `lahar run` for those who study its performance.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "physics/base/error.h"
#include "runtime/program/run_arguments.h"

namespace lahar {

inline CLI::AsNumberWithUnit time_with_unit() {
  return CLI::AsNumberWithUnit(
      std::map<std::string, double>{{"us", 1e-6}, {"ms", 1e-3}, {"s", 1.0}},
      CLI::AsNumberWithUnit::Options::UNIT_REQUIRED);
}

/// "A:B" -> two numbers; the second may need a unit of time. Throws InputError.
inline std::pair<Index, double> pair_of(const std::string& option, const std::string& text,
                                        bool time) {
  const auto colon = text.find(':');
  const auto refuse = [&]() -> std::pair<Index, double> {
    throw InputError(
        fmt::format("{} must be {}, found '{}'.", option,
                    time ? "NUMBER:TIME such as 1:300us" : "NUMBER:NUMBER such as 5:10", text));
  };
  if (colon == std::string::npos || colon == 0 || colon > 18 ||
      text.find_first_not_of("0123456789") != colon)
    return refuse();
  std::string value = text.substr(colon + 1);
  try {
    if (time) time_with_unit()(value);
    std::size_t used = 0;
    const double number = std::stod(value, &used);
    if (used != value.size() || !(number >= 0)) return refuse();
    return {std::stoll(text.substr(0, colon)), number};
  } catch (const std::exception&) {
    return refuse();
  }
}

/// What an analyst of performance asks for beside the run itself.
struct StudyOptions {
  bool trace = false;
  std::string steps, slow_patch, late_sends;

  void add_to(CLI::App& command, RunArguments& run) {
    command.add_flag("--trace", trace,
                     "Record what each task, message and thread does, for lahar trace");
    command.add_option("--trace-steps", steps, "Record only these steps, such as 100:120")
        ->type_name("FIRST:LAST");
    command
        .add_option("--inject-latency", run.execution.latency,
                    "For studies: delay each message between ranks by this time, such as 200us, "
                    "and each reduction by this time times ceil(log2 ranks)")
        ->transform(time_with_unit())
        ->check(CLI::Range(0.0, 10.0))
        ->type_name("TIME");
    command.add_flag_callback(
        "--no-shared-memory", [&run] { run.execution.shared_memory = false; },
        "For studies: send messages between ranks of a machine through MPI, like those between "
        "machines");
    command
        .add_option("--slow-patch", slow_patch,
                    "For studies: tasks of this patch take this many times as long, such as 5:10")
        ->type_name("PATCH:FACTOR");
    command
        .add_option(
            "--late-sends", late_sends,
            "For studies: this rank waits for this time before it sends a message, such as 1:300us")
        ->type_name("RANK:TIME");
    command
        .add_option("--serial-section", run.execution.delays.serial,
                    "For studies: one thread of each rank is busy for this time after each step, "
                    "such as 1ms. Patches can be at most 4 steps ahead of it")
        ->transform(time_with_unit())
        ->check(CLI::Range(0.0, 10.0))
        ->type_name("TIME");
  }
  void give(RunArguments& run) const {
    StudyDelays& delays = run.execution.delays;
    if (!slow_patch.empty()) {
      std::tie(delays.slow_patch, delays.slow_factor) = pair_of("--slow-patch", slow_patch, false);
      if (delays.slow_factor < 1)
        throw InputError("--slow-patch must be at least 1 times slower, found '" + slow_patch +
                         "'.");
    }
    if (!late_sends.empty()) {
      const auto [rank, time] = pair_of("--late-sends", late_sends, true);
      delays.late_rank = static_cast<int>(rank);
      delays.late = time;
    }
    if (!steps.empty()) {
      const auto [first, last] = pair_of("--trace-steps", steps, false);
      run.trace = {.first = first, .last = static_cast<Step>(last)};
      if (run.trace->last < first)
        throw InputError("--trace-steps must be FIRST:LAST with FIRST not above LAST, found '" +
                         steps + "'.");
    } else if (trace) {
      run.trace = TraceWindow{};
    }
  }
};

}  // namespace lahar
