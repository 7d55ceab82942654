// Frames and rows at multiples of a time.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "physics/base/error.h"
#include "runtime/step/output_times.h"
#include "tests/runtime/step/restart_checks.h"

using namespace lahar;
using namespace lahar::test;

namespace {

Model<2> discs_by_time(bool adaptive) {
  Model<2> model = two_discs();  // 80 steps of 4e-3 s
  model.output.frame_steps = model.output.history_steps = 0;
  model.output.frame_dt = 0.05;
  model.output.history_dt = 0.03;
  if (!adaptive) return model;
  model.analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.3};
  model.analysis.nsteps = 1000;
  model.analysis.end_time = 0.32;
  return model;
}

std::vector<double> times(const std::vector<Frame>& frames) {
  std::vector<double> all;
  for (const Frame& frame : frames) all.push_back(frame.time);
  return all;
}

/// Multiples of an interval, and the end. (One that is a multiple of another, too, may be that.)
void check_times(const std::vector<double>& times, double interval, double end) {
  const auto n = static_cast<std::size_t>(multiples_by(end, interval));
  REQUIRE(times.size() == n + 1);
  for (std::size_t k = 0; k < n; ++k)
    CHECK(times[k] == doctest::Approx(interval * static_cast<double>(k + 1)).epsilon(1e-15));
  CHECK(times.back() == end);
}

}  // namespace

TEST_CASE("a time that rounding misses is a multiple all the same") {
  CHECK(multiples_by(0, 0.1) == 0);
  CHECK(multiples_by(0.1, 0.1) == 1);
  CHECK(multiples_by(0.1 * 3, 0.1) == 3);
  CHECK(multiples_by(0.3, 0.1) == 3);  // 0.3 / 0.1 is less than 3
  CHECK(multiples_by(0.29999, 0.1) == 2);
  double sum = 0;
  for (int k = 0; k < 1000; ++k) sum += 1e-3;
  CHECK(multiples_by(sum, 1e-3) == 1000);
  CHECK(next_multiple(0.3, 0.1) == 4 * 0.1);
  CHECK(next_multiple(0.31, 0.1) == 4 * 0.1);
  // Intervals that times are too coarse for: numbers stay whole, and time goes on.
  CHECK(multiples_by(1.0, 1e-300) == 9'000'000'000'000'000);
  CHECK(next_multiple(1.0, 1e-300) > 1.0);
  CHECK(next_multiple(1e20, 1e-300) > 1e20);
}

TEST_CASE("a fixed step gives a frame where it reaches a multiple of the time") {
  const Outcome reference = run(discs_by_time(false), serial());
  std::vector<Index> steps;
  for (const Frame& frame : reference.frames) steps.push_back(frame.step);
  CHECK(steps == std::vector<Index>{13, 25, 38, 50, 63, 75, 80});  // the last is the end
  steps.clear();
  for (const HistoryRow& row : reference.rows) steps.push_back(row.step);
  CHECK(steps == std::vector<Index>{8, 15, 23, 30, 38, 45, 53, 60, 68, 75, 80});
  for (const ExecutionOptions& way : other_ways()) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(discs_by_time(false), way), reference));
  }
}

TEST_CASE("adaptive steps end at multiples of the time exactly, and none is tiny") {
  const Model<2> model = discs_by_time(true);
  const Outcome reference = run(model, serial());
  CHECK(reference.error == "");
  check_times(times(reference.frames), 0.05, 0.32);
  std::vector<double> rows;
  for (const HistoryRow& row : reference.rows) rows.push_back(row.time);
  check_times(rows, 0.03, 0.32);
  for (const ExecutionOptions& way : other_ways()) {
    CAPTURE(describe(way));
    CHECK(same_bits(run(model, way), reference));
  }
  Simulation simulation(model, serial());
  double before = 0, longest = 0;
  while (!simulation.finished()) {
    simulation.advance(1);
    const double dt = simulation.time() - before;
    before = simulation.time();
    longest = std::max(longest, dt);
    if (!simulation.finished()) CHECK(dt > 0.4 * longest);
  }
}

TEST_CASE("adaptive steps end at the times of gauges exactly, alone and beside other output") {
  for (const bool alone : {true, false}) {
    Model<2> model = discs_by_time(true);
    if (alone) model.output.frame_dt = model.output.history_dt = 0;
    Gauge all;
    all.kind = Gauge::Kind::particles;
    all.name = "all";
    model.output.measured.gauges = {all};
    model.output.measured.dt = 0.025;
    std::vector<double> rows;
    Observer observer;
    observer.gauges = [&](const GaugeRows& row) { rows.push_back(row.time); };
    Simulation simulation(model, flow(2), observer);
    simulation.run();
    // The end is not a multiple. The program asks for its row, and so does this test.
    rows.push_back(simulation.gauges().time);
    check_times(rows, 0.025, 0.32);
  }
}

TEST_CASE("output by time is the same across a restart") {
  for (const bool adaptive : {false, true}) {
    const Model<2> model = discs_by_time(adaptive);
    Output whole;
    Simulation undisturbed(model, serial(), whole.observer());
    undisturbed.run();
    for (const Index middle : {1, 12, 13, 14, 30, 31}) {
      CAPTURE(middle);
      Output parts;
      Simulation first(model, flow(2), parts.observer());
      first.advance(middle);
      const StoredState stored(first.state());
      Simulation second(model, flow(3), parts.observer(), stored.view());
      second.run();
      CHECK(same_bits(second.frame(), undisturbed.frame()));
      REQUIRE(parts.frames.size() == whole.frames.size());
      REQUIRE(parts.rows.size() == whole.rows.size());
      for (std::size_t k = 0; k < whole.frames.size(); ++k)
        CHECK(same_bits(parts.frames[k], whole.frames[k]));
      for (std::size_t k = 0; k < whole.rows.size(); ++k)
        CHECK(same_bits(parts.rows[k], whole.rows[k]));
    }
  }
}

TEST_CASE("frames too large for a copy come at the same times") {
  for (const bool adaptive : {false, true})
    for (ExecutionOptions way : {serial(), flow(2), flow(3)}) {
      CAPTURE(adaptive);
      CAPTURE(describe(way));
      const Model<2> model = discs_by_time(adaptive);
      const Outcome reference = run(model, serial());
      way.staging_bytes = 0;
      std::vector<Frame> frames;
      Observer observer;
      observer.frame = [](FramePieces&&) { FAIL("a large frame was copied"); };
      observer.large_frame = [&](const FrameSource& frame) { frames.push_back(join(frame)); };
      Simulation simulation(model, way, observer);
      simulation.run();
      REQUIRE(frames.size() + 1 == reference.frames.size());
      for (std::size_t k = 0; k < frames.size(); ++k)
        CHECK(same_bits(frames[k], reference.frames[k]));
    }
}

TEST_CASE("no more frames than allowed are written, which is said once") {
  for (const bool by_time : {false, true})
    for (const ExecutionOptions& way : {serial(), flow(3)}) {
      Model<2> model = discs_by_time(false);
      if (!by_time) {
        model.output.frame_dt = 0;
        model.output.frame_steps = 10;
      }
      model.output.max_frames = 3;
      std::vector<Index> steps;
      std::vector<std::string> warnings;
      Observer observer;
      observer.frame = [&](FramePieces&& frame) { steps.push_back(frame.header.step); };
      observer.warning = [&](const std::string& text) { warnings.push_back(text); };
      Simulation simulation(model, way, observer);
      simulation.run();
      CHECK(steps == (by_time ? std::vector<Index>{13, 25, 38} : std::vector<Index>{10, 20, 30}));
      REQUIRE(warnings.size() == 1);
      CHECK(warnings[0] ==
            (by_time ? std::string("step 50 (t = 0.2 s): ") : "step 40 (t = 0.16 s): ") +
                "no more frames are written but the last one; post_processing.max_frames is the "
                "largest number of them.");
    }
}

TEST_CASE("a run without particles steps from output to output") {
  Model<2> model = discs_by_time(true);
  model.particles = {};
  model.analysis.step.dt = std::numeric_limits<double>::infinity();
  const Outcome outcome = run(model, flow(2));
  CHECK(outcome.error == "");
  check_times(times(outcome.frames), 0.05, 0.32);
  CHECK(outcome.rows.back().step == 15);  // 6 and 10 multiples, two of both, and the end
}
