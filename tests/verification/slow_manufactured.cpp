// Convergence to manufactured solutions: what `lahar verify manufactured` tabulates, at three sizes
// of cells.
#include <doctest/doctest.h>

#include <cmath>

#include "runtime/verify_manufactured.h"

using namespace lahar;

namespace {

/// Order of convergence from one size of cells to half of it.
double order(ManufacturedCase what, int cells) {
  what.cells = cells;
  const double coarse = displacement_error(what);
  what.cells = 2 * cells;
  const double fine = displacement_error(what);
  MESSAGE(what.functions << " " << what.update << ": " << coarse << " at " << cells << ", " << fine
                         << " at " << 2 * cells);
  return std::log2(coarse / fine);
}

}  // namespace

TEST_CASE("axis-aligned motion: smooth functions converge with order 2, linear ones stall") {
  const auto of = [](const char* functions) {
    return ManufacturedCase{.motion = Motion::axis_aligned,
                            .amplitude = 0.05,
                            .functions = functions,
                            .update = "flip"};
  };
  CHECK(order(of("quadratic_spline"), 16) > 1.7);
  CHECK(order(of("cubic_spline"), 16) > 1.7);
  CHECK(order(of("gimp"), 16) > 1.5);
  CHECK(order(of("cpdi"), 16) > 1.7);
  CHECK(order(of("cpdi2"), 16) > 1.7);
  CHECK(order(of("element"), 32) < 1);
}
