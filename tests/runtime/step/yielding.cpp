// Soil that yields and softens: the same bits however tasks are executed, over restarts, in frames.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/runtime/step/restart_checks.h"
#include "tests/runtime/step/soil_models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr Scheme schemes[] = {Scheme::usf, Scheme::usl, Scheme::musl};

/// All frames and rows, state variables among them, are those of the serial loop.
template <int Dim>
void check_all_ways(const Model<Dim>& model, double yielding = 0.5) {
  const Outcome reference = run(model, serial());
  REQUIRE(reference.error == "");
  const Frame& end = reference.frames.back();
  CHECK(share_above_zero(end, "pdstrain") > yielding);
  CHECK(crossings(model, end) > end.size() / 20);
  for (const ExecutionOptions& way :
       {flow(2), flow(3), flow(8), random_order(1), random_order(2)}) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
}

}  // namespace

TEST_CASE("soil that yields: every scheme gives the serial loop's bits") {
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> discs = yielding_discs();
    discs.analysis.scheme = scheme;
    const bool usl = scheme == Scheme::usl;  // does not bear nodes of little mass for longer
    if (usl) discs.analysis.nsteps = 35;
    check_all_ways(discs, usl ? 0.05 : 0.5);
  }
  check_all_ways(distorted(yielding_discs(), 0.012));
  check_all_ways(in_contact(yielding_discs()));
  check_all_ways(with_functions(yielding_discs(), ShapeFunctions::gimp));
  check_all_ways(yielding_column());
}

TEST_CASE("soil that yields: restarts leave no trace") {
  for (const Scheme scheme : schemes) {
    CAPTURE(static_cast<int>(scheme));
    Model<2> discs = yielding_discs();
    discs.analysis.scheme = scheme;
    check_restart(discs, 27, 34);
    check_restart(discs, 26, 33, {flow(2)});
  }
  Model<3> column = yielding_column();
  check_restart(column, 30, 45, {flow(2), serial()});
}
