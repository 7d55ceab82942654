// What is said of a case before it runs.
#include "runtime/program/run_description.h"

#include <doctest/doctest.h>

using namespace lahar;

namespace {

std::vector<std::string> said_of(const std::vector<std::string>& loads) {
  std::vector<std::string> lines;
  Console console(Console::Voice::normal,
                  {.line = [&](const std::string& line) { lines.push_back(line); }});
  describe_loads(console, loads);
  return lines;
}

}  // namespace

TEST_CASE("loads are said one per line, of many the first, and without any nothing") {
  CHECK(said_of({}).empty());
  CHECK(said_of({"top: 1 N", "side: 2 N"}) ==
        std::vector<std::string>{"loads      top: 1 N", "           side: 2 N"});
  CHECK(said_of({"a", "b", "c", "d", "e"}).back() == "           e");
  const auto many = said_of({"a", "b", "c", "d", "e", "f"});
  REQUIRE(many.size() == 5);
  CHECK(many[3] == "           d");
  CHECK(many[4] == "           ... (6 in all)");
}
