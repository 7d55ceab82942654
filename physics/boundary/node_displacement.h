/// \file Nodes whose displacement is prescribed in implicit steps. Patch::fixed_displacement holds
/// them.
#pragma once

#include <array>

#include "physics/boundary/node_velocity.h"

namespace lahar {

/// Prescribed displacement component of a node in each step: `displacement` times the function at
/// the beginning of the step. It is not the sum since the start. So it is in the fork of CB-Geo
/// MPM, which adds it in every iteration of Newton's method.
struct NodeDisplacement {
  Index node;
  int dir;
  double displacement;  ///< [m] of a step
  int function = -1;    ///< index into Model::functions; -1 = constant

  static constexpr std::string_view key = "displacement_constraints";
  static constexpr std::string_view name = "a displacement constraint";
  static constexpr std::string_view summary = "prescribed nodal displacements of implicit steps";
  static constexpr std::string_view help =
      "A prescribed displacement component of a set of nodes in each step of an implicit analysis, "
      "or a `file` of lines `node dir displacement` (dialect of the fork). It is the displacement "
      "of one step, not the sum since the start, and half the step needs half the value. 0 holds "
      "the nodes. The function of time is taken at the beginning of the step. The first entry for "
      "a node and direction wins. A prescribed velocity in the same direction is an error.";
  static constexpr bool native = false;
  static constexpr Combine combine = Combine::first;
  static constexpr bool from_file = true;
  static constexpr std::string_view constant_in_files = "displacements of a file are constant";
  using Excludes = NodeVelocity;
  static constexpr std::string_view excluded = "a prescribed velocity";
  static constexpr Direction<NodeDisplacement> direction{&NodeDisplacement::dir};
  static constexpr auto parameters =
      std::to_array<Parameter<NodeDisplacement>>({{"displacement", "m", "displacement in each step",
                                                   &NodeDisplacement::displacement, Bound::none}});
};

}  // namespace lahar
