// The recipe of CONTRIBUTING.md for a command: its file and its row.
#include <doctest/doctest.h>

#include <set>
#include <string>

#include "physics/base/error.h"
#include "tests/contributing.h"
#include "tests/io/frames/frame_samples.h"
#include "tests/recipes/command.inc"

using namespace lahar;

namespace {

constexpr Command with_mass[] = {
#include "tests/recipes/command_row.inc"
};

std::string refusal(const Words& words) {
  try {
    run_program(with_mass, words);
  } catch (const InputError& error) {
    return error.problems().front().message;
  }
  return "";
}

}  // namespace

TEST_CASE("the command of CONTRIBUTING.md does its work and understands its options") {
  CHECK(test::contributing_has("tests/recipes/command.inc"));
  CHECK(test::contributing_has("tests/recipes/command_row.inc"));
  const test::TemporaryFolder folder;
  const auto file = folder.path / "frame.hdf";
  write_frame(test::two_particles(), file);
  CHECK(run_program(with_mass, {"lahar", "mass", file.string(), "--digits", "3"}) == exit_ok);
  CHECK(refusal({"lahar", "mass", file.string(), "--digits", "18"}) != "");
  CHECK(refusal({"lahar", "mass"}) != "");
  CHECK(refusal({"lahar", "run"}) != "");
  CHECK_THROWS_AS(run_program(with_mass, {"lahar", "mass", "no such file"}), IoError);
}

TEST_CASE("commands have names of their own") {
  std::set<std::string> names;
  for (const Command& command : commands) names.insert(command.name);
  CHECK(names.size() == std::size(commands));
}
