#include "io/json/json_merge.h"

#include <doctest/doctest.h>

namespace lahar {

TEST_CASE("merge patches: the examples of RFC 7396") {
  const auto merged = [](const char* target, const char* patch) {
    JsonValue value = parse_json_literal(target);
    merge_patch(value, parse_json_literal(patch));
    return to_json(value, -1);
  };
  const auto text = [](const char* json) { return to_json(parse_json_literal(json), -1); };
  CHECK(merged(R"({"a":"b"})", R"({"a":"c"})") == text(R"({"a":"c"})"));
  CHECK(merged(R"({"a":"b"})", R"({"b":"c"})") == text(R"({"a":"b","b":"c"})"));
  CHECK(merged(R"({"a":"b","b":"c"})", R"({"a":null})") == text(R"({"b":"c"})"));
  CHECK(merged(R"({"a":["b"]})", R"({"a":"c"})") == text(R"({"a":"c"})"));
  CHECK(merged(R"({"a":{"b":"c"}})", R"({"a":{"b":"d","c":null}})") == text(R"({"a":{"b":"d"}})"));
  CHECK(merged(R"({"a":[1,2]})", R"({"a":[3]})") == text(R"({"a":[3]})"));
  CHECK(merged(R"({"a":"foo"})", R"({"a":{"bb":{"ccc":null}}})") == text(R"({"a":{"bb":{}}})"));
}

}  // namespace lahar
