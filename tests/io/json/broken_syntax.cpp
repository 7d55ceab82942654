#include <doctest/doctest.h>

#include "tests/io/scenario/broken_case.h"

using namespace lahar::broken;

// clang-format off
TEST_CASE("scenarios that are no JSON are refused at the place where they stop being so") {
  const std::vector<Entry> table = {
    {"the scenario is missing",
     {absent("mpm.json")},
     {},
     R"(mpm.json: error: the scenario does not exist
)"},
    {"the scenario is a folder",
     {folder("mpm.json")},
     {},
     R"(mpm.json: error: the scenario is a folder, not a file
)"},
    {"the scenario is empty",
     {write("mpm.json", "")},
     {},
     R"(mpm.json: error: the scenario is empty
)"},
    {"the scenario is blank",
     {write("mpm.json", R"(  

)")},
     {},
     R"(mpm.json: error: the file is empty
)"},
    {"the scenario is truncated",
     {replace("mpm.json", R"("nsteps": 10},
  "post_processing": {"output_steps": 5}
}
)", "\"nsteps\": 10")},
     {},
     R"(mpm.json:19:65: error: syntax error while parsing object - unexpected end of input; expected '}'
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 10
                                                                  ^
  hint: the text ends too early: a '}', ']' or '"' is missing
)"},
    {"a text does not end",
     {replace("mpm.json", "\"title\": \"Broken\",", "\"title\": \"Broken,")},
     {},
     R"(mpm.json:2:12: error: syntax error while parsing value - invalid string: control character U+000A (LF) must be escaped to \u000A or \n
    "title": "Broken,
             ^
)"},
    {"a comma too many",
     {replace("mpm.json", "\"output_steps\": 5}", "\"output_steps\": 5,}")},
     {},
     R"(mpm.json:20:41: error: syntax error while parsing object key - unexpected '}'; expected string literal
    "post_processing": {"output_steps": 5,}
                                          ^
  hint: remove the comma before this '}'
)"},
    {"a comma too few",
     {replace("mpm.json", "\"title\": \"Broken\",", "\"title\": \"Broken\"")},
     {},
     R"(mpm.json:3:3: error: syntax error while parsing object - unexpected string literal; expected '}'
    "mesh": {
    ^
  hint: a comma is missing before it
)"},
    {"a key without quotes",
     {replace("mpm.json", "\"title\"", "title")},
     {},
     R"(mpm.json:2:3: error: syntax error while parsing object key - invalid literal; expected string literal
    title: "Broken",
    ^
  hint: names of keys are in double quotes: "title"
)"},
    {"NaN is no JSON",
     {replace("mpm.json", "\"dt\": 0.001", "\"dt\": NaN")},
     {},
     R"(mpm.json:19:47: error: syntax error while parsing value - invalid literal
    "analysis": {"type": "MPMExplicit2D", "dt": NaN, "nsteps": 10},
                                                ^
)"},
    {"a number beyond doubles",
     {replace("mpm.json", "\"dt\": 0.001", "\"dt\": 1e999")},
     {},
     R"(mpm.json:19:47: error: number overflow parsing '1e999'
    "analysis": {"type": "MPMExplicit2D", "dt": 1e999, "nsteps": 10},
                                                ^
)"},
    {"a number with a leading zero",
     {replace("mpm.json", "\"nsteps\": 10", "\"nsteps\": 010")},
     {},
     R"(mpm.json:19:64: error: syntax error while parsing object - unexpected number literal; expected '}'
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 010},
                                                                 ^
)"},
    {"two values",
     {replace("mpm.json", R"("output_steps": 5}
})", R"("output_steps": 5}
} {})")},
     {},
     R"(mpm.json:21:3: error: syntax error while parsing value - unexpected '{'; expected end of input
  } {}
    ^
)"},
    {"a key twice",
     {replace("mpm.json", "\"nsteps\": 10", "\"nsteps\": 10, \"dt\": 0.1")},
     {},
     R"(mpm.json:19:68: error: 'dt' occurs twice in the same object; the first is on line 19
    "analysis": {"type": "MPMExplicit2D", "dt": 0.001, "nsteps": 10, "dt": 0.1},
                                                                     ^
)"},
    {"an array in place of the scenario",
     {write("mpm.json", R"([1, 2]
)")},
     {},
     R"(mpm.json:1:1: error: a scenario must be an object, found array [1, 2]
  [1, 2]
  ^
)"},
    {"a comment that does not end",
     {replace("mpm.json", "\"title\"", "/* \"title\"")},
     {},
     R"(mpm.json:21:2: error: syntax error while parsing object key - invalid comment; missing closing '*/'; expected string literal
  }
   ^
)"},
    {"bytes that are no UTF-8",
     {replace("mpm.json", "Broken", "Br\xFF" "ken")},
     {},
     "mpm.json:2:15: error: syntax error while parsing value - invalid string: ill-formed UTF-8 byte\n    \"title\": \"Br\\xffken\",\n                ^\n"},
    {"nested too deeply",
     {write("mpm.json", std::string(120, '[') + std::string(120, ']') + "\n")},
     {},
     R"(mpm.json:1:101: error: arrays and objects are nested more than 100 levels deep
  [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]
                                                                                  ^
)"},
  };
  check(table, 18);
}
