#include "graph/ready_tasks.h"

#include <doctest/doctest.h>

#include <set>
#include <vector>

namespace lahar {

TEST_CASE(
    "what other ranks wait for is done first, then the earliest step, then patches in order") {
  ReadyTasks ready;
  ready.add(7, 3, false);
  ready.add(5, 3, false);
  ready.add(9, 2, false);
  ready.add(8, 4, true);
  ready.add(2, 3, true);
  ready.add(1, 3, true);
  const std::set<int> first{ready.take(), ready.take()};
  CHECK(first == std::set<int>{1, 2});
  std::vector<int> others;
  for (int k = 0; k < 4; ++k) others.push_back(ready.take());
  CHECK(others == std::vector<int>{8, 9, 5, 7});
}

}  // namespace lahar
