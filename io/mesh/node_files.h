/// \file Side files with a row for each of some nodes, which a team reads together: each member
/// gets the rows of the nodes that it keeps (directory_rank()), in the order of the file. All
/// functions are collective, and give nothing to any member if anything is wrong (reported).
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "io/base/side_files.h"
#include "io/base/team.h"
#include "physics/model/model.h"

namespace lahar {

/// What rows may name.
struct NodeRange {
  Index n_nodes;  ///< -1 = unknown
  int dim;        ///< number of directions; 0 = rows have none
};

/// Rows `node dir value`, or `node value`.
struct NodeValue {
  Index node;
  int dir;
  double value;
};
std::optional<std::vector<NodeValue>> read_node_values(const SideFile& file, std::string_view what,
                                                       const NodeRange& range, const Team& team,
                                                       ProblemList& problems);

/// What a friction's sign means, for messages.
inline constexpr const char* sign_hint =
    "the sign of the direction that points out of the body: -1 for a floor below it";

/// Rows `node dir sign_n friction`.
std::optional<std::vector<NodeFriction>> read_friction_file(const SideFile& file,
                                                            const NodeRange& range,
                                                            const Team& team,
                                                            ProblemList& problems);

/// Rows `node alpha beta [gamma]` in radians: in 2D the rotation by alpha + beta, in 3D
/// Rz(alpha) Rx(gamma) Rz(beta). A node occurs at most once.
template <int Dim>
std::optional<std::vector<NodeFrame<Dim>>> read_angle_file(const SideFile& file, Index n_nodes,
                                                           const Team& team, ProblemList& problems);

}  // namespace lahar
