// `lahar compare`.
#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "io/base/text.h"
#include "io/results/compare.h"
#include "runtime/program/commands.h"

namespace lahar {

namespace {

struct CompareArguments {
  std::string a, b;
  Tolerances tolerances;
  std::optional<Index> step;
};

int compare_command(const CompareArguments& arguments) {
  const Comparison comparison =
      compare(std::filesystem::path(arguments.a), std::filesystem::path(arguments.b),
              arguments.tolerances, arguments.step);
  fmt::print("{}", printable_lines(comparison.text()));
  return comparison.passed ? exit_ok : exit_internal;
}

}  // namespace

Action add_compare(CLI::App& command) {
  const auto arguments = std::make_shared<CompareArguments>();
  command.add_option("A", arguments->a, "Run folder, frame or CSV table")->required();
  command.add_option("B", arguments->b, "The reference: run folder, frame or CSV table")
      ->required();
  command
      .add_option("--rtol", arguments->tolerances.rtol,
                  "Relative tolerance, to the field's largest magnitude in B")
      ->check(not_below_zero)
      ->capture_default_str();
  command
      .add_option("--atol", arguments->tolerances.atol, "Absolute tolerance, in the field's unit")
      ->check(not_below_zero)
      ->capture_default_str();
  command
      .add_option("--floor", arguments->tolerances.floor,
                  "A field counts as zero if all its values are below this")
      ->check(not_below_zero)
      ->capture_default_str();
  command.add_option("--step", arguments->step,
                     "Step to compare in run folders (default: the last)");
  return [arguments, &command](const Words&) {
    refuse_several_ranks("compare");
    Tolerances& tolerances = arguments->tolerances;
    // No tolerance asked for, none given: only equal values are equal.
    if (tolerances.rtol == 0 && command.count("--floor") == 0) tolerances.floor = 0;
    return compare_command(*arguments);
  };
}

}  // namespace lahar
