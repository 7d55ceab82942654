#include "graph/ready_tasks.h"

#include <doctest/doctest.h>

#include <set>
#include <vector>

namespace lahar {

TEST_CASE(
    "agreements are done first, then what neighbours wait for, each by step, then patches in "
    "order") {
  ReadyTasks ready;
  ready.add(7, 3, Waits::nobody_else);
  ready.add(5, 3, Waits::nobody_else);
  ready.add(9, 2, Waits::nobody_else);
  ready.add(8, 4, Waits::neighbours);
  ready.add(2, 3, Waits::neighbours);
  ready.add(1, 3, Waits::neighbours);
  ready.add(10, 5, Waits::all_ranks);
  CHECK(ready.take() == 10);
  const std::set<int> first{ready.take(), ready.take()};
  CHECK(first == std::set<int>{1, 2});
  std::vector<int> others;
  for (int k = 0; k < 4; ++k) others.push_back(ready.take());
  CHECK(others == std::vector<int>{8, 9, 5, 7});
}

}  // namespace lahar
