/// \file Runs that go on from a state, compared with undisturbed ones.
#pragma once

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "io/run/checkpoint_header.h"
#include "tests/runtime/step/models.h"

namespace lahar::test {

/// A state that outlives its simulation.
struct StoredState {
  RunState run;
  std::vector<Index> patches;
  std::vector<std::vector<std::byte>> bytes;

  explicit StoredState(const SimulationState& state) : run(state.run), patches(state.patches) {
    for (std::size_t i = 0; i < patches.size(); ++i) {
      bytes.push_back(state.bytes(i));
      CHECK(static_cast<Index>(bytes.back().size()) == state.sizes.at(i));
    }
  }
  SimulationState view() const {
    std::vector<Index> sizes;
    for (const auto& state : bytes) sizes.push_back(static_cast<Index>(state.size()));
    return {run, patches, sizes, [this](std::size_t i) { return bytes[i]; }};
  }
};

inline std::string difference(const StoredState& a, const StoredState& b) {
  CheckpointHeader x, y;
  x.run = a.run;
  y.run = b.run;
  if (header_text(x) != header_text(y)) return header_text(x) + " against " + header_text(y);
  if (a.patches != b.patches) return "other patches";
  for (std::size_t i = 0; i < a.patches.size(); ++i)
    if (a.bytes[i] != b.bytes[i]) return "patch " + std::to_string(a.patches[i]);
  return "";
}

/// Rows and frames that a simulation gives to its observer.
struct Output {
  std::vector<HistoryRow> rows;
  std::vector<Frame> frames;
  Observer observer() {
    Observer observer;
    observer.frame = [this](FramePieces&& frame) { frames.push_back(join(frame)); };
    observer.history = [this](const HistoryRow& row) { rows.push_back(row); };
    return observer;
  }
};

/// A run has the serial loop's bits however its tasks are executed, and ends with numbers.
template <int Dim>
void check_ways(const Model<Dim>& model) {
  const Outcome reference = run(model, serial());
  REQUIRE(reference.error == "");
  for (const double x : reference.frames.back().coordinates) REQUIRE(std::isfinite(x));
  for (const ExecutionOptions& way : {flow(1), flow(2), flow(8), random_order(1)}) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
}

/// Run to `middle`, store, go on from that with another way of executing: state, frames and rows
/// are those of an undisturbed run.
template <int Dim>
void check_restart(const Model<Dim>& model, Index middle, Index end,
                   const std::vector<ExecutionOptions>& ways = {serial(), flow(2),
                                                                random_order(3)}) {
  Output undisturbed;
  Simulation reference(model, serial(), undisturbed.observer());
  reference.advance(end);
  REQUIRE(reference.step() == end);
  const StoredState last(reference.state());
  for (std::size_t k = 0; k < ways.size(); ++k) {
    CAPTURE(describe(ways[k]));
    Output output;
    Simulation first(model, ways[k], output.observer());
    first.advance(middle);
    REQUIRE(first.step() == middle);
    const StoredState stored(first.state());
    const ExecutionOptions& other = ways[(k + 1) % ways.size()];
    Simulation second(model, other, output.observer(), stored.view());
    CHECK(second.step() == middle);
    CHECK(difference(StoredState(second.state()), stored) == "");
    CHECK(same_bits(second.frame(), first.frame()));
    CHECK(same_bits(second.history(), first.history()));
    second.advance(end - middle);
    CHECK(difference(StoredState(second.state()), last) == "");
    CHECK(same_bits(second.history(), reference.history()));
    CHECK(same_bits(Outcome{output.frames, output.rows, 0, "", ""},
                    Outcome{undisturbed.frames, undisturbed.rows, 0, "", ""}));
  }
}

}  // namespace lahar::test
