#include "graph/deferred_work.h"

#include <doctest/doctest.h>

#include <vector>

#include "tests/graph/step_graphs.h"

namespace lahar {

using namespace test;

namespace {

constexpr int length = 6;

/// A row of patches, the last of which exchanges with another rank.
struct Row {
  TaskGraph graph = make_task_graph(
      tasks_of(phases_of({{.name = "arrivals", .exchange = "particles"},
                          {.name = "integrate", .exchange = "sums", .needs_dt = true},
                          {.name = "locate", .gives_dt = true},
                          {.name = "P2G"}},
                         true)),
      block(length + 1, 1), true, 1);
  std::vector<char> boundary = {0, 0, 0, 0, 0, 1, 1};
};

/// A step in which nothing of what is set aside is left when the time step is known: the patches
/// whose rests were set aside, and the order in which these were released.
struct StepSeen {
  std::vector<int> aside, released;
};
StepSeen take_step(DeferredWork& rests, Step step) {
  StepSeen seen;
  const auto release = [&](int patch) { seen.released.push_back(patch); };
  for (int p = 0; p < length; ++p) {
    const bool aside = rests.task_begins(p, step, release);
    // Until the last such task of the step begins nothing is released.
    CHECK((p + 1 == length || seen.released.empty()));
    if (!aside) continue;
    seen.aside.push_back(p);
    rests.set_aside(p, step, release);
  }
  return seen;
}

}  // namespace

TEST_CASE("as many rests are set aside as fill the wait, those furthest from other ranks first") {
  const Row row;
  for (const bool has_cores : {false, true}) {
    CAPTURE(has_cores);
    DeferredWork rests(row.graph, row.boundary, 1, has_cores);
    rests.begin(0);
    std::vector<std::vector<int>> aside;
    for (Step step = 0; step < 20; ++step) {
      const StepSeen seen = take_step(rests, step);
      CHECK(seen.released == seen.aside);
      aside.push_back(seen.aside);
      for (std::size_t k = 0; k < seen.aside.size(); ++k) rests.rest_begins();
      rests.dt_is_known();  // and nothing was left to do
    }
    CHECK(aside[0].empty());
    CHECK(aside[1] == std::vector<int>{0});
    CHECK(aside[2] == std::vector<int>{0, 1});
    // What other ranks wait for is set aside at last, and not where they share cores.
    const std::vector<int> inner{0, 1, 2, 3, 4}, all{0, 1, 2, 3, 4, 5};
    CHECK(aside.back() == (has_cores ? all : inner));
  }
}

TEST_CASE("fewer rests are set aside when many are left as the time step becomes known") {
  const Row row;
  DeferredWork rests(row.graph, row.boundary, 1, true);
  rests.begin(0);
  Step step = 0;
  std::size_t most = 0, before = 0;
  for (; step < 20; ++step) {
    most = take_step(rests, step).aside.size();
    for (std::size_t k = 0; k < most; ++k) rests.rest_begins();
    rests.dt_is_known();
  }
  before = most;
  most = take_step(rests, step++).aside.size();
  rests.dt_is_known();  // and none had begun
  for (std::size_t k = 0; k < most; ++k) rests.rest_begins();
  CHECK(take_step(rests, step).aside.size() < before);
}

}  // namespace lahar
