// Soil that yields, injection in three dimensions and of bodies in contact: the bits of one rank.
#include <doctest/doctest.h>

#include "runtime/step/simulation.h"
#include "tests/runtime/step/soil_models.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// The last state of a run on all ranks, and its sums, are those of one; they are on rank 0.
template <int Dim>
Outcome check(Model<Dim> model, Index patch_particles) {
  model.analysis.patch_particles = patch_particles;
  const Outcome reference = run(model, {.threads = 1});
  CHECK(reference.error == "");
  for (const int threads : {1, 3})
    for (const bool moving : {false, true}) {
      CAPTURE(threads);
      CAPTURE(moving);
      ExecutionOptions way{.threads = threads};
      way.ranks = Communicator::world();
      if (moving) way.balance = {BalanceOptions::When::forced, 20, Partitioner::curve};
      const Outcome outcome = run(model, way);
      CHECK(outcome.error == "");
      if (way.ranks.rank() != 0) continue;
      CHECK(same_bits(outcome.frames.back(), reference.frames.back()));
      CHECK(same_bits(outcome.rows.back(), reference.rows.back()));
    }
  return reference;
}

}  // namespace

TEST_CASE("soil that yields and softens") {
  CHECK(share_above_zero(check(yielding_discs(), 40).frames.back(), "pdstrain") > 0.5);
  CHECK(share_above_zero(check(yielding_column(), 100).frames.back(), "pdstrain") > 0.5);
}

TEST_CASE("a shaft that is filled, and injected jets of two bodies that meet") {
  check(filled_shaft(), 8);
  check(jets_in_contact(), 16);
}
