#include "graph/task_graph.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <numeric>

namespace lahar {

std::vector<Phase> phases_of(const std::vector<Stage>& stages, bool cut) {
  bool adaptive = false;  // as in make_task_graph: without a stage that gives dt, dt is constant
  for (const Stage& stage : stages) adaptive = adaptive || stage.gives_dt;
  std::vector<Phase> phases;
  for (std::size_t s = 0; s < stages.size(); ++s) {
    const Stage& stage = stages[s];
    if (phases.empty() || !stage.exchange.empty() || (adaptive && stage.needs_dt)) {
      phases.push_back({stage, s, s + 1});
      continue;
    }
    if (cut && stages[s - 1].gives_dt) {
      phases.push_back({stage, s, s + 1});
      phases.back().task.is_rest = true;
      continue;
    }
    Phase& phase = phases.back();
    phase.last = phase.begins = s + 1;
    phase.task.name += ", " + stage.name;
    phase.task.gives_dt = phase.task.gives_dt || stage.gives_dt;
    phase.task.needs_dt = phase.task.needs_dt || stage.needs_dt;
  }
  for (std::size_t f = 1; f < phases.size(); ++f)
    if (phases[f].task.is_rest) {
      phases[f - 1].begins = phases[f].last;
      phases[f - 1].ends = phases[f - 1].last;
      phases[f].begins = phases[f].first;
      phases[f].ends = phases[f - 1].first;
    }
  return phases;
}

Phase joined(const Phase& phase, const Phase& rest) {
  Phase both{phase.task, phase.first, rest.last};
  both.task.name += ", " + rest.task.name;
  return both;
}

std::vector<Stage> tasks_of(const std::vector<Phase>& phases) {
  std::vector<Stage> tasks;
  for (const Phase& phase : phases) tasks.push_back(phase.task);
  return tasks;
}

std::string TaskGraph::name(int task) const {
  if (is_dt(task)) return "dt";
  if (collects_dt(task)) return "collect dt";
  return fmt::format("{} {}", stages[static_cast<std::size_t>(stage_of(task))].name,
                     patch_of(task));
}

namespace {

void add_stage_edges(const TaskGraph& graph, int stage,
                     const std::vector<std::vector<int>>& neighbours, std::vector<Edge>& edges) {
  const int n_stages = static_cast<int>(graph.stages.size());
  const bool first = stage == 0;
  const int before = first ? n_stages - 1 : stage - 1;
  const int lag = first ? 1 : 0;
  for (int p = 0; p < graph.own_patches(); ++p) {
    edges.push_back({graph.task(before, p), graph.task(stage, p), lag, false});
    if (graph.stages[static_cast<std::size_t>(stage)].exchange.empty()) continue;
    for (const int q : neighbours[static_cast<std::size_t>(p)])
      edges.push_back({graph.task(before, q), graph.task(stage, p), lag, true});
  }
}

void add_dt_edges(const TaskGraph& graph, std::vector<Edge>& edges) {
  for (int s = 0; s < static_cast<int>(graph.stages.size()); ++s) {
    const int round = s / graph.stages_per_round();
    const int next = (round + 1) % graph.rounds;
    const int collect = graph.shared ? graph.collect_dt_task(next) : graph.dt_task(next);
    const int lag = next == 0 ? 1 : 0;
    for (int p = 0; p < graph.own_patches(); ++p) {
      const Stage& stage = graph.stages[static_cast<std::size_t>(s)];
      if (stage.gives_dt) edges.push_back({graph.task(s, p), collect, lag, true});
      if (stage.needs_dt) edges.push_back({graph.dt_task(round), graph.task(s, p), 0, true});
    }
  }
  for (int round = 0; graph.shared && round < graph.rounds; ++round) {  // also without patches
    const int next = (round + 1) % graph.rounds;
    edges.push_back({graph.dt_task(round), graph.collect_dt_task(next), next == 0 ? 1 : 0, true});
  }
}

}  // namespace

TaskGraph make_task_graph(std::vector<Stage> stages,
                          const std::vector<std::vector<int>>& neighbours, bool shared,
                          int elsewhere, int rounds) {
  TaskGraph graph;
  for (int round = 0; round < rounds; ++round)
    graph.stages.insert(graph.stages.end(), stages.begin(), stages.end());
  graph.rounds = rounds;
  graph.patches = static_cast<int>(neighbours.size());
  graph.elsewhere = elsewhere;
  graph.shared = shared;
  bool gives = false, needs = false;
  for (const Stage& stage : graph.stages) {
    gives = gives || stage.gives_dt;
    needs = needs || stage.needs_dt;
  }
  graph.has_dt = gives && needs;
  std::vector<Edge> edges;
  for (int s = 0; s < static_cast<int>(graph.stages.size()); ++s)
    add_stage_edges(graph, s, neighbours, edges);
  if (graph.has_dt) add_dt_edges(graph, edges);
  return with_edges(std::move(graph), std::move(edges));
}

int safe_rounds(const std::vector<Stage>& stages) {
  const auto exchanges = std::count_if(stages.begin(), stages.end(),
                                       [](const Stage& stage) { return !stage.exchange.empty(); });
  return exchanges == 1 ? 2 : 1;
}

TaskGraph with_edges(TaskGraph graph, std::vector<Edge> edges) {
  std::stable_sort(edges.begin(), edges.end(),
                   [](const Edge& a, const Edge& b) { return a.from < b.from; });
  const auto n = static_cast<std::size_t>(graph.tasks());
  graph.first_out.assign(n + 1, 0);
  graph.in_step.assign(n, 0);
  graph.in_lag.assign(n, 0);
  for (const Edge& edge : edges) {
    ++graph.first_out[static_cast<std::size_t>(edge.from) + 1];
    ++(edge.lag == 0 ? graph.in_step : graph.in_lag)[static_cast<std::size_t>(edge.to)];
  }
  std::partial_sum(graph.first_out.begin(), graph.first_out.end(), graph.first_out.begin());
  graph.edges = std::move(edges);
  return graph;
}

namespace {

/// Fewest tokens on a path from `from` to every task (edges weigh their lag: 0 or 1).
std::vector<int> fewest_tokens(const TaskGraph& graph, int from) {
  std::vector<int> tokens(static_cast<std::size_t>(graph.tasks()), std::numeric_limits<int>::max());
  std::deque<int> queue{from};
  tokens[static_cast<std::size_t>(from)] = 0;
  while (!queue.empty()) {
    const int task = queue.front();
    queue.pop_front();
    for (const Edge& edge : graph.out(task)) {
      const int via = tokens[static_cast<std::size_t>(task)] + edge.lag;
      if (via >= tokens[static_cast<std::size_t>(edge.to)]) continue;
      tokens[static_cast<std::size_t>(edge.to)] = via;
      if (edge.lag == 0)
        queue.push_front(edge.to);
      else
        queue.push_back(edge.to);
    }
  }
  return tokens;
}

}  // namespace

std::vector<Edge> unsafe_edges(const TaskGraph& graph) {
  std::vector<Edge> unsafe;
  for (int to = 0; to < graph.tasks(); ++to) {
    const std::vector<int> tokens = fewest_tokens(graph, to);
    for (const Edge& edge : graph.edges) {
      if (edge.to != to) continue;
      const int back = tokens[static_cast<std::size_t>(edge.from)];
      // One token on the cheapest cycle through the edge; none would be a deadlock, more would
      // let a fast predecessor deliver twice before its successor fires.
      if (back == std::numeric_limits<int>::max() || back + edge.lag != 1) unsafe.push_back(edge);
    }
  }
  return unsafe;
}

}  // namespace lahar
