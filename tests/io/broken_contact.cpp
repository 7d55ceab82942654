#include <doctest/doctest.h>

#include "broken_case.h"

using namespace lahar::broken;

namespace {

Edit analysis(const std::string& text) {
  return replace("mpm.json", "\"dt\"", text + ", \"dt\"");
}

}  // namespace

// clang-format off
TEST_CASE("impossible bodies are refused with what is allowed") {
  const std::vector<Entry> table = {
    {"contact without an interface",
     {analysis(R"("contact": {"friction": 0.3})")},
     {},
     R"()"},
    {"bodies of nothing",
     {analysis(R"("interface": true, "contact": {"friction": -1, "bodies": [{}, {"material": 0, "pset_id": 3}, {"pset_id": 4}, {"material": "x"}]})")},
     {},
     R"()"},
  };
  check(table, 2);
}
