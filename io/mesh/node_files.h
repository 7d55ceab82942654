/// \file Side files with a row for each of some nodes, which a team reads together: each member
/// gets the rows of the nodes that it keeps (directory_rank()), in the order of the file. All
/// functions are collective, and give nothing to any member if anything is wrong (reported).
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/base/side_files.h"
#include "io/base/team.h"
#include "physics/model/model.h"

namespace lahar {

/// What rows may name.
struct NodeRowRange {
  Index n_nodes;  ///< -1 = unknown
  int dim;        ///< number of directions; 0 = rows have none
};

/// A number in a row.
struct NodeColumn {
  std::string what;  ///< names it in messages
  Bound bound = Bound::none;
  bool is_sign = false;   ///< 1 or -1
  std::string hint = "";  ///< of a sign
};

/// Row `node dir value ...`, or `node value ...`.
struct NodeRow {
  static constexpr std::size_t most_values = 4;
  Index node;
  int dir;
  std::array<double, most_values> values;
};
std::optional<std::vector<NodeRow>> read_node_rows(const SideFile& file,
                                                   const std::vector<NodeColumn>& columns,
                                                   const NodeRowRange& range, const Team& team,
                                                   ProblemList& problems);

/// Rows `node alpha beta [gamma]` in radians: in 2D the rotation by alpha + beta, in 3D
/// Rz(alpha) Rx(gamma) Rz(beta). A node occurs at most once.
template <int Dim>
std::optional<std::vector<NodeFrame<Dim>>> read_angle_file(const SideFile& file, Index n_nodes,
                                                           const Team& team, ProblemList& problems);

}  // namespace lahar
