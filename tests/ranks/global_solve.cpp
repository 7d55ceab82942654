// Linear systems that ranks solve together have the solution of one rank, to the last bit.
#include <doctest/doctest.h>

#include <chrono>

#include "tests/runtime/solve/systems.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
void check_ranks(const Communicator& ranks) {
  for (const MethodOfMatrix& how : methods_of_matrices) {
    CAPTURE(static_cast<int>(how.kind));
    CAPTURE(static_cast<int>(how.method));
    CAPTURE(static_cast<int>(how.preconditioner));
    const Solved<Dim> reference = solve<Dim>(how, {.mode = ExecutionMode::serial});
    for (const ExecutorOptions& way : ways_of_rounds(ranks.several())) {
      const Solved<Dim> other = solve<Dim>(how, way, ranks);
      CHECK(other.solution == reference.solution);
      CHECK(other.result.iterations == reference.result.iterations);
      CHECK(other.result.residual == reference.result.residual);
    }
  }
}

}  // namespace

TEST_CASE("systems that ranks solve together have the bits of one rank") {
  check_ranks<2>(Communicator::world());
  check_ranks<3>(Communicator::world());
}

TEST_CASE("a system without a solution ends on all ranks with the same words") {
  const Communicator ranks = Communicator::world();
  SolvePatches<2> body(l_shape<2>(), solver_stages<2>(), ranks);
  assemble(body, MatrixKind::elastic, true);
  GlobalSolve<2> solver(body.patches, {.executor = {.threads = 2}, .groups = body.groups.get()});
  for (const SolveMethod method : {SolveMethod::conjugate_gradients, SolveMethod::direct}) {
    const SolveResult result = solver.solve({.method = method, .limits = {.most_iterations = 100}});
    CHECK_FALSE(result.converged);
    std::string of_first = result.problem;
    ranks.broadcast(of_first);
    CHECK(result.problem == of_first);
    CHECK(result.problem != "");
  }
}

TEST_CASE("a reduction is hidden behind the exchange: the time of an iteration under latency") {
  const Communicator ranks = Communicator::world();
  if (ranks.size() != 2) return;
  constexpr double latency = 600e-6;
  SolvePatches<2> body(l_shape<2>(), solver_stages<2>(), ranks);
  assemble(body, MatrixKind::elastic);
  GlobalSolve<2> solver(
      body.patches, {.executor = {.threads = 1}, .groups = body.groups.get(), .latency = latency});
  ranks.wait_for_all();
  const auto begin = std::chrono::steady_clock::now();
  const SolveResult result = solver.solve({});
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  CHECK(result.converged);
  // A matter of time, which may pass otherwise on a busy machine: a message, no check.
  MESSAGE("latency of a message and of a reduction 600 us: "
          << 1e6 * seconds.count() / static_cast<double>(solver.rounds_taken())
          << " us per round of " << solver.rounds_taken());
}
