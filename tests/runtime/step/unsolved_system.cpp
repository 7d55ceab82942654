// What is said of a linear system that was not solved: the method, how far it came, and the node at
// which most is left, or that has nothing to bear its right side with.
#include "runtime/step/unsolved_system.h"

#include <doctest/doctest.h>

#include <limits>
#include <regex>
#include <string>

#include "tests/runtime/solve/systems.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// The text for a system of an L of unit cells in a mesh of 15 x 12 nodes, with what `spoil` has
/// done to it; what is left is told in halves.
std::string text_of(const SolveOptions& options, auto spoil, bool free = false) {
  SolvePatches<2> body(l_shape<2>(), solver_stages<2>());
  assemble(body, MatrixKind::elastic, free);
  spoil(body);
  GlobalSolve<2> solver(body.patches, {.executor = {.threads = 2}});
  const SolveResult result = solver.solve(options);
  CHECK_FALSE(result.converged);
  return describe_unsolved<2>(result, body.patches, *body.model.mesh, {}, "halves",
                              [](const auto&, std::size_t, double left) { return 2 * left; });
}

/// Call change(patch, node) for all copies of the node at (x, y).
void for_node_at(SolvePatches<2>& body, Index x, Index y, auto change) {
  for (int p = 0; p < body.patches.size(); ++p)
    for (std::size_t i = 0; i < body.patches[p].topology.nodes.size(); ++i)
      if (place_of(body.model, body.patches[p].topology.nodes[i]) == std::array<Index, 2>{x, y})
        change(body.patches[p], i);
}

constexpr SolveMethod all_methods[] = {SolveMethod::conjugate_gradients, SolveMethod::bicgstab,
                                       SolveMethod::direct};

}  // namespace

TEST_CASE("a system that too few iterations did not solve has a node at which most is left") {
  // The force on one node is so large that after one iteration nothing else counts.
  const std::string text = text_of({.limits = {.most_iterations = 1}}, [](SolvePatches<2>& body) {
    for_node_at(body, 3, 6, [](Patch<2>& patch, std::size_t i) {
      patch.system.right_side[i * node_width] = 1e9;
    });
  });
  CAPTURE(text);
  CHECK(std::regex_match(
      text, std::regex(R"(conjugate gradients: too many iterations \(1 iteration, relative )"
                       R"(residual 0?\.\d+\); most is left at node \d+ \([2-4], [5-7]\), )"
                       R"(\d.*e\+0[89] halves)")));
}

TEST_CASE("a right side without an equation is found, whatever the method") {
  for (const SolveMethod method : all_methods) {
    const std::string text = text_of({.method = method}, [](SolvePatches<2>& body) {
      for_node_at(body, 10, 0, [](Patch<2>& patch, std::size_t i) {
        patch.system.right_side[i * node_width] = 3;
      });
    });
    CAPTURE(text);
    CHECK(text.find("1 unknowns have a right side, but no ") != std::string::npos);
    CHECK(text.ends_with(
        "; the largest right side without an equation is at node 10 (10, 0), 6 halves"));
  }
}

TEST_CASE("numbers that are not finite have a place") {
  for (const SolveMethod method : all_methods) {
    const std::string text = text_of({.method = method}, [](SolvePatches<2>& body) {
      for_node_at(body, 4, 5, [](Patch<2>& patch, std::size_t i) {
        patch.system.right_side[i * node_width] = std::numeric_limits<double>::quiet_NaN();
      });
    });
    CAPTURE(text);
    CHECK(text.ends_with("; most is left at node 79 (4, 5), inf halves"));
  }
}

TEST_CASE("a body that nothing holds has a node at which most is left, by a direct solver, too") {
  const std::string text = text_of(
      {.method = SolveMethod::direct}, [](auto&) {}, true);
  CAPTURE(text);
  CHECK(std::regex_match(text, std::regex(R"(direct solver: the matrix is singular, or nearly so )"
                                          R"(\(relative residual .*\); most is left at node )"
                                          R"(\d+ \(\d+, \d+\), .* halves)")));
}
