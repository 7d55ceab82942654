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

/// A step in which no deferred work is left when the time step is known: the patches whose rests
/// were deferred, and the order in which these were released.
struct StepSeen {
  std::vector<int> deferred, released;
};
StepSeen take_step(DeferredWork& work, Step step) {
  StepSeen seen;
  const auto release = [&](int patch) { seen.released.push_back(patch); };
  for (int p = 0; p < length; ++p) {
    const bool deferred = work.task_begins(p, step, release);
    // Until the last such task of the step begins nothing is released.
    CHECK((p + 1 == length || seen.released.empty()));
    if (!deferred) continue;
    seen.deferred.push_back(p);
    work.defer(p, step, release);
  }
  return seen;
}

}  // namespace

TEST_CASE("as many rests are deferred as fill the wait, those furthest from other ranks first") {
  const Row row;
  for (const bool has_cores : {false, true}) {
    CAPTURE(has_cores);
    DeferredWork work(row.graph, row.boundary, 1, has_cores);
    work.begin(0);
    std::vector<std::vector<int>> deferred;
    for (Step step = 0; step < 20; ++step) {
      const StepSeen seen = take_step(work, step);
      CHECK(seen.released == seen.deferred);
      deferred.push_back(seen.deferred);
      for (std::size_t k = 0; k < seen.deferred.size(); ++k) work.rest_begins();
      work.dt_is_known();  // and nothing was left to do
    }
    CHECK(deferred[0].empty());
    CHECK(deferred[1] == std::vector<int>{0});
    CHECK(deferred[2] == std::vector<int>{0, 1});
    // What other ranks wait for is deferred at last, and not where they share cores.
    const std::vector<int> inner{0, 1, 2, 3, 4}, all{0, 1, 2, 3, 4, 5};
    CHECK(deferred.back() == (has_cores ? all : inner));
  }
}

TEST_CASE("fewer rests are deferred when many are left as the time step becomes known") {
  const Row row;
  DeferredWork work(row.graph, row.boundary, 1, true);
  work.begin(0);
  Step step = 0;
  std::size_t most = 0, before = 0;
  for (; step < 20; ++step) {
    most = take_step(work, step).deferred.size();
    for (std::size_t k = 0; k < most; ++k) work.rest_begins();
    work.dt_is_known();
  }
  before = most;
  most = take_step(work, step++).deferred.size();
  work.dt_is_known();  // and none had begun
  for (std::size_t k = 0; k < most; ++k) work.rest_begins();
  CHECK(take_step(work, step).deferred.size() < before);
}

}  // namespace lahar
