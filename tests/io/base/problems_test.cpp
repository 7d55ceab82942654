#include "io/base/problems.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <string>

#include "io/base/team.h"
#include "tests/io/base/thread_team.h"

using namespace lahar;

namespace {

void find_many(ProblemList& problems, int errors, int warnings) {
  for (int k = 0; k < errors; ++k) problems.error({.message = fmt::format("error {}", k)});
  for (int k = 0; k < warnings; ++k) problems.warning({.message = fmt::format("warning {}", k)});
}

}  // namespace

TEST_CASE("the first hundred problems of a kind are kept, the rest is counted") {
  ProblemList problems;
  find_many(problems, 250, 100'000);
  CHECK(problems.count() == 250);
  const auto errors = problems.errors("mpm.json");
  REQUIRE(errors.size() == 101);
  CHECK(errors[99].message == "error 99");
  CHECK(errors[100].message == "and 150 more problems");
  const auto warnings = problems.take_warnings("mpm.json");
  REQUIRE(warnings.size() == 101);
  CHECK(warnings[99].message == "warning 99");
  CHECK(warnings[100].message == "and 99900 more warnings");
  CHECK(problems.take_warnings("mpm.json").empty());
}

TEST_CASE("what one of a team found, all of them know: what is kept, and how many more") {
  run_team(3, [](const Team& team) {
    ProblemList problems;
    find_many(problems, 0, 30);
    by_the_first(team, problems, [](ProblemList& found) { find_many(found, 130, 120); });
    CHECK(problems.count() == 130);
    CHECK(problems.errors("").back().message == "and 30 more problems");
    const auto warnings = problems.take_warnings("");
    REQUIRE(warnings.size() == 101);
    CHECK(warnings[30].message == "warning 0");
    CHECK(warnings[100].message == "and 50 more warnings");
  });
}

TEST_CASE("a misspelt name is told, however long it is") {
  CHECK(nearest("displacments", {"stresses", "displacements"}) == "displacements");
  CHECK(nearest("abc", {"abcd", "xyz"}) == "abcd");
  CHECK(nearest(std::string(1'000'000, 'a'), {"stresses", "displacements"}).empty());
}
