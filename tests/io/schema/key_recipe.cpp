// The recipe of CONTRIBUTING.md for a key of the input: what follows from one row.
#include <doctest/doctest.h>

#include "io/json/values.h"
#include "io/schema/keys.h"
#include "tests/contributing.h"

using namespace lahar;

namespace {

const Section& section() {
  static const Section example{.name = "loads",
                               .path = "loads",
                               .help = "What acts.",
                               .keys = {
#include "tests/recipes/key.inc"
                               }};
  return example;
}

/// What a user reads of these loads, and the value that a reader gets.
struct Outcome {
  std::string problems;
  std::optional<double> value;
};
Outcome check(const std::string& text) {
  ProblemList problems;
  JsonDocument document("loads.json", text, problems);
  check_section(section(), document.root, 2, document, problems);
  return {format_problems(problems.errors("loads.json")),
          get_number(document.root, "gravity_time")};
}

}  // namespace

TEST_CASE("the key of CONTRIBUTING.md is read, bounded and has its default") {
  CHECK(test::contributing_has("tests/recipes/key.inc"));
  CHECK(check(R"({"gravity_time": 2.5})").value == 2.5);
  CHECK(check("{}").value == 0);
  CHECK(check("{}").problems == "");
  const Outcome below = check(R"({"gravity_time": -1})");
  CHECK_FALSE(below.value);
  CHECK(below.problems ==
        R"(loads.json:1:18: error: 'gravity_time' must be at least 0 [s], found -1 [/gravity_time]
  {"gravity_time": -1}
                   ^
)");
  CHECK(check(R"({"gravity_time": "soon"})").problems.find("must be a number [s], found text") !=
        std::string::npos);
  CHECK(check(R"({"gravity_tme": 1})").problems.find("did you mean 'gravity_time'?") !=
        std::string::npos);
}

TEST_CASE("the key of CONTRIBUTING.md is in the schema and in the reference") {
  CHECK(section_schema(section()) == R"({
  "type": "object",
  "description": "What acts.",
  "properties": {
    "gravity_time": {
      "description": "time in which gravity grows from zero to its value [s]",
      "default": 0,
      "anyOf": [
        {
          "type": "number",
          "minimum": 0
        }
      ]
    }
  },
  "additionalProperties": false
}
)");
  CHECK(section_reference(section()) == R"(
## loads

What acts.

| key | value | unit | default | meaning |
|---|---|---|---|---|
| `gravity_time` | a number, >= 0 | s | `0` | time in which gravity grows from zero to its value *(Lahar)* |
)");
}
