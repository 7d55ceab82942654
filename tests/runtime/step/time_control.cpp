// Lengths of steps and the end of a run, without a simulation.
#include "runtime/step/time_control.h"

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "physics/base/error.h"
#include "runtime/step/output_schedule.h"

using namespace lahar;

namespace {

Analysis adaptive_analysis() {
  Analysis analysis;
  analysis.step = {.adaptive = true, .dt = 1.0, .safety = 0.5};
  analysis.nsteps = 100;
  analysis.end_time = 1.0;
  return analysis;
}

std::string nobody() {
  return "nobody";
}

}  // namespace

TEST_CASE("time control: steps end at times of output and at the end of the run") {
  OutputPlan output;
  output.frame_dt = 0.5;
  TimeControl time(adaptive_analysis(), output, {});
  const OutputSchedule schedule(output, 0, time);
  constexpr double limit = 0.6;  // steps of 0.3, or two equal ones before a frame
  CHECK(time.begin(limit, nobody) == doctest::Approx(0.3));
  std::vector<double> ends;
  std::vector<Step> frames;
  for (Step step = 0; step < time.nsteps(); ++step) {
    if (step > 0) time.plan(step, limit);
    ends.push_back(time.time_at(step + 1));
    if (schedule.frame_due(step)) frames.push_back(step);
  }
  CHECK(ends == std::vector{0.25, 0.5, 0.8, 1.0});
  CHECK(frames == std::vector<Step>{1, 3});
}

TEST_CASE("time control: a particle that comes in limits the steps from then on") {
  TimeControl time(adaptive_analysis(), {}, {{.start = 0.2, .end = 10, .limit = 0.02}});
  time.begin(0.5, nobody);
  CHECK(time.dt_of(0) == 0.25);
  time.plan(1, 0.5);
  CHECK(time.dt_of(1) == 0.01);
}

TEST_CASE("time control: a fixed step above the limit is refused unless the scenario accepts it") {
  Analysis analysis;
  analysis.step.dt = 0.1;
  analysis.nsteps = 20;
  analysis.end_time = 1.0;
  CHECK_THROWS_WITH_AS(TimeControl(analysis, {}, {}).begin(0.05, nobody),
                       doctest::Contains("limit 0.05 s of nobody"), InputError);
  analysis.step.accept_unstable = true;
  TimeControl time(analysis, {}, {});
  time.begin(0.05, nobody);
  CHECK(time.nsteps() == 10);
}
