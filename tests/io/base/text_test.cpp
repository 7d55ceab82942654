#include "io/base/text.h"

#include <doctest/doctest.h>

#include "io/base/problems.h"
#include "io/scenario/scenario.h"

using namespace lahar;

TEST_CASE("control characters of input are shown, and do nothing to a terminal") {
  CHECK(printable("\x1b[31mred\x1b[0m") == "\\x1b[31mred\\x1b[0m");
  CHECK(printable("a\nb\tc\r\x07\x7f") == "a\\nb\\tc\\x0d\\x07\\x7f");
  CHECK(printable_lines("a\n\tb\x1b") == "a\n\tb\\x1b");
  CHECK(printable("\xc2\x9b"
                  "31m") == "\\u009b31m");  // CSI as one character
  CHECK(printable("\xe2\x80\xaeright to left") == "\\u202eright to left");
  CHECK(printable(std::string("nul\0", 4)) == "nul\\x00");
}

TEST_CASE("UTF-8 of any language stays readable, what is not UTF-8 is shown by its bytes") {
  for (const char* text : {"Böschung", "пляж", "砂の柱", "σ_xx ≤ 5 kPa", "\xf0\x9f\x8c\x8b"})
    CHECK(printable(text) == text);
  CHECK(printable("\x9b") == "\\x9b");                    // a lone CSI
  CHECK(printable("\xc3") == "\\xc3");                    // cut short
  CHECK(printable("\xc0\x9b") == "\\xc0\\x9b");           // overlong
  CHECK(printable("\xed\xa0\x80") == "\\xed\\xa0\\x80");  // a surrogate
  CHECK(printable("\xf5\x80\x80\x80") == "\\xf5\\x80\\x80\\x80");
}

TEST_CASE("text for pages has no markup") {
  CHECK(xml_escaped("<script>\"a\" & b\x1b") == "&lt;script&gt;&quot;a&quot; &amp; b\\x1b");
}

TEST_CASE("texts are cut between characters") {
  CHECK(cut_text("Böschung", 2) == "B");
  CHECK(cut_text("Böschung", 3) == "Bö");
  CHECK(cut_text("abc", 8) == "abc");
  CHECK(text_width("Böschung") == 8);
}

TEST_CASE("the caret is below its column where what is before is escaped") {
  const auto shown = [](const std::string& source, int column) {
    return format_problems(
        {{.file = "a.json", .line = 1, .column = column, .message = "no", .source = source}});
  };
  CHECK(shown("a\x1b[31mb", 7) == "a.json:1:7: error: no\n  a\\x1b[31mb\n           ^\n");
  CHECK(shown("\xc2\x9bx", 3) == "a.json:1:3: error: no\n  \\u009bx\n        ^\n");
  CHECK(shown("ö\tx", 4) == "a.json:1:4: error: no\n  ö\tx\n   \t^\n");
  CHECK(shown("\xffx", 2) == "a.json:1:2: error: no\n  \\xffx\n      ^\n");
}

TEST_CASE("all parts of a message are safe: file, place, text and hint") {
  const std::string text = format_problems(
      {{.file = "\x1b", .where = "/a\x1b", .message = "key 'a\nb\x1b'", .hint = "\x1b\n"}});
  CHECK(text == "\\x1b: error: key 'a\\nb\\x1b' [/a\\x1b]\n  hint: \\x1b\\n\n");
}

TEST_CASE("words of any length are cut where a message quotes them") {
  const std::string word(std::size_t{1} << 20, '9');
  const std::string text =
      format_problems({{.file = "a.stl", .message = "found '" + word + "'", .hint = word}});
  CHECK(text.size() < 10000);
  CHECK(text.starts_with("a.stl: error: found '9999"));
  CHECK(text.find("9 ...\n  hint: 9") != std::string::npos);
}

TEST_CASE("names of a scenario are escaped in what is said of them") {
  std::string said;
  try {
    read_scenario_text(R"({"mesh": {"structured": {"cell_size": 1, "counts": [2, 2]}},
 "particles": [{"generator": {"type": "region", "material": "\u001b[31m\u009b"}}],
 "materials": [{"type": "LinearElastic", "density": 1, "youngs_modulus": 1, "poisson_ratio": 0}],
 "analysis": {"nsteps": 1, "dt": 1}})",
                       ".");
  } catch (const InputError& error) {
    said = format_problems(error.problems());
  }
  CHECK(said.find("there is no material named '\\x1b[31m\\u009b'") != std::string::npos);
  CHECK(said.find('\x1b') == std::string::npos);
}
