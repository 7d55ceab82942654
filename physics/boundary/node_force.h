/// \file Concentrated forces on nodes.
#pragma once

#include <array>

#include "physics/boundary/condition.h"

namespace lahar {

struct NodeForce {
  Index node;
  int dir;
  double force;       ///< [N] (2D: per metre of thickness)
  int function = -1;  ///< index into Model::functions; -1 = constant

  static constexpr std::string_view key = "concentrated_nodal_forces";
  static constexpr std::string_view name = "a nodal force";
  static constexpr std::string_view summary = "forces on nodes: a list, or a single entry";
  static constexpr std::string_view help =
      "Force on each node of a set, or a `file` of lines `node dir force`. The last force for a "
      "node and direction wins, and so does the last function on a node.";
  static constexpr bool native = false;
  static constexpr bool is_load = true;  // in external_loading_conditions
  static constexpr Combine combine = Combine::all;
  static constexpr bool from_file = true;
  static constexpr Direction<NodeForce> direction{&NodeForce::dir};
  static constexpr auto parameters = std::to_array<Parameter<NodeForce>>(
      {{"force", "N", "force", &NodeForce::force, Bound::none}});
};

}  // namespace lahar
