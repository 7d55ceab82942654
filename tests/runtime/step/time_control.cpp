// Lengths of steps and the end of a run, without a simulation.
#include "runtime/step/time_control.h"

#include <doctest/doctest.h>

#include <cmath>
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

TEST_CASE("time control: an implicit step that is cut is no more the last one") {
  Analysis analysis = adaptive_analysis();
  analysis.step.dt = 0.5;
  TimeControl time(analysis, {}, {});
  time.begin(HUGE_VAL, nobody);
  CHECK(time.dt_of(0) == 0.5);
  time.set_dt(1, 0.5);
  CHECK(time.nsteps() == 2);
  CHECK(time.time_at(2) == 1.0);
  time.set_dt(1, 0.125);
  CHECK(time.nsteps() == 100);
  CHECK(time.time_at(2) == 0.625);
  time.set_dt(2, 0.3);  // of the 0.375 s that are left: two equal steps, and no tiny one
  CHECK(time.dt_of(2) == 0.1875);
  time.set_dt(3, 0.3);
  CHECK(time.nsteps() == 4);
  CHECK(time.time_at(4) == 1.0);
  time.set_dt(3, 2.0);  // not longer than the largest
  CHECK(time.time_at(4) == 1.0);
}

TEST_CASE("time control: an implicit step that is cut may end at a time of output, too") {
  OutputPlan output;
  output.frame_dt = 0.4;
  TimeControl time(adaptive_analysis(), output, {});
  CHECK(time.begin(HUGE_VAL, nobody) == 1.0);
  CHECK(time.dt_of(0) == 0.4);
  time.set_dt(0, 0.25);
  CHECK(time.dt_of(0) == 0.2);  // two equal ones
  time.set_dt(0, 0.1);
  CHECK(time.dt_of(0) == 0.1);
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
