// Linear systems of all patches: their solutions, and that these have the same bits however rounds
// are executed.
#include <doctest/doctest.h>

#include "tests/runtime/solve/systems.h"

using namespace lahar;
using namespace lahar::test;

namespace {

template <int Dim>
void check_solutions() {
  for (const MethodOfMatrix& how : methods_of_matrices) {
    CAPTURE(static_cast<int>(how.kind));
    CAPTURE(static_cast<int>(how.method));
    CAPTURE(static_cast<int>(how.preconditioner));
    const Solved<Dim> reference = solve<Dim>(how, {.mode = ExecutionMode::serial});
    CHECK(reference.result.problem == "");
    CHECK(reference.result.converged);
    CHECK(reference.result.residual <= 1e-10);
    CHECK(reference.error < 1e-8);
    CHECK((reference.result.iterations == 0) == (how.method == SolveMethod::direct));
    CHECK(reference.result.iterations < 200);
    if (how.preconditioner == Preconditioner::multigrid) CHECK(reference.result.multigrid);
    for (const ExecutorOptions& way : ways_of_rounds(false)) {
      CAPTURE(static_cast<int>(way.mode));
      CAPTURE(way.threads);
      const Solved<Dim> other = solve<Dim>(how, way);
      CHECK(other.solution == reference.solution);
      CHECK(other.result.iterations == reference.result.iterations);
      CHECK(other.result.residual == reference.result.residual);
    }
  }
}

/// The result of a system that has no solution.
SolveResult result_of(SolveMethod method, auto spoil, bool free = false) {
  SolvePatches<2> body(l_shape<2>(), solver_stages<2>());
  assemble(body, MatrixKind::elastic, free);
  spoil(body);
  GlobalSolve<2> solver(body.patches, {.executor = {.threads = 2}});
  return solver.solve({.method = method, .limits = {.most_iterations = 500}});
}

/// Iterations of a cube of n cells along each axis.
template <int Dim>
int iterations_of(MatrixKind kind, int n, Preconditioner preconditioner) {
  SolvePatches<Dim> body(cube<Dim>(n), solver_stages<Dim>());
  assemble(body, kind);
  GlobalSolve<Dim> solver(body.patches, {.executor = {.threads = 2}});
  const SolveResult result = solver.solve({.preconditioner = preconditioner});
  CHECK(result.converged);
  CHECK(result.multigrid);
  return result.iterations;
}

/// A quarter more for half the cell is not bounded strictly, but the diagonal alone needs twice as
/// many.
template <int Dim>
void check_refinement(MatrixKind kind, std::initializer_list<int> cells) {
  int coarser = 0;
  for (const int n : cells) {
    const int iterations = iterations_of<Dim>(kind, n, Preconditioner::multigrid);
    CAPTURE(n);
    CAPTURE(iterations);
    if (coarser > 0) CHECK(iterations <= 1.25 * coarser);
    CHECK(iterations < 45);
    coarser = iterations;
  }
}

constexpr SolveMethod all_methods[] = {SolveMethod::conjugate_gradients, SolveMethod::bicgstab,
                                       SolveMethod::direct};

}  // namespace

TEST_CASE("systems of patches have the solution of the whole matrix in 2D") {
  check_solutions<2>();
}

TEST_CASE("systems of patches have the solution of the whole matrix in 3D") {
  check_solutions<3>();
}

TEST_CASE("with multigrid, iterations hardly become more when cells become smaller") {
  check_refinement<2>(MatrixKind::poisson, {16, 32, 64});
  check_refinement<2>(MatrixKind::elastic, {16, 32, 64});
  check_refinement<2>(MatrixKind::convective, {16, 32, 64});
  check_refinement<3>(MatrixKind::elastic, {8, 16});
}

TEST_CASE("a body that nothing holds has no solution, as every solver says") {
  for (const SolveMethod method : all_methods) {
    const SolveResult result = result_of(
        method, [](auto&) {}, true);
    CHECK_FALSE(result.converged);
    CHECK(result.problem != "");
    CHECK(result.residual > 1e-10);
  }
}

TEST_CASE("numbers that are not finite end a solve with a message") {
  for (const SolveMethod method : all_methods) {
    const SolveResult result = result_of(method, [](SolvePatches<2>& body) {
      for (int p = 0; p < body.patches.size(); ++p)
        if (!body.patches[p].system.blocks.empty())
          body.patches[p].system.blocks[3] = std::numeric_limits<double>::quiet_NaN();
    });
    CHECK_FALSE(result.converged);
    CHECK(result.problem.find("not finite") != std::string::npos);
  }
}

TEST_CASE("a right side where no row is cannot be met, and the solvers say so") {
  for (const SolveMethod method : all_methods) {
    const SolveResult result = result_of(method, [](SolvePatches<2>& body) {
      for (int p = 0; p < body.patches.size(); ++p) {
        auto& patch = body.patches[p];
        for (Local i = 0; i < patch.n_nodes(); ++i) {
          const auto place =
              place_of(body.model, patch.topology.nodes[static_cast<std::size_t>(i)]);
          if (place[0] == 10 && place[1] == 0)
            patch.system.right_side[static_cast<std::size_t>(i * node_width)] = 1;
        }
      }
    });
    CHECK_FALSE(result.converged);
    CHECK(result.problem.find("have a right side, but no") != std::string::npos);
  }
}

TEST_CASE("an indefinite matrix is no matter for conjugate gradients, and iterations have an end") {
  const auto negate = [](SolvePatches<2>& body) {
    for (int p = 0; p < body.patches.size(); ++p)
      for (double& entry : body.patches[p].system.blocks) entry = -entry;
  };
  const SolveResult negative = result_of(SolveMethod::conjugate_gradients, negate);
  CHECK_FALSE(negative.converged);
  CHECK(negative.problem.find("not positive definite") != std::string::npos);
  CHECK(result_of(SolveMethod::bicgstab, negate).converged);
  SolvePatches<2> body(l_shape<2>(), solver_stages<2>());
  assemble(body, MatrixKind::elastic);
  GlobalSolve<2> solver(body.patches, {});
  const SolveResult few = solver.solve({.limits = {.most_iterations = 7}});
  CHECK_FALSE(few.converged);
  CHECK(few.iterations == 7);
  CHECK(few.problem.find("too many iterations") != std::string::npos);
  CHECK(few.residual > 1e-10);
  CHECK(few.residual < 1);
}

TEST_CASE("a solve that begins from the solution is over at once, and solvers can be used again") {
  SolvePatches<2> body(l_shape<2>(), solver_stages<2>());
  assemble(body, MatrixKind::elastic);
  GlobalSolve<2> solver(body.patches, {.executor = {.threads = 2, .verify = true}});
  const SolveResult first = solver.solve({});
  const auto solution = solution_of(body);
  const SolveResult again = solver.solve({});
  CHECK(again.iterations == first.iterations);
  CHECK(solution_of(body) == solution);
  const SolveResult from = solver.solve({.from_solution = true});
  CHECK(from.converged);
  CHECK(from.iterations == 0);
  CHECK(solution_of(body) == solution);
  assemble(body, MatrixKind::convective);
  CHECK(solver.solve({}).converged);
  CHECK(error_of(body) < 1e-8);
}
