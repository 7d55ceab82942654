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

TEST_CASE("vortex: shear and rotation converge with order 2, too, with all but linear functions") {
  const auto of = [](const char* functions, const char* update) {
    return ManufacturedCase{.motion = Motion::vortex,
                            .amplitude = 0.2,
                            .functions = functions,
                            .update = update,
                            .per_cell = 3};
  };
  // Measured 2.06, 2.18, 2.21, 2.06, 2.09; linear 0.10.
  CHECK(order(of("quadratic_spline", "flip"), 16) > 1.9);
  CHECK(order(of("quadratic_spline", "apic"), 16) > 1.9);
  CHECK(order(of("cubic_spline", "flip"), 16) > 1.9);
  CHECK(order(of("gimp", "flip"), 16) > 1.9);
  CHECK(order(of("cpdi", "flip"), 16) > 1.9);
  CHECK(order(of("element", "flip"), 16) < 1);
}
