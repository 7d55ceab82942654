// Tests that several ranks run together: every rank runs the same cases in the same order.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include "runtime/ranks.h"

int main(int argc, char** argv) {
  const lahar::MpiSession session(argc, argv);
  const int result = doctest::Context(argc, argv).run();
  return lahar::Ranks::world().any(result != 0) ? 1 : 0;
}
