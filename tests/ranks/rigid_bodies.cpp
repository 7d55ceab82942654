// Rigid bodies on several ranks and threads, and over a restart: the bits of one rank.
#include <doctest/doctest.h>

#include "tests/ranks/same_checkpoints.h"
#include "tests/runtime/step/rigid_models.h"

using namespace lahar;
using namespace lahar::test;

TEST_CASE("rigid bodies at rest, in prescribed motion, and free") {
  check_same_checkpoints(heap_and_bodies("musl", R"("dt": 1e-3)"), 80);
  check_same_checkpoints(
      heap_and_bodies("usf", R"("time_step": {"adaptive": true, "safety": 0.3})"), 60);
}

TEST_CASE("saturated soil on rigid bodies at rest and in prescribed motion") {
  check_same_checkpoints(bank_and_wall(R"("dt": 2e-4)"), 80);
}
