// Rounds on several ranks: what one rank finds, each rank finds.
#include "tests/runtime/solve/round_checks.h"

using namespace lahar;
using namespace lahar::test;

TEST_CASE("rounds of several ranks have the sums and the end of one") {
  const Communicator ranks = Communicator::world();
  const RoundsRun reference = run_rounds({.mode = ExecutionMode::serial});
  for (const ExecutorOptions& way : ways_of_rounds(ranks.several()))
    check_rounds(run_rounds(way, ranks), reference);
  check_rounds(run_rounds({.threads = 1}, ranks, 2e-4), reference);
}

TEST_CASE("a stage that throws on one rank ends the rounds of all with its message") {
  const Communicator ranks = Communicator::world();
  std::vector<TimestepStage<2>> stages = checked_round();
  stages[0].end = [](Patch<2>& patch, const StepContext<2>& s) {
    if (s.step >= 5 && patch.topology.patch == 3) throw std::runtime_error("no such luck");
  };
  SolvePatches<2> body(l_shape<2>(), stages, ranks);
  Rounds<2> rounds(body.patches, stages,
                   {.executor = {.threads = 2}, .sums = 1, .groups = body.groups.get()},
                   {.context = [&](Step round) { return body.context(round); }});
  std::string message;
  try {
    rounds.run(100);
  } catch (const SimulationError& error) {
    message = error.what();
  }
  CHECK(message.find("round 5 (t = 0 s), rank ") == 0);
  CHECK(message.find("patch 3, stage put: no such luck") != std::string::npos);
}
