// The condition under which a graph that counts messages, and not edges, is correct.
#include <doctest/doctest.h>

#include <map>
#include <set>

#include "tests/graph/step_graphs.h"

using namespace lahar;
using namespace lahar::test;

namespace {

/// Messages on each edge, at most `full`.
using Marking = std::vector<signed char>;
constexpr signed char full = 3;

/// Edges that hold two messages at once in some order of execution: by trying all orders.
std::set<int> overfull_edges(const TaskGraph& graph) {
  std::vector<std::vector<int>> in(static_cast<std::size_t>(graph.tasks()));
  Marking start;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    in[static_cast<std::size_t>(graph.edges[e].to)].push_back(static_cast<int>(e));
    start.push_back(static_cast<signed char>(graph.edges[e].lag));
  }
  std::set<int> overfull;
  std::set<Marking> seen{start};
  std::vector<Marking> todo{start};
  while (!todo.empty()) {
    const Marking marking = todo.back();
    todo.pop_back();
    for (std::size_t t = 0; t < in.size(); ++t) {
      const auto holds = [&](int e) { return marking[static_cast<std::size_t>(e)] > 0; };
      if (!std::all_of(in[t].begin(), in[t].end(), holds)) continue;
      Marking next = marking;
      for (const int e : in[t]) --next[static_cast<std::size_t>(e)];
      for (int e = graph.first_out[t]; e < graph.first_out[t + 1]; ++e) {
        auto& held = next[static_cast<std::size_t>(e)];
        held = std::min<signed char>(full, static_cast<signed char>(held + 1));
        if (held > 1) overfull.insert(e);
      }
      if (seen.insert(next).second) todo.push_back(next);
    }
  }
  return overfull;
}

std::set<int> reported(const TaskGraph& graph) {
  std::set<int> positions;
  for (const Edge& edge : unsafe_edges(graph))
    positions.insert(static_cast<int>(std::find(graph.edges.begin(), graph.edges.end(), edge) -
                                      graph.edges.begin()));
  return positions;
}

}  // namespace

TEST_CASE("a step with particles first and sums later is safe on any symmetric neighbourhood") {
  std::vector<Neighbours> all{block(5, 4), block(1, 1), block(7, 1), {{}, {}, {}}};
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
    all.push_back(irregular(14, 0.05 * static_cast<double>(seed), seed));
  for (const Neighbours& neighbours : all)
    for (const bool adaptive : {false, true}) {
      CHECK(unsafe_edges(make_task_graph(one_exchange(adaptive), neighbours)).empty());
      CHECK(unsafe_edges(make_task_graph(two_exchanges(adaptive), neighbours)).empty());
    }
}

TEST_CASE("one stage that is fed back from its neighbours is not safe: both may run ahead") {
  const TaskGraph graph = make_task_graph({{.name = "all", .exchange = "all"}}, block(5, 4));
  std::size_t exchanges = 0;
  for (const Edge& edge : graph.edges) exchanges += edge.exchange;
  const auto unsafe = unsafe_edges(graph);
  CHECK(unsafe.size() == exchanges);
  for (const Edge& edge : unsafe) CHECK(edge.exchange);
}

TEST_CASE("sums without the exchange of particles before them are overwritten: not safe") {
  auto stages = one_exchange();
  stages[0].exchange.clear();
  const auto unsafe = unsafe_edges(make_task_graph(stages, block(5, 4)));
  REQUIRE(!unsafe.empty());
  for (const Edge& edge : unsafe) {
    CHECK(edge.exchange);
    CHECK(edge.lag == 0);
  }
  // With the minimum for dt every patch waits for every other: nobody can overwrite.
  auto adaptive = one_exchange(true);
  adaptive[0].exchange.clear();
  adaptive[0].needs_dt = true;
  adaptive[1].needs_dt = false;
  CHECK(unsafe_edges(make_task_graph(adaptive, block(5, 4))).empty());
}

TEST_CASE("two neighbours that list each other on one side only are not safe") {
  CHECK(!unsafe_edges(make_task_graph(one_exchange(), {{1}, {}})).empty());
}

TEST_CASE("a circle of tasks that all wait for each other is reported") {
  const TaskGraph graph = make_task_graph({{.name = "a"}, {.name = "b"}}, {{}});
  REQUIRE(unsafe_edges(graph).empty());
  std::vector<Edge> edges = graph.edges;
  const Edge back{graph.task(1, 0), graph.task(0, 0), 0, false};
  edges.push_back(back);
  const auto unsafe = unsafe_edges(with_edges(graph, edges));
  CHECK(std::find(unsafe.begin(), unsafe.end(), back) != unsafe.end());
}

TEST_CASE("the unsafe edges are those that hold two messages in some order of execution") {
  const std::vector<std::vector<Stage>> lists{
      {{.name = "a", .exchange = "x"}},
      {{.name = "a"}, {.name = "b", .exchange = "x"}},
      {{.name = "a", .exchange = "x"}, {.name = "b"}},
      {{.name = "a", .exchange = "x"}, {.name = "b", .exchange = "y"}},
      {{.name = "a"}, {.name = "b", .exchange = "x"}, {.name = "c", .exchange = "y"}},
      {{.name = "a", .exchange = "x"},
       {.name = "b", .needs_dt = true},
       {.name = "c", .gives_dt = true}},
      {{.name = "a"},
       {.name = "b", .exchange = "x", .needs_dt = true},
       {.name = "c", .gives_dt = true}},
  };
  const std::vector<Neighbours> neighbourhoods{
      {{}}, {{1}, {0}}, {{1}, {0, 2}, {1}}, {{1, 2}, {0, 2}, {0, 1}}, {{1}, {0}, {}}};
  int unsafe_graphs = 0, safe_graphs = 0;
  for (const auto& stages : lists)
    for (const Neighbours& neighbours : neighbourhoods) {
      const TaskGraph graph = make_task_graph(stages, neighbours);
      const auto expected = overfull_edges(graph);
      CHECK(reported(graph) == expected);
      ++(expected.empty() ? safe_graphs : unsafe_graphs);
    }
  CHECK(unsafe_graphs > 5);
  CHECK(safe_graphs > 5);
}

TEST_CASE("rounds with one exchange are safe where a step has two of them") {
  for (const Neighbours& neighbours : {block(3, 2), irregular(7, 0.4, 3)})
    for (const auto& stages :
         {solver_round(), std::vector<Stage>{{.name = "a"}, {.name = "b", .exchange = "x"}},
          two_exchanges(true), std::vector<Stage>{{.name = "a"}}}) {
      CHECK(unsafe_edges(make_task_graph(stages, neighbours)).empty() ==
            (safe_rounds(stages) == 1));
      CHECK(
          unsafe_edges(make_task_graph(stages, neighbours, false, 0, safe_rounds(stages))).empty());
    }
}

TEST_CASE("the edges of a step follow from the stages: own order, neighbours, dt") {
  const TaskGraph graph = make_task_graph(one_exchange(true), {{1}, {0}, {}});
  CHECK(graph.has_dt);
  CHECK(graph.tasks() == 10);
  std::set<std::tuple<std::string, std::string, int>> edges;
  for (const Edge& e : graph.edges) edges.insert({graph.name(e.from), graph.name(e.to), e.lag});
  const std::set<std::tuple<std::string, std::string, int>> expected{
      {"P2G 0", "integrate 0", 0},    {"P2G 1", "integrate 1", 0},
      {"P2G 2", "integrate 2", 0},    {"P2G 1", "integrate 0", 0},
      {"P2G 0", "integrate 1", 0},    {"integrate 0", "locate 0", 0},
      {"integrate 1", "locate 1", 0}, {"integrate 2", "locate 2", 0},
      {"locate 0", "P2G 0", 1},       {"locate 1", "P2G 1", 1},
      {"locate 2", "P2G 2", 1},       {"locate 1", "P2G 0", 1},
      {"locate 0", "P2G 1", 1},       {"locate 0", "dt", 1},
      {"locate 1", "dt", 1},          {"locate 2", "dt", 1},
      {"dt", "integrate 0", 0},       {"dt", "integrate 1", 0},
      {"dt", "integrate 2", 0}};
  CHECK(edges == expected);
  CHECK(graph.edges.size() == expected.size());
}
