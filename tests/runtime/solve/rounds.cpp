// Rounds: exchanges, sums and ends are the same however they are executed.
#include "tests/runtime/solve/round_checks.h"

using namespace lahar;
using namespace lahar::test;

TEST_CASE("rounds take sums of each round once, in order, and end alike in every execution") {
  const RoundsRun reference = run_rounds({.mode = ExecutionMode::serial});
  check_rounds(reference, reference);
  CHECK(reference.sums.front()[0] > 0);
  for (const ExecutorOptions& way : ways_of_rounds(false)) {
    CAPTURE(static_cast<int>(way.mode));
    CAPTURE(way.threads);
    check_rounds(run_rounds(way), reference);
  }
}

TEST_CASE("a stage that throws ends rounds with the round, the patch and the stage") {
  for (const ExecutorOptions& way : ways_of_rounds(false)) {
    const auto throws = [](Patch<2>& patch, const StepContext<2>& s) {
      if (s.step >= 5 && patch.topology.patch >= 3) throw std::runtime_error("no such luck");
    };
    std::vector<TimestepStage<2>> stages = checked_round();
    stages[0].end = throws;
    SolvePatches<2> body(l_shape<2>(), stages);
    bool finite_before = true, finite_after = false;
    Rounds<2> rounds(body.patches, stages, {.executor = way, .sums = 1},
                     {.context = [&](Step round) { return body.context(round); },
                      .take =
                          [&](Step round, std::span<const double> sums) {
                            (round < 5 ? finite_before : finite_after) &= std::isfinite(sums[0]);
                            return true;
                          }});
    CHECK_THROWS_WITH_AS(
        rounds.run(100),
        doctest::Contains("round 5 (t = 0 s), rank 0, patch 3, stage put: no such luck"),
        SimulationError);
    CHECK(finite_before);
    CHECK_FALSE(finite_after);
  }
}

TEST_CASE("lists without sums run for the rounds that are asked for") {
  std::vector<TimestepStage<2>> stages = checked_round();
  stages[1].stage.gives_dt = stages[1].stage.needs_dt = false;
  SolvePatches<2> body(l_shape<2>(), stages);
  Rounds<2> rounds(body.patches, stages, {.executor = {.threads = 2}},
                   {.context = [&](Step round) { return body.context(round); }});
  CHECK(rounds.run(5) == 5);
  CHECK(rounds.run(0) == 0);
  CHECK(rounds.run(4) == 4);
  for (int p = 0; p < body.patches.size(); ++p) CHECK(body.patches[p].max_speed == 0);
}
