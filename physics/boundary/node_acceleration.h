/// \file Nodes whose acceleration is prescribed, such as those of a base that an earthquake shakes.
/// ConstrainedNode accelerates them.
#pragma once

#include <array>

#include "physics/boundary/node_velocity.h"

namespace lahar {

/// Prescribed acceleration component of a node, in its frame.
struct NodeAcceleration {
  Index node;
  int dir;
  double acceleration;  ///< [m/s^2]
  int function = -1;    ///< index into Model::functions; -1 = constant

  static constexpr std::string_view key = "acceleration_constraints";
  static constexpr std::string_view name = "an acceleration constraint";
  static constexpr std::string_view summary = "prescribed nodal accelerations";
  static constexpr std::string_view help =
      "A prescribed acceleration component of a set of nodes, in their frame, for example at the "
      "base in an earthquake; or a `file` of lines `node dir acceleration` (dialect of the fork). "
      "Nodes have the velocity that is its integral from rest. With preset cbgeo it changes the "
      "velocity that particles around them have in the mean, which lags. "
      "The last entry for a node and direction wins. A prescribed velocity in the same direction "
      "is an error.";
  static constexpr bool native = false;
  static constexpr Combine combine = Combine::last;
  static constexpr bool from_file = true;
  static constexpr std::string_view constant_in_files = "accelerations of a file are constant";
  using Excludes = NodeVelocity;
  static constexpr std::string_view excluded = "a prescribed velocity";
  static constexpr Direction<NodeAcceleration> direction{&NodeAcceleration::dir};
  static constexpr auto parameters = std::to_array<Parameter<NodeAcceleration>>(
      {{"acceleration", "m/s^2", "acceleration", &NodeAcceleration::acceleration, Bound::none}});
};

}  // namespace lahar
