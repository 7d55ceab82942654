// Traces written by hand, whose analysis is known.
#include <doctest/doctest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "graph/stage_loop.h"
#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/counters.h"
#include "runtime/trace/analyse/log_links.h"

using namespace lahar;

namespace {

TraceTask task(int rank, int thread, int phase, int patch, Step step, double begin, double end) {
  TraceTask t{.step = step,
              .rank = rank,
              .thread = thread,
              .phase = phase,
              .patch = patch,
              .begin = begin,
              .end = end};
  t.stage[0] = static_cast<float>(end - begin);
  return t;
}

TraceLog finished(TraceLog log, MessageEnds ends = {}) {
  link(log, std::move(ends));
  return log;
}

/// Two patches that have nothing to do with each other, on a worker each, for two steps; the second
/// takes three times as long.
TraceLog two_alone() {
  TraceLog log;
  log.run.threads = {2};
  log.run.phases = {{.name = "all", .stages = {"all"}}};
  log.run.loops = {{time_step_loop, 0, 1}};
  log.graphs = {
      {.patches = {{0, {.number = 0, .particles = 100}}, {1, {.number = 1, .particles = 100}}}}};
  log.tasks = {task(0, 0, 0, 0, 0, 0, 1), task(0, 0, 0, 0, 1, 1, 2), task(0, 1, 0, 1, 0, 0, 3),
               task(0, 1, 0, 1, 1, 3, 6)};
  return finished(std::move(log));
}

/// A patch on each of two ranks; the second phase of patch 1 waits for a message of patch 0, which
/// is posted 0.1 s after its task and is 0.4 s on its way. Rank 1 looked for it at `missed` and did
/// not find it; 0 = not known. `posted`: later than it is packed, with others.
TraceLog one_message(double missed = 0, double posted = 2.1) {
  TraceLog log;
  log.run.ranks = 2;
  log.run.threads = {1, 1};
  log.run.phases = {{.name = "first", .stages = {"first"}},
                    {.name = "second", .exchange = "mass", .stages = {"second"}}};
  log.run.loops = {{time_step_loop, 0, 2}};
  log.graphs = {{.patches = {{0, {.number = 0, .rank = 0, .particles = 50, .neighbours = {1}}},
                             {1, {.number = 1, .rank = 1, .particles = 50, .neighbours = {0}}}}}};
  log.tasks = {task(0, 0, 0, 0, 0, 0, 2), task(1, 0, 0, 1, 0, 0, 1), task(1, 0, 1, 1, 0, 2.6, 3.6),
               task(0, 0, 1, 0, 0, 2.2, 3.2)};
  TraceTask unpack = task(1, 0, 0, 0, 0, 2.5, 2.6);
  unpack.kind = TraceKind::unpack;
  unpack.missed = missed;
  log.tasks.push_back(unpack);
  MessageEnds ends;
  const TraceMessage message{.step = 0, .phase = 0, .patch = 0, .from = 0, .to = 1, .bytes = 640};
  TraceMessage sent = message, came = message;
  sent.packed = 2.0;
  sent.sent = 2.1;
  came.posted = posted;
  came.arrived = came.given = 2.5;
  ends.sent = {sent};
  ends.came = {came};
  return finished(std::move(log), std::move(ends));
}

/// After something in it was changed.
TraceLog linked_again(TraceLog log) {
  MessageEnds ends{.sent = log.messages, .came = log.messages};
  log.messages.clear();
  log.inputs.clear();
  log.first_input.clear();
  return finished(std::move(log), std::move(ends));
}

double on_path(const TraceReport& report, PathPart::Kind kind) {
  return report.path.by_kind[static_cast<std::size_t>(kind)];
}

const Finding& finding(const TraceReport& report, const std::string& name) {
  return *std::find_if(report.findings.begin(), report.findings.end(),
                       [&](const Finding& f) { return f.name == name; });
}

}  // namespace

TEST_CASE("a message that waits for others before it is posted is late, not on its way") {
  const TraceReport report = analyse(one_message(0, 2.3));
  CHECK(on_path(report, PathPart::Kind::posting) == doctest::Approx(0.3));
  CHECK(on_path(report, PathPart::Kind::transit) == doctest::Approx(0.2));
}

TEST_CASE("efficiencies of two workers, one of which has three times the work") {
  const TraceReport report = analyse(two_alone());
  CHECK(report.efficiencies.parallel == doctest::Approx(8.0 / 12));
  CHECK(report.efficiencies.load_balance == doctest::Approx(4.0 / 6));
  CHECK(report.efficiencies.communication == doctest::Approx(1));
  CHECK(report.path.longest_chain == doctest::Approx(6));
  CHECK(report.path.speedup_left == doctest::Approx(1));
  CHECK(on_path(report, PathPart::Kind::task) == doctest::Approx(6));
  CHECK(report.findings.front().name == "imbalance");
  CHECK(report.findings.front().loss == doctest::Approx(2));
  CHECK(report.patches.front().number == 1);
  CHECK(report.patches.front().over_mean == doctest::Approx(1.5));
  CHECK(report.patches.front().why == "1.5 times the time per particle");
  CHECK(report.spread.largest == 1);
  CHECK(report.stages[0].per_particle == doctest::Approx(8.0 / 400));
}

TEST_CASE("the critical path leads through a message") {
  const TraceLog log = one_message();
  const TraceReport report = analyse(log);
  CHECK(on_path(report, PathPart::Kind::task) == doctest::Approx(2 + 0.1 + 1));
  CHECK(on_path(report, PathPart::Kind::posting) == doctest::Approx(0.1));
  CHECK(on_path(report, PathPart::Kind::transit) == doctest::Approx(0.4));
  CHECK(finding(report, "messages").loss == doctest::Approx(0.4));
  CHECK(finding(report, "late sender").loss == doctest::Approx(0.1));
  CHECK(report.exchange.messages == 1);
  CHECK(report.exchange.bytes == 640);
  CHECK(report.exchange.in_flight == doctest::Approx(0.4));
  // Rank 1 was idle from 1.0 s until the message came, and then unpacked it.
  CHECK(report.exchange.exposed == doctest::Approx(1.5));
  CHECK(report.waits.front().for_what == "first of patch 0, step 0, from rank 0");
  double sum = report.ideal_time;
  for (const Finding& f : report.findings) sum += f.loss;
  CHECK(sum == doctest::Approx(log.run.wall));
}

TEST_CASE(
    "the critical path leads through tasks that take no time, whatever their order in files") {
  TraceLog log;
  log.run.threads = {1};
  log.run.phases = {{.name = "first", .stages = {"first"}}, {.name = "rest", .stages = {"rest"}}};
  log.run.loops = {{time_step_loop, 0, 2}};
  log.graphs = {{.patches = {{0, {.number = 0}}}}};
  log.tasks = {task(0, 0, 1, 0, 0, 1, 1), task(0, 0, 0, 0, 0, 1, 1), task(0, 0, 1, 0, 1, 3, 4),
               task(0, 0, 0, 0, 1, 2, 3)};
  const CriticalPath path = analyse(finished(std::move(log))).path;
  CHECK(path.longest_chain == doctest::Approx(2));
  REQUIRE(!path.parts.empty());
  CHECK(path.parts.front().begin == 1);
  CHECK(path.parts.back().end == 4);
}

TEST_CASE("patches that are no more are not steps behind") {
  TraceLog log;
  log.run.threads = {1};
  log.run.phases = {{.name = "all", .stages = {"all"}}};
  log.run.loops = {{time_step_loop, 0, 1}};
  log.graphs = {{.first = 0, .patches = {{0, {.number = 0}}, {1, {.number = 1}}}},
                {.first = 2, .patches = {{1, {.number = 1}}}}};
  log.tasks = {task(0, 0, 0, 0, 0, 0, 1), task(0, 0, 0, 0, 1, 1, 2), task(0, 0, 0, 1, 0, 2, 3),
               task(0, 0, 0, 1, 1, 3, 4)};
  for (int step = 2; step < 9; ++step)
    log.tasks.push_back(task(0, 0, 0, 1, step, step + 2, step + 3));
  const TraceReport report = analyse(finished(std::move(log)));
  CHECK(report.spread.largest == 1);
}

TEST_CASE("a message is on its way until the last look that did not find it") {
  // Looks before it was posted say nothing.
  for (const auto& [missed, on_its_way] : {std::pair{2.4, 0.3}, {2.2, 0.1}, {1.0, 0.0}}) {
    CAPTURE(missed);
    const TraceReport report = analyse(one_message(missed));
    CHECK(on_path(report, PathPart::Kind::transit) == doctest::Approx(on_its_way));
    CHECK(on_path(report, PathPart::Kind::unseen) == doctest::Approx(0.4 - on_its_way));
    CHECK(finding(report, "late receiver").loss == doctest::Approx(0.4 - on_its_way));
    CHECK(report.exchange.in_flight == doctest::Approx(on_its_way));
    CHECK(report.exchange.unseen == doctest::Approx(0.4 - on_its_way));
  }
}

TEST_CASE(
    "what follows a task on its rank waits until its messages are posted and its step ended") {
  // The second phase of patch 0 runs on another thread and was noted as ready at 2.15 s; from 2.1 s
  // on, the thread of its first phase did what is done when a step is finished.
  TraceLog log = one_message();
  log.run.threads = {2, 1};
  for (TraceTask& t : log.tasks)
    if (t.patch == 0 && t.phase == 1) {
      t.thread = 1;
      t.ready = 2.15;
      t.noted = true;
      t.end = 4;  // it ends last
    }
  log.intervals.push_back({.kind = TraceKind::completed, .step = 7, .begin = 2.1, .end = 2.14});
  const TraceReport report = analyse(linked_again(std::move(log)));
  CHECK(on_path(report, PathPart::Kind::task) == doctest::Approx(2 + 1.8));
  CHECK(on_path(report, PathPart::Kind::posting) == doctest::Approx(0.1));
  CHECK(on_path(report, PathPart::Kind::step) == doctest::Approx(0.04));
  CHECK(on_path(report, PathPart::Kind::start) == doctest::Approx(0.06));
}

TEST_CASE("in a bulk-synchronous run, what could begin waits for a barrier") {
  TraceLog log = two_alone();
  log.run.executor = "bulk-synchronous";
  for (TraceTask& t : log.tasks)  // the second step begins when the first has ended
    if (t.step == 1 && t.patch == 0) {
      t.begin += 2;
      t.end += 6;
    }
  const TraceReport report = analyse(linked_again(std::move(log)));
  CHECK(on_path(report, PathPart::Kind::barrier) == doctest::Approx(2));
  CHECK(finding(report, "barriers").loss == doctest::Approx(2));
  CHECK(finding(report, "runtime").loss == 0);
}

TEST_CASE("load is the share of a rank's workers in tasks, by equal intervals") {
  TraceLog log = two_alone();  // of 6 s, two steps
  add_load(log);
  const auto values = values_of(log, TraceCounter::load, 0);
  REQUIRE(values.size() == 2);
  CHECK(values[0].time == 0);
  CHECK(values[1].time == doctest::Approx(3));
  CHECK(values[0].value == doctest::Approx((2.0 + 3) / 6));
  CHECK(values[1].value == doctest::Approx(3.0 / 6));
}

TEST_CASE("a sound trace has no problems, others say which") {
  CHECK(problems_of(two_alone()).empty());
  CHECK(problems_of(one_message()).empty());

  TraceLog missing = two_alone();
  missing.tasks.pop_back();
  CHECK(problems_of(missing) ==
        std::vector<std::string>{"task not exactly once: phase 0 of patch 1, step 1: 0 times"});

  TraceLog early = one_message();
  for (TraceTask& t : early.tasks)
    if (t.phase == 1 && t.patch == 1) t.begin = 2.3;
  const auto problems = problems_of(early);
  REQUIRE(problems.size() == 1);
  CHECK(problems[0].starts_with("began before what it waited for: phase 1 of patch 1"));

  TraceLog unready = one_message();
  for (TraceTask& t : unready.tasks)
    if (t.phase == 1 && t.patch == 1) t.ready = 2.59;
  CHECK(problems_of(unready) ==
        std::vector<std::string>{"ready before what it waited for had ended: phase 1 of patch 1, "
                                 "step 0, rank 1: 1e+04 us"});

  TraceLog unsent = one_message();
  unsent.messages.clear();
  CHECK(problems_of(unsent) ==
        std::vector<std::string>{"receive without a send: phase 0 of patch 0, step 0, rank 1"});
}

TEST_CASE("the report as JSON has what the text has") {
  const TraceLog log = one_message();
  const TraceReport report = analyse(log);
  const auto json = nlohmann::json::parse(json_of(log, report));
  CHECK(json.at("wall").get<double>() == doctest::Approx(3.6));
  CHECK(json.at("findings").size() == report.findings.size());
  CHECK(json.at("stages").at(0).at("stage") == "first");
  CHECK(text_of(log, report).find("messages on their way") != std::string::npos);
}
