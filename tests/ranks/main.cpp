// Every rank runs every test case, in the same order. A check that fails on one rank must not keep
// it from calls that the others make too: CHECK, not REQUIRE.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include "runtime/comm/communicator.h"

int main(int argc, char** argv) {
  const lahar::MpiSession session(argc, argv);
  doctest::Context context(argc, argv);
  const int result = context.run();
  return lahar::Communicator::world().any(result != 0) ? 1 : 0;
}
