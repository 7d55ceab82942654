/// \file Rounds whose stages know what their neighbours must have sent.
#pragma once

#include <doctest/doctest.h>

#include <cmath>

#include "physics/base/error.h"
#include "physics/particles/node_sums.h"
#include "tests/runtime/solve/solve_models.h"

namespace lahar::test {

/// What a patch has of a node in a round.
inline double part_of_node(Index patch, Index node, Step round) {
  return 1.0 / static_cast<double>(1 + patch) + static_cast<double>(node) +
         1000.0 * static_cast<double>(round);
}

/// "put" and "check": each patch puts numbers that depend on the round, and counts the nodes at
/// which sums over patches are others than they must be, in Patch::max_speed.
inline std::vector<TimestepStage<2>> checked_round() {
  using P = Patch<2>;
  using S = const StepContext<2>;
  const TimestepStage<2> put{
      .stage = {.name = "put"}, .begin = [](P& patch, S& s) {
        patch.contributes[static_cast<std::size_t>(s.step % 2)] = !patch.active_nodes.empty();
        if (patch.active_nodes.empty()) return;
        double* sums = patch.own_sums(NodeSum::product, s.step);
        for (const NodeRange& range : patch.active_nodes)
          for (Local i = range.begin; i < range.end; ++i)
            sums[static_cast<std::ptrdiff_t>(i) * sum_stride] = part_of_node(
                patch.topology.patch, patch.topology.nodes[static_cast<std::size_t>(i)], s.step);
      }};
  const TimestepStage<2> check{
      .stage = {.name = "check", .exchange = "product", .gives_dt = true, .needs_dt = true},
      .takes = {NodeSum::product},
      .begin = [](P& patch, S& s) {
        if (patch.active_nodes.empty()) return;
        const SumOverPatches<2> sums(patch, NodeSum::product, s.step);
        for_each_node(patch, sums, [&](Local i, const NodeVector& own, const NodeVector& sum) {
          const Index node = patch.topology.nodes[static_cast<std::size_t>(i)];
          const double expected = part_of_node(patch.topology.patch, node, s.step);
          // Whatever other patches have of it: all is of this round.
          const double others = sum[0] - own[0];
          const double parts = std::round(others / part_of_node(1000000, node, s.step));
          const bool wrong =
              own[0] != expected ||
              std::abs(others - parts * part_of_node(1000000, node, s.step)) > parts + 1e-9;
          if (wrong) patch.max_speed += 1;
        });
      }};
  return {put, check};
}

struct RoundsRun {
  std::vector<std::vector<double>> sums;  ///< by round taken
  std::vector<Step> rounds;               ///< their numbers, from the first
  std::vector<Step> taken;                ///< by each call of run()
};

/// Three calls of run(), of which the second is ended by its sums.
inline RoundsRun run_rounds(const ExecutorOptions& way, const Communicator& ranks = {},
                            double latency = 0) {
  SolvePatches<2> body(l_shape<2>(), checked_round(), ranks);
  for (int p = 0; p < body.patches.size(); ++p) body.patches[p].max_speed = 0;
  RoundsRun result;
  Step ends = 1000000;
  Rounds<2> rounds(body.patches, checked_round(),
                   {.executor = way, .sums = 2, .groups = body.groups.get(), .latency = latency},
                   {.context = [&](Step round) { return body.context(round); },
                    .give =
                        [&](int p, Step round, std::span<double> own) {
                          own[0] =
                              0.1 * static_cast<double>(round + body.patches[p].topology.patch);
                          own[1] = body.patches[p].max_speed;
                        },
                    .take =
                        [&](Step round, std::span<const double> sums) {
                          result.rounds.push_back(round);
                          result.sums.emplace_back(sums.begin(), sums.end());
                          return round < ends;
                        }});
  result.taken.push_back(rounds.run(7));
  ends = rounds.next_round() + 12;
  result.taken.push_back(rounds.run(100));
  ends = 1000000;
  result.taken.push_back(rounds.run(1));
  return result;
}

/// What all executions must have in common.
inline void check_rounds(const RoundsRun& run, const RoundsRun& reference) {
  CHECK(run.taken == std::vector<Step>{7, 14, 1});
  CHECK(run.rounds == reference.rounds);
  CHECK(run.rounds.size() == 22);
  CHECK(run.sums == reference.sums);
  for (const auto& sums : run.sums) CHECK(sums[1] == 0);
}

}  // namespace lahar::test
