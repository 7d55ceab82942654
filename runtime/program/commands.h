/// \file The commands of the program: one line each. What a command takes and does is in its own
/// file, runtime/program/NAME_command.cpp.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/scenario/scenario.h"
#include "runtime/base/exit_codes.h"

namespace lahar {

/// The words of the command line, the program's name first.
using Words = std::vector<std::string>;

/// What a command does with its options once they are there; returns the exit code.
using Action = std::function<int(const Words&)>;

struct Command {
  const char* name;
  const char* help;
  Action (*add_options)(CLI::App& command);  ///< to its command line
};

Action add_run(CLI::App& command);
Action add_check(CLI::App& command);
Action add_safety(CLI::App& command);
Action add_export(CLI::App& command);
Action add_compare(CLI::App& command);
Action add_picture(CLI::App& command);
Action add_report(CLI::App& command);
Action add_watch(CLI::App& command);
Action add_graph(CLI::App& command);
Action add_trace(CLI::App& command);
Action add_material(CLI::App& command);
Action add_verify(CLI::App& command);
Action add_bench(CLI::App& command);
Action add_info(CLI::App& command);

inline constexpr Command commands[] = {
    {"run", "Run a case", add_run},
    {"check", "Validate a case and print sizes and limits, without a run", add_check},
    {"safety",
     "Find the factor of safety by strength reduction: of materials, rigid bodies, walls, contact",
     add_safety},
    {"export", "Write particles as CSV, for ParaView or for CB-Geo MPM", add_export},
    {"compare", "Compare two outputs, field by field", add_compare},
    {"picture", "Draw a field of the particles as PNG or SVG, or a film of all frames",
     add_picture},
    {"report", "Write a page for browsers with all results of a run, or of several", add_report},
    {"watch", "Show the progress of a run until it ends", add_watch},
    {"graph", "Draw the task graph of one time step as DOT, SVG, PNG or PDF", add_graph},
    {"trace", "Analyse a trace that lahar run --trace recorded", add_trace},
    {"material", "Drive one material point along a strain or stress path", add_material},
    {"verify", "Compare a case with its solution in the literature", add_verify},
    {"bench", "Measure time per particle and step, scaling, memory and start-up", add_bench},
    {"info", "Print version, build and features, or the reference of the input", add_info},
};

/// The command that the words ask for; returns its exit code. Throws what it throws, and InputError
/// where the words are not understood.
int run_program(std::span<const Command> known, const Words& words);

/// The scenario and its options, which several commands share.
void add_scenario(CLI::App& command, std::string& scenario, ScenarioOptions& options);

/// For an option that takes a step number, or one of these words.
std::function<std::string(const std::string&)> step_or(std::vector<std::string> words);

/// For an option that takes a number above 0, or one that is not below 0. CLI11's own checks print
/// the largest number with all its digits.
std::string above_zero(const std::string& text);
std::string not_below_zero(const std::string& text);

/// Refuse rather than do the same several times. Throws InputError.
void refuse_several_ranks(const char* command);

}  // namespace lahar
