// Executors: every order that the edges allow, and no other; how far patches run ahead; stopping.
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>

#include "graph/distributed_flow.h"
#include "tests/graph/step_graphs.h"

using namespace lahar;
using namespace lahar::test;

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Waiting longer than this means that what is waited for never comes.
constexpr auto patience = 20s;

/// Waits for a condition; false if it does not come.
template <class Condition>
bool wait_for(Condition condition) {
  const auto end = Clock::now() + patience;
  while (!condition()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(50us);
  }
  return true;
}

TaskBodies only(std::function<void(int, int, Step)> run) {
  return {std::move(run), [](Step) {}, [](Step) {}};
}

}  // namespace

TEST_CASE("every executor takes every task through every step in an order that the stages allow") {
  constexpr Step first = 3, steps = 200;
  for (const Neighbours& neighbours : {block(5, 4), irregular(11, 0.3, 5), block(1, 1)})
    for (const bool adaptive : {false, true})
      for (const auto& stages : {one_exchange(adaptive), two_exchanges(adaptive)})
        for (const Way way : all_ways) {
          CAPTURE(static_cast<int>(way.kind));
          CAPTURE(way.threads);
          CAPTURE(adaptive);
          Watch watch(stages, neighbours, first);
          const auto executor = make_executor(way.kind, make_task_graph(stages, neighbours),
                                              watch.bodies(), way.threads);
          CHECK(executor->run(first, first + steps) == first + steps);
          CHECK(watch.wrong() == "");
          CHECK(watch.all_done(first + steps));
          CHECK(watch.firings() == steps * static_cast<long>(stages.size() * neighbours.size()));
          if (adaptive) CHECK(watch.dt_known_before() == first + steps);
        }
}

TEST_CASE("more threads than cores are taken without a word on standard error") {
  std::FILE* const file = std::tmpfile();
  REQUIRE(file);
  std::fflush(stderr);
  const int before = dup(STDERR_FILENO);
  dup2(fileno(file), STDERR_FILENO);
  const std::vector<Stage> stages = one_exchange(false);
  const Neighbours neighbours = block(5, 4);
  for (const int more : {3, 1, 2}) {
    Watch watch(stages, neighbours, 0);
    const auto executor = make_executor(Kind::flow, make_task_graph(stages, neighbours),
                                        watch.bodies(), available_threads() + more);
    executor->run(0, 20);
  }
  std::fflush(stderr);
  dup2(before, STDERR_FILENO);
  close(before);
  std::rewind(file);
  std::string said(4096, '\0');
  said.resize(std::fread(said.data(), 1, said.size(), file));
  std::fclose(file);
  CHECK(said == "");
}

namespace {

/// Another rank that does the same as this one, some looks later: what it sends of a patch is there
/// when this rank has done the same of the patch that it mirrors, and so are agreements.
class Mirror final : public Remote {
 public:
  explicit Mirror(bool has_cores) : has_cores_(has_cores) {}

  bool progress(Executor& executor) override {
    std::deque<Message> messages;
    std::optional<Step> dt, step;
    {
      const std::scoped_lock lock(mutex_);
      while (!messages_.empty() && messages_.front().looks-- <= 0) {
        messages.push_back(messages_.front());
        messages_.pop_front();
      }
      dt = found(dt_);
      step = found(steps_);
    }
    for (const Message& message : messages) executor.arrived(message.stage, message.patch);
    if (dt) executor.dt_agreed(*dt);
    if (step) executor.step_agreed(*step);
    return dt || step || !messages.empty();
  }
  void send(int stage, int patch) {
    const std::scoped_lock lock(mutex_);
    messages_.push_back({stage, patch, 3});
  }
  void post(bool /*all*/) override {}
  void give_dt(Step step) override {
    const std::scoped_lock lock(mutex_);
    dt_.push_back({step, 30});
  }
  void give_step(Step step) override {
    const std::scoped_lock lock(mutex_);
    steps_.push_back({step, 5});
  }
  bool has_cores() const override { return has_cores_; }
  void wait_for_all() override {}

 private:
  /// Found after so many looks that are in vain.
  struct Message {
    int stage, patch, looks;
  };
  struct Asked {
    Step step;
    int looks;
  };
  static std::optional<Step> found(std::deque<Asked>& asked) {
    if (asked.empty() || asked.front().looks-- > 0) return {};
    const Step step = asked.front().step;
    asked.pop_front();
    return step;
  }

  const bool has_cores_;
  std::mutex mutex_;
  std::deque<Message> messages_;
  std::deque<Asked> dt_, steps_;
};

}  // namespace

TEST_CASE("rests are deferred, and done while the time step is agreed on") {
  const auto stages =
      tasks_of(phases_of({{.name = "arrivals", .exchange = "particles"},
                          {.name = "integrate", .exchange = "sums", .needs_dt = true},
                          {.name = "locate", .gives_dt = true},
                          {.name = "P2G"}},
                         true));
  REQUIRE(stages.size() == 3);
  // The last column of 5 x 4 patches exchanges with its mirror image, patches 20 to 23.
  constexpr int nx = 5, ny = 4;
  const Neighbours own = block(nx, ny);
  const auto exchanges = [](int patch) { return patch % nx == nx - 1; };
  Neighbours all = own;
  for (int y = 0; y < ny; ++y)
    for (int other = std::max(0, y - 1); other <= std::min(ny - 1, y + 1); ++other)
      all[static_cast<std::size_t>(y * nx + nx - 1)].push_back(nx * ny + other);
  all.resize(nx * ny + ny);
  for (const int threads : {1, 2, 3})
    for (const bool has_cores : {false, true}) {
      CAPTURE(threads);
      CAPTURE(has_cores);
      Watch watch(stages, own);
      Mirror mirror(has_cores);
      std::atomic<int> together{0}, apart{0}, apart_at_border{0};
      TaskBodies bodies = watch.bodies();
      const auto run = [&](int s, int p, Step step) {
        if (p >= nx * ny) return;  // a message
        watch.run(s, p, step);
        // Sums and particles, which the following stage takes.
        if (exchanges(p) && s != 1) mirror.send(s, nx * ny + p / nx);
      };
      bodies.run = [&](int s, int p, Step step) {
        if (p < nx * ny && stages[static_cast<std::size_t>(s)].is_rest)
          ++(exchanges(p) ? apart_at_border : apart);
        run(s, p, step);
      };
      bodies.run_with_rest = [&](int s, int p, Step step) {
        ++together;
        run(s, p, step);
        run(s + 1, p, step);
      };
      const auto executor = make_distributed_flow(make_task_graph(stages, all, true, ny), bodies,
                                                  threads, true, mirror);
      CHECK(executor->run(0, 100) == 100);
      CHECK(watch.wrong() == "");
      CHECK(watch.all_done(100));
      CHECK(together + apart + apart_at_border == 2000);
      CHECK(together > 0);
      CHECK(apart > 0);
      CHECK((apart_at_border > 0) == has_cores);
    }
}

TEST_CASE("rounds of a step are taken in order by every executor, each with a dt of its own") {
  constexpr Step first = 3, steps = 100;
  const auto stages = solver_round();
  REQUIRE(safe_rounds(stages) == 2);
  for (const Neighbours& neighbours : {block(5, 4), irregular(11, 0.3, 5), block(1, 1)})
    for (const Way way : all_ways) {
      CAPTURE(static_cast<int>(way.kind));
      CAPTURE(way.threads);
      Watch watch(stages, neighbours, 2 * first);
      const auto executor =
          make_executor(way.kind, make_task_graph(stages, neighbours, false, 0, 2),
                        watch.bodies_of_rounds(2), way.threads);
      CHECK(executor->run(first, first + steps) == first + steps);
      CHECK(watch.wrong() == "");
      CHECK(watch.all_done(2 * (first + steps)));
      CHECK(watch.dt_known_before() == 2 * (first + steps));
    }
}

TEST_CASE("rounds of a rank that agrees with others are taken in order") {
  constexpr int nx = 4, ny = 3;
  const auto stages = solver_round();
  const Neighbours own = block(nx, ny);
  Neighbours all = own;
  for (int y = 0; y < ny; ++y)  // the last column exchanges with its mirror image
    for (int other = std::max(0, y - 1); other <= std::min(ny - 1, y + 1); ++other)
      all[static_cast<std::size_t>(y * nx + nx - 1)].push_back(nx * ny + other);
  all.resize(nx * ny + ny);
  for (const int threads : {1, 2, 3}) {
    CAPTURE(threads);
    Watch watch(stages, own);
    Mirror mirror(true);
    TaskBodies bodies = watch.bodies_of_rounds(2);
    bodies.run = [&, run = bodies.run](int s, int p, Step step) {
      if (p >= nx * ny) return;  // a message
      run(s, p, step);
      if (p % nx == nx - 1 && s % 2 == 0) mirror.send(s, nx * ny + p / nx);
    };
    const auto executor = make_distributed_flow(make_task_graph(stages, all, true, ny, 2), bodies,
                                                threads, true, mirror);
    CHECK(executor->run(0, 50) == 50);
    CHECK(watch.wrong() == "");
    CHECK(watch.all_done(100));
  }
}

TEST_CASE("bodies of uneven length do not disturb the order") {
  for (const int threads : {2, 3, 8}) {
    Watch watch(two_exchanges(true), block(4, 3));
    TaskBodies bodies = watch.bodies();
    bodies.run = [&](int s, int p, Step step) {
      if ((s * 31 + p * 17 + step * 7) % 23 == 0) std::this_thread::sleep_for(100us);
      watch.run(s, p, step);
    };
    const auto executor =
        make_local_flow(make_task_graph(two_exchanges(true), block(4, 3)), bodies, threads, true);
    CHECK(executor->run(0, 100) == 100);
    CHECK(watch.wrong() == "");
    CHECK(watch.all_done(100));
  }
}

TEST_CASE("a graph that is not safe is found out by the checks of the flow graph") {
  const auto stages = std::vector<Stage>{{.name = "all", .exchange = "all"}};
  for (const int threads : {1, 3}) {
    const auto executor = make_local_flow(make_task_graph(stages, block(5, 4)),
                                          only([](int, int, Step) {}), threads, true);
    std::string message;
    try {
      executor->run(0, 5000);
    } catch (const std::logic_error& error) {
      message = error.what();
    }
    CHECK(message.find("task all ") == 0);
    CHECK(message.find(" steps instead of ") != std::string::npos);
  }
}

TEST_CASE("no barrier: the far end of a row is a step ahead while the near end is still busy") {
  constexpr int n = 10;
  std::atomic<Step> far_end{0};
  bool came = false;
  const auto executor = make_local_flow(make_task_graph(one_exchange(), block(n, 1)),
                                        only([&](int s, int p, Step step) {
                                          if (p == n - 1 && s == 0) far_end = step;
                                          if (p == 0 && s == 0 && step == 0)
                                            came = wait_for([&] { return far_end >= 1; });
                                        }),
                                        2, true);
  executor->run(0, 3);
  CHECK(came);
}

TEST_CASE("an adaptive step keeps everybody within one step of each other") {
  constexpr int n = 10;
  std::atomic<Step> far_start{0}, far_integrate{-1};
  Step integrated = -1;
  bool came = false;
  const auto executor = make_local_flow(make_task_graph(one_exchange(true), block(n, 1)),
                                        only([&](int s, int p, Step step) {
                                          if (p == n - 1 && s == 0) far_start = step;
                                          if (p == n - 1 && s == 1) far_integrate = step;
                                          if (p == 0 && s == 0 && step == 0) {
                                            came = wait_for([&] { return far_start >= 1; });
                                            std::this_thread::sleep_for(5ms);
                                            integrated = far_integrate;
                                          }
                                        }),
                                        2, true);
  executor->run(0, 3);
  CHECK(came);             // what needs no dt goes ahead,
  CHECK(integrated == 0);  // what needs dt waits for the slowest patch
}

TEST_CASE("no patch is more than max_lead steps ahead, not even of patches it has no link to") {
  // Two pairs of patches that know nothing of each other; the first patch stays in step 0.
  const Neighbours neighbours{{1}, {0}, {3}, {2}};
  std::atomic<Step> others{0};
  std::atomic<int> slow_done{0};
  bool came = false;
  Step furthest = 0;
  std::atomic<bool> too_far{false};
  std::vector<std::atomic<Step>> finished(4);
  const auto executor = make_local_flow(
      make_task_graph(one_exchange(), neighbours), only([&](int s, int p, Step step) {
        if (s == 0) {
          Step slowest = step;
          for (const auto& f : finished) slowest = std::min(slowest, f.load());
          if (step - slowest >= max_lead) too_far = true;
          if (p >= 2) others = std::max(others.load(), step);
        }
        if (p == 0 && s == 0 && step % 20 == 0) {
          const bool here = wait_for([&] { return others >= step + max_lead - 1; });
          std::this_thread::sleep_for(3ms);
          if (step == 0) came = here, furthest = others;
          ++slow_done;
        }
        if (s == 2) ++finished[static_cast<std::size_t>(p)];
      }),
      3, true);
  executor->run(0, 60);
  CHECK(came);
  CHECK(furthest == max_lead - 1);
  CHECK(!too_far);
  CHECK(slow_done == 3);
}

TEST_CASE("a stop that is asked for in one step comes for all patches at the same later step") {
  for (const Way way : all_ways)
    for (const bool adaptive : {false, true}) {
      CAPTURE(static_cast<int>(way.kind));
      CAPTURE(way.threads);
      CAPTURE(adaptive);
      const Neighbours neighbours = block(4, 3);
      Watch watch(two_exchanges(adaptive), neighbours);
      Executor* self = nullptr;
      TaskBodies bodies = watch.bodies();
      bodies.run = [&](int s, int p, Step step) {
        watch.run(s, p, step);
        // The earliest request holds, in whatever order they come.
        if (p == 2 && step == 8 && s == 0) self->request_stop(step);
        if (p == 7 && step == 6 && s == 3) {
          std::this_thread::sleep_for(1ms);
          self->request_stop(step);
        }
      };
      const auto executor = make_executor(
          way.kind, make_task_graph(two_exchanges(adaptive), neighbours), bodies, way.threads);
      self = executor.get();
      CHECK(executor->run(0, 1000) == 6 + max_lead);
      CHECK(watch.wrong() == "");
      CHECK(watch.all_done(6 + max_lead));
    }
}

TEST_CASE("after a stop the same executor goes on as if nothing had happened") {
  for (const Way way : all_ways) {
    CAPTURE(static_cast<int>(way.kind));
    CAPTURE(way.threads);
    const Neighbours neighbours = block(3, 3);
    Watch watch(one_exchange(), neighbours);
    Executor* self = nullptr;
    TaskBodies bodies = watch.bodies();
    bodies.run = [&](int s, int p, Step step) {
      watch.run(s, p, step);
      if (step % 10 == 0 && s == 1 && p == 4) self->request_stop(step);
    };
    const auto executor =
        make_executor(way.kind, make_task_graph(one_exchange(), neighbours), bodies, way.threads);
    self = executor.get();
    Step step = 0;
    for (const Step expected : {4, 14, 24, 34, 40}) {
      step = executor->run(step, 40);
      CHECK(step == expected);
      CHECK(watch.all_done(expected));
    }
    CHECK(watch.wrong() == "");
    CHECK(executor->run(40, 40) == 40);
    CHECK(watch.all_done(40));
  }
}

TEST_CASE("the task that sets dt can make the step it sets the last one") {
  for (const Way way : all_ways) {
    CAPTURE(static_cast<int>(way.kind));
    CAPTURE(way.threads);
    for (const auto& stages : {one_exchange(true), two_exchanges(true)}) {
      Watch watch(stages, block(4, 3));
      Executor* self = nullptr;
      TaskBodies bodies = watch.bodies();
      bodies.set_dt = [&](Step step) {
        watch.set_dt(step);
        if (step == 11) self->stop_before(12);
      };
      const auto executor =
          make_executor(way.kind, make_task_graph(stages, block(4, 3)), bodies, way.threads);
      self = executor.get();
      CHECK(executor->run(0, 1000) == 12);
      CHECK(watch.wrong() == "");
      CHECK(watch.all_done(12));
    }
  }
}

TEST_CASE("what a body throws comes out of run(), and the executor can be used again") {
  for (const Way way : all_ways) {
    CAPTURE(static_cast<int>(way.kind));
    CAPTURE(way.threads);
    bool fail = true;
    std::atomic<long> fired{0};
    const Neighbours neighbours = block(4, 4);
    const auto executor = make_executor(way.kind, make_task_graph(one_exchange(), neighbours),
                                        only([&](int s, int p, Step step) {
                                          ++fired;
                                          if (fail && s == 1 && p == 5 && step == 3)
                                            throw std::runtime_error("patch 5 is unwell");
                                        }),
                                        way.threads);
    CHECK_THROWS_WITH_AS(executor->run(0, 100), "patch 5 is unwell", std::runtime_error);
    fail = false;
    fired = 0;
    CHECK(executor->run(0, 50) == 50);
    CHECK(fired == 50 * 3 * 16);
  }
}

namespace {

/// The tasks of one step of two patches, in the order in which a seed runs them.
std::vector<int> order_of(const std::vector<Stage>& stages, std::uint64_t seed, Step steps) {
  std::vector<int> order;
  const auto executor =
      make_random_executor(make_task_graph(stages, {{1}, {0}}), only([&](int s, int p, Step step) {
                             order.push_back(static_cast<int>(step) * 100 + s * 10 + p);
                           }),
                           seed);
  executor->run(0, steps);
  return order;
}

}  // namespace

TEST_CASE("random orders reach every order of two patches and two stages, and no other") {
  const std::vector<Stage> apart{{.name = "a", .exchange = "x"}, {.name = "b"}};
  const std::vector<Stage> linked{{.name = "a", .exchange = "x"}, {.name = "b", .exchange = "y"}};
  std::set<std::vector<int>> of_apart, of_linked;
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    of_apart.insert(order_of(apart, seed, 1));
    of_linked.insert(order_of(linked, seed, 1));
  }
  CHECK(of_apart == std::set<std::vector<int>>{{0, 1, 10, 11},
                                               {0, 1, 11, 10},
                                               {1, 0, 10, 11},
                                               {1, 0, 11, 10},
                                               {0, 10, 1, 11},
                                               {1, 11, 0, 10}});
  CHECK(of_linked ==
        std::set<std::vector<int>>{{0, 1, 10, 11}, {0, 1, 11, 10}, {1, 0, 10, 11}, {1, 0, 11, 10}});
}

TEST_CASE("every seed gives an order of its own, the same each time") {
  const std::vector<Stage> stages = one_exchange();
  std::set<std::vector<int>> orders;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    orders.insert(order_of(stages, seed, 30));
    CHECK(order_of(stages, seed, 30) == order_of(stages, seed, 30));
  }
  CHECK(orders.size() == 50);
}

TEST_CASE("random order lets some patch begin a step before another has finished the one before") {
  const Neighbours neighbours = block(6, 1);
  std::vector<Step> finished(6, 0);
  Step lead = 0;
  const auto executor = make_random_executor(
      make_task_graph(one_exchange(), neighbours), only([&](int s, int p, Step step) {
        if (s == 2) finished[static_cast<std::size_t>(p)] = step + 1;
        if (s == 0)
          lead = std::max(lead, step - *std::min_element(finished.begin(), finished.end()));
      }),
      3);
  executor->run(0, 300);
  CHECK(lead >= 1);
  CHECK(lead < max_lead);
}
