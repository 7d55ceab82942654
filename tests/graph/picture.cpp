// The picture of the graph, the graph, and what really waits for what are the same.
#include "graph/picture.h"

#include <doctest/doctest.h>

#include <chrono>
#include <set>
#include <sstream>
#include <thread>

#include "tests/graph/step_graphs.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// from, to, lag.
using Arrow = std::tuple<int, int, int>;

/// The arrows of a DOT text, "  t3 -> t7 [style=dashed, ...];".
std::multiset<Arrow> arrows_of(const std::string& dot) {
  std::multiset<Arrow> arrows;
  std::istringstream lines(dot);
  for (std::string line; std::getline(lines, line);) {
    const auto arrow = line.find(" -> t");
    if (arrow == std::string::npos) continue;
    const auto from = line.find('t');
    arrows.insert({std::stoi(line.substr(from + 1)), std::stoi(line.substr(arrow + 5)),
                   line.find("style=dashed") != std::string::npos});
  }
  return arrows;
}

std::string picture(const TaskGraph& graph) {
  std::vector<std::string> names;
  for (int p = 0; p < graph.patches; ++p) names.push_back("patch " + std::to_string(p));
  return to_dot(graph, {names}, "a step");
}

/// (task, step) of the first max_lead steps that come after (task, 0), itself included, along the
/// arrows.
std::set<std::pair<int, Step>> after(const std::multiset<Arrow>& arrows, int task) {
  std::set<std::pair<int, Step>> found{{task, 0}};
  std::vector<std::pair<int, Step>> todo{{task, 0}};
  while (!todo.empty()) {
    const auto [from, step] = todo.back();
    todo.pop_back();
    for (const auto& [a, b, lag] : arrows)
      if (a == from && step + lag < max_lead && found.insert({b, step + lag}).second)
        todo.push_back({b, step + lag});
  }
  return found;
}

}  // namespace

TEST_CASE("the picture shows every task and every edge, dashed where it leads to the next step") {
  for (const bool adaptive : {false, true}) {
    const TaskGraph graph = make_task_graph(two_exchanges(adaptive), block(4, 3));
    const std::string dot = picture(graph);
    std::multiset<Arrow> edges;
    for (const Edge& edge : graph.edges) edges.insert({edge.from, edge.to, edge.lag});
    CHECK(arrows_of(dot) == edges);
    for (int t = 0; t < graph.tasks(); ++t) {
      const std::string name =
          graph.is_dt(t) ? "dt" : graph.stages[static_cast<std::size_t>(graph.stage_of(t))].name;
      CHECK(dot.find("  t" + std::to_string(t) + " [label=\"" + name + "\"") != std::string::npos);
    }
    for (int p = 0; p < graph.patches; ++p)
      CHECK(dot.find("label=\"patch " + std::to_string(p) + "\"") != std::string::npos);
    CHECK(dot.find("tooltip=\"particles\"") != std::string::npos);
    CHECK(dot.find("tooltip=\"force\"") != std::string::npos);
  }
}

TEST_CASE(
    "the picture of a step with a solve frames its loops, in the order in which they are taken") {
  const TaskGraph round = make_task_graph(one_exchange(true), block(2, 1));
  const TaskGraph step = make_task_graph(two_exchanges(false), block(2, 1));
  const std::string dot =
      to_dot({{"solve", "round after round", round}, {"time step", "once", step}},
             {.names = {"left", "right"}, .ranks = {0, 1}}, "a step");
  CHECK(dot.find("label=\"solve: round after round\"") < dot.find("label=\"time step: once\""));
  const auto count = [&](const std::string& part) {
    int n = 0;
    for (auto at = dot.find(part); at != std::string::npos; at = dot.find(part, at + 1)) ++n;
    return n;
  };
  const auto edges = [](const TaskGraph& graph) { return static_cast<int>(graph.edges.size()); };
  // Each edge of a loop once, with names that are the loop's own, and one to the next loop.
  CHECK(count(" -> l0_t") == edges(round));
  CHECK(count(" -> l1_t") == edges(step) + 1);
  CHECK(count("ltail=cluster_loop_0, lhead=cluster_loop_1") == 1);
  CHECK(count("label=\"left\"") == 2);
  CHECK(count("label=\"rank 1\"") == 2);
  CHECK(count("label=\"sums\", shape=ellipse") == 1);
}

TEST_CASE("while one task is held back, exactly what the picture puts behind it waits") {
  using namespace std::chrono_literals;
  for (const bool adaptive : {false, true}) {
    const TaskGraph graph = make_task_graph(one_exchange(adaptive), block(4, 1));
    const auto arrows = arrows_of(picture(graph));
    for (int held = 0; held < static_cast<int>(graph.stages.size()) * 4; ++held) {
      CAPTURE(graph.name(held));
      const auto waiting = after(arrows, held);
      std::set<std::pair<int, Step>> expected;
      for (int t = 0; t < graph.tasks(); ++t)
        for (Step step = 0; step < max_lead; ++step)
          // The first step's dt is known: its task does nothing then.
          if (!waiting.contains({t, step}) && !(graph.is_dt(t) && step == 0))
            expected.insert({t, step});

      std::mutex mutex;
      std::set<std::pair<int, Step>> done, done_meanwhile;
      const auto note = [&](int task, Step step) {
        const std::scoped_lock lock(mutex);
        done.insert({task, step});
      };
      const auto hold = [&] {
        const auto end = std::chrono::steady_clock::now() + 10s;
        bool all = false;
        while (!all && std::chrono::steady_clock::now() < end) {
          std::this_thread::sleep_for(100us);
          const std::scoped_lock lock(mutex);
          all = done.size() >= expected.size();
        }
        std::this_thread::sleep_for(2ms);  // time for what must not come
        const std::scoped_lock lock(mutex);
        done_meanwhile = done;
      };
      const auto executor =
          make_local_flow(graph,
                          {[&](int s, int p, Step step) {
                             const int task = graph.task(s, p);
                             if (task == held && step == 0) hold();
                             note(task, step);
                           },
                           [&](Step step) { note(graph.dt_task(), step); }, [](Step) {}},
                          3, true);
      CHECK(executor->run(0, max_lead) == max_lead);
      CHECK(done_meanwhile == expected);
    }
  }
}
