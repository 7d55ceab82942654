// Functions of time, their slopes, integrals and means.
#include <doctest/doctest.h>

#include <cmath>

#include "physics/model/model.h"

using namespace lahar;

namespace {

const MathFunction record{.x = {0.1, 0.3, 0.4}, .f = {2, 5, 4}};

MathFunction slope_of(MathFunction function) {
  function.differentiated = true;
  return function;
}

}  // namespace

TEST_CASE("the slope of a record is that of its lines, and 0 outside") {
  const MathFunction slope = slope_of(record);
  for (const auto& [time, value] :
       {std::pair(0.0, 0.0), {0.1, 15.0}, {0.2, 15.0}, {0.3, -10.0}, {0.4, 0.0}, {1.0, 0.0}})
    CHECK(slope(time) == doctest::Approx(value));
  CHECK(slope.largest() == doctest::Approx(15));
  CHECK(record.largest() == 5);
}

TEST_CASE("what moves by a slope is where the record says, in steps of any length") {
  for (const MathFunction& function :
       {record, MathFunction{.kind = MathFunction::Kind::sine, .x0 = 0.05, .a = 9, .lo = 0},
        MathFunction{.kind = MathFunction::Kind::sine, .a = 9, .lo = 0.1, .hi = 0.35}}) {
    const MathFunction slope = slope_of(function);
    double time = 0, way = 0;
    for (const double dt : {0.07, 0.05, 0.21, 0.03, 0.2}) {
      way += dt * slope.mean(time, dt);
      time += dt;
      CHECK(way == doctest::Approx(slope.integral(time)));
      if (time < function.hi && function.lo <= 0)
        CHECK(way == doctest::Approx(function.value(time) - function.value(0)));
    }
  }
}

TEST_CASE("the slope of a sine is there from the start on") {
  const MathFunction slope = slope_of({.kind = MathFunction::Kind::sine, .a = 9});
  CHECK(slope(0) == 9);
  CHECK(slope(-1e-9) == 0);
}

TEST_CASE("the slope of a sine is its derivative") {
  const MathFunction slope =
      slope_of({.kind = MathFunction::Kind::sine, .x0 = 0.05, .a = 9, .lo = 0, .hi = 1});
  CHECK(slope(0.3) == doctest::Approx(9 * std::cos(9 * 0.25)));
  CHECK(slope(1.5) == 0);
  CHECK(slope.largest() == 9);
}

TEST_CASE("the integral of a slope, which accelerations have, is the change of the values") {
  const MathFunction velocity = integral_of(slope_of(record));
  CHECK(velocity(0.2) == doctest::Approx(1.5));
  CHECK(velocity(0.9) == doctest::Approx(2));
}
