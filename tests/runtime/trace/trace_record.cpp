// What runs record, read back.
#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <thread>

#include "runtime/trace/analyse/analysis.h"
#include "runtime/trace/analyse/counters.h"
#include "tests/runtime/trace/recorded.h"
#include "tests/within.h"

using namespace lahar;
using namespace lahar::test;

namespace {

TraceLog recorded_dam(const ExecutionOptions& way, TraceWindow window = {}) {
  return recorded(dam_break(), way, window).log;
}

}  // namespace

TEST_CASE("when a task was ready is noted: after all that it waited for, before it began") {
  for (const int threads : {1, 3}) {
    CAPTURE(threads);
    const TraceLog log = recorded_dam(flow(threads));
    CHECK(problems_of(log).empty());
    std::vector<double> later;
    for (const TraceTask& task : log.tasks) {
      REQUIRE(task.noted);
      CHECK(task.ready <= task.begin);
      if (task.known_inputs && log.graph_at(task.step).first < task.step)
        later.push_back(task.ready - task.inputs_done);
    }
    REQUIRE(later.size() > 1000);
    // Had log_links.cpp overlooked something that tasks wait for, they would be ready long after
    // all that it knows. Most of them, as threads may be interrupted between the two.
    std::sort(later.begin(), later.end());
    CHECK(later.front() >= -1e-6);  // clocks of processors
    CHECK(later[later.size() / 2] < 20e-6);
    CHECK(later[later.size() * 9 / 10] < 100e-6);
  }
}

TEST_CASE("threads that end give their buffers back: memory does not grow with their number") {
  const auto folder = std::filesystem::temp_directory_path() / "lahar-recorder-test";
  std::filesystem::create_directories(folder);
  std::uint16_t last = 0;
  {
    TraceRecorder recorder(folder / "rank-0.trace", TraceWindow{}, "{}");
    const auto record = [&] { last = recorder.add({.step = 1, .kind = TraceKind::checkpoint}); };
    for (int k = 0; k < 100; ++k) std::thread(record).join();
    CHECK(last == 0);
    std::thread([&] {
      record();
      std::thread(record).join();
    }).join();
    CHECK(last == 1);  // while another thread has the first
  }
  std::filesystem::remove_all(folder);
}

TEST_CASE("where nothing notes when tasks are ready, it is when the last input had ended") {
  ExecutionOptions serial = flow(1);
  serial.mode = Mode::serial;
  const TraceLog log = recorded_dam(serial);
  for (const TraceTask& task : log.tasks) {
    CHECK(!task.noted);
    if (log.graph_at(task.step).first < task.step)  // else it waited for patches to be made, too
      CHECK(task.ready == task.inputs_done);
    else
      CHECK(task.ready >= task.inputs_done);
  }
}

TEST_CASE("all particles are counted in every step, and memory and load are there") {
  const Index particles = Simulation(dam_break(), flow(1)).info().particles;
  const TraceLog log = recorded_dam(flow(2));
  const auto counted = values_of(log, TraceCounter::particles, 0);
  REQUIRE(!counted.empty());
  for (const TraceValue& value : counted) CHECK(value.value == static_cast<double>(particles));
  const auto memory = values_of(log, TraceCounter::memory, 0);
  REQUIRE(!memory.empty());
  CHECK(memory.front().value > 1e6);
  CHECK(memory.front().value < 1e11);

  double busy = 0, tasks = 0;
  const auto load = values_of(log, TraceCounter::load, 0);
  REQUIRE(static_cast<Step>(load.size()) == log.run.last - log.run.first + 1);
  for (const TraceValue& value : load) busy += value.value / static_cast<double>(load.size());
  for (const TraceTask& task : log.tasks)
    if (task.kind == TraceKind::task) tasks += task.end - task.begin;
  CHECK(busy * log.run.wall * 2 == within(1e-5, tasks));
}

TEST_CASE("tasks of the first recorded step have been ready, too") {
  const TraceLog log = recorded_dam(flow(2), {.first = 5, .last = 9});
  CHECK(log.run.first == 5);
  CHECK(log.run.last == 9);
  CHECK(problems_of(log).empty());
  for (const TraceTask& task : log.tasks) CHECK(task.noted);
}
