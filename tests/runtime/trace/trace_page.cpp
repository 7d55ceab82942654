/// \file The page of a trace, as text; tests/pages opens it in a browser.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "graph/stage_loop.h"
#include "runtime/trace/analyse/page.h"
#include "runtime/trace/analyse/page_data.h"

using namespace lahar;
using nlohmann::json;

namespace {

/// Tasks of one thread, each after the one before.
TraceLog some_tasks(int n) {
  TraceLog log;
  log.run.title = "</script><b>";
  log.run.threads = {1};
  log.run.phases = {{.name = "all", .exchange = {}, .stages = {"stress"}}};
  log.run.loops = {{time_step_loop, 0, 1}};
  for (int i = 0; i < n; ++i)
    log.tasks.push_back({.step = i, .begin = 1.0 + i, .end = 1.5 + i, .last_input = i - 1});
  log.run.last = n - 1;
  log.run.wall = n - 0.5;
  return log;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

}  // namespace

TEST_CASE("the timeline of a long trace is its middle, and says so") {
  const TraceLog log = some_tasks(100);
  const json all = json::parse(timeline_of(log, {}, 1000));
  CHECK(all["tasks"]["count"] == 100);
  CHECK(all["view"]["first_task"] == 0);
  CHECK(all["view"]["origin"] == 1.0);
  CHECK(all["view"]["span"] == doctest::Approx(99.5));
  const json part = json::parse(timeline_of(log, {}, 10));
  CHECK(part["tasks"]["count"] == 10);
  CHECK(part["view"]["all_tasks"] == 100);
  CHECK(part["view"]["first_task"] == 45);
  CHECK(part["view"]["origin"] == 46.0);
  CHECK(part["view"]["span"] == doctest::Approx(9.5));
}

TEST_CASE("nothing in a page but its own scripts is read as HTML") {
  const std::string page = page_of(some_tasks(3), {});
  CHECK(page.starts_with("<!DOCTYPE html>"));
  CHECK(page.ends_with("</html>\n"));
  CHECK(count(page, "</script>") == 4);
  CHECK(count(page, "<b>") == 0);
  CHECK(count(page, "{{") == 0);
  // Whole in itself: no file, style or picture of another place.
  CHECK(count(page, "src=") == 0);
  CHECK(count(page, "href=\"http") == 0);
  CHECK(count(page, "@import") == 0);
}
