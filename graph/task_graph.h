/// \file The tasks and edges of one timestep, derived from the list of stages.
///
///     stage        patch p             patch q (neighbour)
///     P2G          (p)                 (q)
///                   |  \            /  |
///                   |   mass, momentum |
///     integrate    (p)                 (q)
///                   |                  |
///     locate       (p)                 (q)
///                   .  particles, to the next step's P2G
///
#pragma once

#include <span>
#include <string>
#include <vector>

#include "graph/stage.h"

namespace lahar {

/// An edge of the step graph. lag 0: within a step; lag 1: from one step to the next.
struct Edge {
  int from, to;
  int lag;
  bool exchange;  ///< crosses patches
  bool operator==(const Edge&) const = default;
};

/// Tasks are numbered stage-major: stage * patches + patch; then the dt task where there is one.
///
/// A step may consist of several rounds: its stages are the same so many times, and each round has
/// a dt of its own, which the round before gives. Rounds with one exchange need two in a step: a
/// patch may begin a round before its neighbours have done what they take from the round before, so
/// that messages of both are on their way (unsafe_edges()).
///
/// With several ranks the graph is one rank's share. Patches of others that its own exchange with
/// are columns of it as well, the last ones: a task of theirs has no edge into it and fires when
/// its message arrives. That no message overtakes what it has to wait for follows from the graph as
/// a whole, whose edges are those of all shares. dt is then agreed on: a task collects it from the
/// rank's own patches, and the dt task fires when all ranks have agreed.
struct TaskGraph {
  std::vector<Stage> stages;
  int rounds = 1;       ///< in a step; `stages` has those of all of them
  int patches = 0;      ///< columns, those of other ranks included
  int elsewhere = 0;    ///< columns that are patches of other ranks
  bool shared = false;  ///< one rank's share of a graph
  bool has_dt = false;
  std::vector<Edge> edges;           ///< by the task that they leave
  std::vector<int> first_out;        ///< edges of task t: [first_out[t], first_out[t + 1])
  std::vector<int> in_step, in_lag;  ///< number of lag-0 and lag-1 edges into each task

  int tasks() const { return stage_tasks() + (has_dt ? rounds * tasks_per_dt() : 0); }
  int own_patches() const { return patches - elsewhere; }
  int task(int stage, int patch) const { return stage * patches + patch; }
  /// Whether the next stage is the rest of this one.
  bool has_rest(int stage) const {
    const auto next = static_cast<std::size_t>(stage) + 1;
    return next < stages.size() && stages[next].is_rest;
  }
  int dt_task(int round = 0) const { return stage_tasks() + (round + 1) * tasks_per_dt() - 1; }
  bool is_dt(int task) const { return is_global(task) && task == dt_task(round_of(task)); }
  int collect_dt_task(int round = 0) const { return dt_task(round) - 1; }  ///< shared graphs only
  bool collects_dt(int task) const { return is_global(task) && !is_dt(task); }
  bool is_global(int task) const { return task >= stage_tasks(); }
  /// The round, within a step, whose dt a global task collects or sets.
  int round_of(int task) const { return (task - stage_tasks()) / tasks_per_dt(); }
  /// The round, of all that are taken, in which a stage or a dt of a step is.
  Step round_at(Step step, int round) const { return step * rounds + round; }
  int stages_per_round() const { return static_cast<int>(stages.size()) / rounds; }
  bool is_elsewhere(int task) const { return !is_global(task) && patch_of(task) >= own_patches(); }
  int stage_of(int task) const { return task / patches; }
  int patch_of(int task) const { return task % patches; }
  std::span<const Edge> out(int task) const {
    const auto t = static_cast<std::size_t>(task);
    return std::span(edges).subspan(static_cast<std::size_t>(first_out[t]),
                                    static_cast<std::size_t>(first_out[t + 1] - first_out[t]));
  }
  std::string name(int task) const;

 private:
  int stage_tasks() const { return static_cast<int>(stages.size()) * patches; }
  int tasks_per_dt() const { return shared ? 2 : 1; }
};

/// The graph of any edges, which it sorts; `graph` has stages, patches and the dt task already.
TaskGraph with_edges(TaskGraph graph, std::vector<Edge> edges);

/// Build the step graph. `neighbours[p]` lists the patches that p exchanges with (symmetric,
/// without p). The dt task exists if some stage gives and some stage needs dt. `shared`: one rank's
/// share, in which the last `elsewhere` of the patches are those of others; their neighbours are
/// not looked at. `rounds`: the stages are those of a round, and a step has so many.
TaskGraph make_task_graph(std::vector<Stage> stages,
                          const std::vector<std::vector<int>>& neighbours, bool shared = false,
                          int elsewhere = 0, int rounds = 1);

/// How many rounds of these stages a step must have so that its graph is safe (unsafe_edges()).
int safe_rounds(const std::vector<Stage>& stages);

/// The condition under which a cyclic graph of message-counting nodes is correct: a safe marked
/// graph, every edge on a cycle that holds exactly one token (lag-1 edges hold one, lag-0 none),
/// and live, no cycle without a token. Returns the edges that violate it (empty = correct).
std::vector<Edge> unsafe_edges(const TaskGraph& graph);

}  // namespace lahar
