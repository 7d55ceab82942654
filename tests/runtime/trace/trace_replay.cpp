// Replays of traces made by hand, whose times are known, and of one that was recorded.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "graph/executor.h"
#include "graph/stage_loop.h"
#include "physics/base/error.h"
#include "runtime/program/trace_session.h"
#include "runtime/trace/analyse/project.h"
#include "runtime/trace/analyse/replay.h"
#include "tests/runtime/step/models.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

constexpr double ms = 1e-3;

/// A log of patches in a row, of which each exchanges with the next, in phases "a" (takes particles
/// from neighbours), "b" (takes sums) and perhaps the rest of "b". Tasks took one after the other,
/// without gaps.
struct Row {
  int patches = 2, ranks = 1, steps = 10;
  bool linked = true, adaptive = false, with_rest = false;
  std::function<double(Step, int phase, int patch)> time = [](auto...) { return ms; };

  TraceLog log() const {
    TraceLog log;
    log.run.ranks = ranks;
    log.run.threads.assign(static_cast<std::size_t>(ranks), 1);
    log.run.adaptive = adaptive;
    log.run.phases = {{.name = "a", .exchange = linked ? "particles" : "", .stages = {"a"}},
                      {.name = "b",
                       .exchange = linked ? "mass" : "",
                       .gives_dt = adaptive,
                       .needs_dt = adaptive,
                       .stages = {"b"}}};
    if (with_rest) log.run.phases.push_back({.name = "rest of b", .stages = {"rest"}});
    const int phases = static_cast<int>(log.run.phases.size());
    log.run.loops = {{time_step_loop, 0, phases}};
    log.run.last = steps - 1;
    TraceGraph& graph = log.graphs.emplace_back();
    for (int p = 0; p < patches; ++p) {
      TracePatch& patch = graph.patches[p];
      patch = {.number = p, .rank = p * ranks / patches, .cells = 100, .neighbours = {}};
      if (p > 0 && linked) patch.neighbours.push_back(p - 1);
      if (p + 1 < patches && linked) patch.neighbours.push_back(p + 1);
    }
    double now = 0;
    for (Step s = 0; s < steps; ++s)
      for (int f = 0; f < phases; ++f)
        for (int p = 0; p < patches; ++p) {
          const double end = now + time(s, f, p);
          log.tasks.push_back({.step = s,
                               .rank = p * ranks / patches,
                               .phase = f,
                               .patch = p,
                               .ready = now,
                               .begin = now,
                               .end = end});
          now = end;
        }
    log.run.wall = now;
    return log;
  }
};

Network latency(double seconds) {
  Network network = Network::ideal();
  network.latency = seconds;
  return network;
}

double uneven(Step s, int f, int p) {
  return ms * (1 + 0.1 * static_cast<double>((7 * s + 5 * f + 3 * p) % 11));
}

}  // namespace

TEST_CASE("replay: a patch alone takes the time of its tasks, whatever the number of threads") {
  const TraceLog log = Row{.patches = 1, .time = uneven}.log();
  for (const int threads : {1, 4}) {
    const Replay r = replay(log, {.threads = threads});
    CHECK(r.total == within(1e-6, log.run.wall));
    CHECK(r.efficiency == within(1e-6, 1.0 / threads));
    CHECK(r.step_time.size() == 10);
  }
}

TEST_CASE("replay: two patches without links take half of the time on two threads") {
  const TraceLog log = Row{.linked = false}.log();
  CHECK(replay(log, {.threads = 1}).total == within(1e-6, 40 * ms));
  const Replay r = replay(log, {.threads = 2});
  CHECK(r.total == within(1e-6, 20 * ms));
  CHECK(r.load_balance == within(1e-6, 1.0));
}

TEST_CASE("replay: a patch may be four steps ahead of the slowest, not more") {
  // The second patch does nothing in its first steps, then all work; it can do so while the first,
  // which works in all steps, is at most max_lead steps behind.
  const auto time = [](Step s, int, int p) { return p == 0 ? ms : s < 6 ? 0.0 : ms; };
  const TraceLog log = Row{.linked = false, .time = time}.log();
  // The first takes 20 ms. The second begins step 6 when the first has ended step 2, at 6 ms.
  const Replay r = replay(log, {.threads = 2});
  CHECK(max_lead == 4);
  CHECK(r.total == within(1e-6, 20 * ms));
  const auto late = [](Step s, int, int p) { return p == 0 ? ms : s < 9 ? 0.0 : 10 * ms; };
  // Step 9 of the second: when the first has ended step 5, at 12 ms; 20 ms of work.
  CHECK(replay(Row{.linked = false, .time = late}.log(), {.threads = 2}).total ==
        within(1e-6, 32 * ms));
}

TEST_CASE("replay: two ranks wait for the latency of each exchange that nothing hides") {
  const TraceLog log = Row{.ranks = 2}.log();
  // A patch per rank: 20 tasks after each other, and 19 messages between them.
  for (const double l : {0.0, 0.5 * ms, 3 * ms}) {
    const Replay r = replay(log, {.network = latency(l)});
    CHECK(r.total == within(1e-5, 20 * ms + 19 * l));
    CHECK(r.messages == 38);
    CHECK(r.ideal_total == within(1e-5, 20 * ms));
    CHECK(r.transfer == within(1e-5, 20 * ms / r.total));
    CHECK(r.exposed == (l > 0 ? within(1e-4, 38 * l) : doctest::Approx(0)));
  }
}

TEST_CASE("replay: the recorded machine takes the time that was recorded, with barriers no less") {
  // A patch on each of two ranks, whose tasks take turns with messages of a known latency.
  constexpr double l = 0.3 * ms;
  TraceLog log = Row{.ranks = 2, .steps = 50}.log();
  log.tasks.clear();
  double now = 0;
  for (Step s = 0; s < 50; ++s)
    for (int f = 0; f < 2; ++f) {
      double end = now;
      for (int p = 0; p < 2; ++p) {
        const double done = now + uneven(s, f, p);
        log.tasks.push_back({.step = s,
                             .rank = p,
                             .phase = f,
                             .patch = p,
                             .ready = now,
                             .begin = now,
                             .end = done,
                             .released = done});
        log.messages.push_back({.step = s,
                                .phase = f,
                                .patch = p,
                                .from = p,
                                .to = 1 - p,
                                .bytes = 1000,
                                .packed = done,
                                .sent = done,
                                .posted = done,
                                .arrived = done + l,
                                .given = done + l,
                                .sender = static_cast<int>(log.tasks.size()) - 1});
        end = std::max(end, done);
      }
      log.run.wall = end;
      now = end + l;
    }
  // In the log both ranks wait for the slower one each time, which the graph does not ask of them.
  const Replay graph = replay(log, {});
  CHECK(graph.total <= 1.0001 * log.run.wall);
  CHECK(graph.total > 0.9 * log.run.wall);
  const Replay bulk = replay(log, {.bulk_synchronous = true});
  CHECK(bulk.total >= graph.total);
  // A barrier after each of 100 phases, and one at the end of each step, of a hop each.
  CHECK(bulk.total == within(0.01, log.run.wall + (99 + 49) * l));
}

TEST_CASE("replay: work hides latency where a rank has patches that need no message") {
  const TraceLog log = Row{.patches = 8, .ranks = 2, .steps = 20}.log();
  const double alone = replay(log, {.network = latency(0)}).total;
  CHECK(alone == within(1e-5, 160 * ms));
  // Three patches of a millisecond each while the message of the first is under way.
  CHECK(replay(log, {.network = latency(2 * ms)}).total < 1.05 * alone);
  CHECK(replay(log, {.network = latency(2 * ms), .bulk_synchronous = true}).total > 1.3 * alone);
}

TEST_CASE("replay: a time step is agreed on by all ranks before it is used") {
  Row row{.patches = 2, .ranks = 2, .steps = 10, .adaptive = true};
  const double l = ms;
  // "a" needs no dt and takes 1 ms: the reduction of 1 ms (2 ranks: one hop) after "b" and the
  // message of particles go on at the same time, then both wait for the message of sums.
  const Replay r = replay(row.log(), {.network = latency(l)});
  CHECK(r.total == within(1e-5, 20 * ms + 19 * l));
  row.linked = false;  // b waits for the reduction, which a hides
  CHECK(replay(row.log(), {.network = latency(l)}).total == within(1e-5, 20 * ms));
  CHECK(replay(row.log(), {.network = latency(3 * l)}).total == within(1e-5, 20 * ms + 9 * 2 * l));
}

TEST_CASE("replay: rests are what a rank does until the time step is agreed on") {
  // Three patches on each of 8 ranks, tasks of 1 ms but for those of "a".
  const auto time = [](Step, int f, int) { return f == 0 ? 0.0 : ms; };
  const TraceLog log =
      Row{.patches = 24, .ranks = 8, .adaptive = true, .with_rest = true, .time = time}.log();
  // In a step of one rank: "b" of all patches until 3 ms, after which the ranks agree in 3 hops,
  // rests of the outer patches until 5 ms, of the middle one until 6. Messages of the outer ones
  // take two hops, to "a" and to "b", which the middle one does before.
  for (const double l : {0.0, 0.3 * ms, 0.9 * ms})
    CHECK(replay(log, {.network = latency(l)}).total == within(1e-5, 60 * ms));
}

TEST_CASE("replay: barriers never make steps shorter, more threads never longer") {
  for (const bool adaptive : {false, true})
    for (const int patches : {3, 8, 16}) {
      CAPTURE(patches);
      const TraceLog log =
          Row{.patches = patches, .ranks = 2, .adaptive = adaptive, .time = uneven}.log();
      double before = 1e9;
      for (const int threads : {1, 2, 4, 8}) {
        ReplayMachine machine{.threads = threads, .network = latency(0.2 * ms)};
        const double graph = replay(log, machine).total;
        CHECK(graph <= 1.0001 * before);
        CHECK(graph == replay(log, machine).total);
        machine.bulk_synchronous = true;
        CHECK(replay(log, machine).total >= graph);
        before = graph;
      }
      // Nothing is shorter than the tasks of a patch, one after the other.
      double longest = 0;
      for (int p = 0; p < patches; ++p) {
        double chain = 0;
        for (Step s = 0; s < 10; ++s) chain += uneven(s, 0, p) + uneven(s, 1, p);
        longest = std::max(longest, chain);
      }
      CHECK(replay(log, {.threads = patches, .network = Network::ideal()}).total >=
            (1 - 1e-6) * longest);
    }
}

TEST_CASE("replay: patches are dealt to another number of ranks by their work") {
  const auto time = [](Step, int, int p) { return p == 0 ? 3 * ms : ms; };
  const TraceLog log = Row{.patches = 4, .time = time}.log();
  const Replay r = replay(log, {.ranks = 2, .network = Network::ideal()});
  REQUIRE(r.useful.size() == 2);
  CHECK(r.useful[0] == within(1e-6, 60 * ms));
  CHECK(r.useful[1] == within(1e-6, 60 * ms));
  CHECK(json_of(r).find("\"efficiency\"") != std::string::npos);
}

TEST_CASE("replay: a trace without some task is refused") {
  TraceLog log = Row{}.log();
  log.tasks.erase(log.tasks.begin() + 5);
  CHECK_THROWS_WITH_AS(replay(log, {}),
                       "the trace cannot be replayed: a task of step 1 is missing ('a')",
                       InputError);
}

TEST_CASE("replay: a recorded run on its own machine takes the time that it took") {
  const auto folder = std::filesystem::temp_directory_path() / "lahar-replay-test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  Simulation simulation(dam_break(), flow(1));
  {
    TraceSession session(folder, {}, Communicator{}, TraceAbout{}, simulation.loops(),
                         simulation.trace_graph());
    simulation.run();
    session.finish();
  }
  const TraceLog log = read_trace(folder);
  std::filesystem::remove_all(folder);
  const Replay r = replay(log, {});
  // Where others take the core meanwhile, the run waits, too.
  CHECK(r.total < 1.1 * log.run.wall);
  CHECK(r.total > 0.4 * log.run.wall);
  CHECK(replay(log, {.threads = 2}).total < r.total);
}

TEST_CASE("a projection of steady work: weak scaling costs what messages cost, barriers more") {
  const TraceLog log = Row{.patches = 16, .steps = 20}.log();
  Network network = latency(0);
  const ScalingProjection ideal = project(log, {.network = network, .cores = 1000});
  REQUIRE(ideal.weak.size() > 4);
  CHECK(ideal.weak.back().cores == 1000);
  for (const ProjectionPoint& p : ideal.weak) {
    CAPTURE(p.cores);
    CHECK(p.graph == within(0.05, 32 * ms));  // its patches begin to overlap steps
    CHECK(p.bulk == within(0.05, 32 * ms));
    CHECK(p.patches == doctest::Approx(16));
  }
  network = latency(0.5 * ms);
  const ScalingProjection slow = project(log, {.network = network, .cores = 1000});
  for (std::size_t i = 1; i < slow.weak.size(); ++i) {
    CHECK(slow.weak[i].graph <= slow.weak[i].bulk);
    // Two phases and a step, each with a barrier of as many hops as ranks need.
    const double hops = tree_height(static_cast<double>(slow.weak[i].ranks));
    CHECK(slow.weak[i].bulk >= 32 * ms + 3 * hops * 0.5 * ms);
  }
  REQUIRE(!slow.strong.empty());
  CHECK(slow.strong.back().cores == 16);
  CHECK(slow.strong.back().patches == 1);
}

TEST_CASE("a projection of uneven work: barriers wait for the slowest of all ranks") {
  const TraceLog log = Row{.patches = 4, .steps = 40, .time = uneven}.log();
  const ScalingProjection p = project(log, {.network = Network::ideal(), .cores = 1e5});
  CHECK(p.weak.back().cores == 100'000);
  CHECK(p.largest.back().cores == 100'000);
  CHECK(p.largest.back().patches == doctest::Approx(1));
  for (std::size_t i = 1; i < p.weak.size(); ++i)
    CHECK(p.weak[i].graph_efficiency > p.weak[i].bulk_efficiency);
  CHECK(text_of(p) == text_of(project(log, {.network = Network::ideal(), .cores = 1e5})));
}

TEST_CASE("networks are read with units, mistakes are named with their place") {
  const auto path = std::filesystem::temp_directory_path() / "lahar-network-test.json";
  const auto read = [&](const std::string& text) {
    std::ofstream(path) << text;
    return read_network(path.string());
  };
  const Network n = read(R"({"latency": "2us", "bandwidth": "100Gbit/s", "overhead": 5e-7})");
  CHECK(*n.latency == within(1e-5, 2e-6));
  CHECK(*n.bandwidth == doctest::Approx(1.25e10));
  CHECK(*n.overhead == within(1e-5, 5e-7));
  CHECK(n.reduction(1000) == within(1e-5, 20e-6));
  CHECK(!read("{}").latency);
  CHECK(*read(R"({"ideal": true})").latency == 0);
  CHECK(*read_network("ideal").latency == 0);
  CHECK_THROWS_WITH_AS(read(R"({"latency": "2 hours"})"),
                       "\"latency\" is a time, zero or more, not text \"2 hours\"", InputError);
  CHECK_THROWS_WITH_AS(read(R"({"bandwidth": 0})"),
                       "\"bandwidth\" is a rate above zero, not number 0", InputError);
  CHECK_THROWS_WITH_AS(read(R"({"latancy": 1})"), "unknown key \"latancy\"", InputError);
  CHECK_THROWS_WITH_AS(read("[1]"), "a network is an object, not array [1]", InputError);
  CHECK_THROWS_AS(read_network("/nonexistent/network.json"), InputError);
  CHECK_THROWS_AS(read_network("/dev/zero"), InputError);
  std::filesystem::remove(path);
}
