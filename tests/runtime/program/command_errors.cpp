// What is said of arguments that cannot be understood.
#include "runtime/program/command_errors.h"

#include <doctest/doctest.h>

#include <string>

#include "runtime/program/commands.h"

namespace lahar {

namespace {

/// Messages and hints for a command line of "lahar", which has the commands run and check.
std::string said_of(const std::string& arguments) {
  CLI::App app("about", "lahar");
  app.require_subcommand(1);
  std::string scenario;
  int threads = 0;
  double seconds = 0, floor = 0;
  auto* run = app.add_subcommand("run");
  run->add_option("SCENARIO", scenario)->required();
  run->add_option("--threads,-t", threads)->check(CLI::Range(1, 8));
  run->add_option("--wall-time", seconds)->check(above_zero);
  run->add_option("--floor", floor)->check(not_below_zero);
  app.add_subcommand("check");
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& error) {
    std::string text;
    for (const Problem& problem : argument_problems(app, error))
      text += problem.message + "; " + problem.hint + "\n";
    return text;
  }
  return "";
}

}  // namespace

TEST_CASE("arguments that are not understood are named, with what was meant or is allowed") {
  CHECK(said_of("run case.json -t 2") == "");
  CHECK(said_of("") == "a command is missing; commands: run, check\n");
  CHECK(said_of("chek case.json") == "there is no command 'chek'; did you mean 'check'?\n");
  CHECK(said_of("rnu case.json --threads 4") == "there is no command 'rnu'; did you mean 'run'?\n");
  CHECK(said_of("--halp") == "lahar has no option '--halp'; did you mean '--help'?\n");
  // The 2 became the scenario, and the scenario is left over.
  CHECK(said_of("run --threds 2 case.json") ==
        "lahar run has no option '--threds'; did you mean '--threads'?\n");
  CHECK(said_of("run case.json --threds=2 --zzz") ==
        "lahar run has no option '--threds'; did you mean '--threads'?\n"
        "lahar run has no option '--zzz'; see lahar run --help\n");
  CHECK(said_of("--threads 2 run case.json") ==
        "lahar has no option '--threads'; options of lahar run come after it\n");
  CHECK(said_of("run -t 99 -- case.json") ==
        "--threads: Value 99 not in range 1 to 8; see lahar run --help\n");
  CHECK(said_of("run a.json b.json") ==
        "'b.json' is one argument too many for lahar run; see lahar run --help\n");
  CHECK(said_of("run") == "SCENARIO is required; see lahar run --help\n");
  CHECK(said_of("run case.json -t 9") ==
        "--threads: Value 9 not in range 1 to 8; see lahar run --help\n");
}

TEST_CASE("numbers with one limit are refused without the largest number there is") {
  CHECK(said_of("run case.json --wall-time 0.5 --floor 0") == "");
  for (const std::string text : {"0", "-1", "abc", "nan", "inf"})
    CHECK(said_of("run case.json --wall-time=" + text) ==
          "--wall-time: must be a number above 0, found '" + text + "'; see lahar run --help\n");
  CHECK(said_of("run case.json --floor=-1e-9") ==
        "--floor: must be 0 or a number above it, found '-1e-9'; see lahar run --help\n");
}

}  // namespace lahar
