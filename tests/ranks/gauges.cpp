// Gauges and maps on several ranks: the bits of one.
#include <doctest/doctest.h>

#include "tests/runtime/step/gauge_models.h"

using namespace lahar;
using namespace lahar::test;

TEST_CASE("rows of gauges and maps are those of one rank") {
  const Model<3> model = gauged();
  const Gauged reference = run_gauged(model, {.threads = 1});
  for (const int threads : {1, 2, 4}) {
    CAPTURE(threads);
    CHECK(run_gauged(model, {.threads = threads, .ranks = Communicator::world()}) == reference);
  }
}
