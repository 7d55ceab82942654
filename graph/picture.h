/// \file Pictures of task graphs, as text for Graphviz.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "graph/task_graph.h"

namespace lahar {

/// Patches of a picture: a label of each and, where patches of a rank are framed together, its
/// rank.
struct PicturePatches {
  std::vector<std::string> names;
  std::vector<int> ranks = {};
};

/// A graph that is drained before another one begins.
struct PictureLoop {
  std::string name, taken;  ///< as of StageLoop
  TaskGraph graph;          ///< of one turn
};

/// The graph of a step; lag-1 edges dashed.
std::string to_dot(const TaskGraph& graph, const PicturePatches& patches, const std::string& title);
/// The loops of a step, in the order in which a step takes them; each framed.
std::string to_dot(const std::vector<PictureLoop>& loops, const PicturePatches& patches,
                   const std::string& title);

}  // namespace lahar
