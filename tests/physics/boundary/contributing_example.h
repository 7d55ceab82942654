/// \file Nodes that move through a fluid at rest, such as water around a body.
#pragma once

#include <array>

#include "physics/boundary/condition.h"

namespace lahar {

/// The force on the node is -c |v| v, v is its velocity.
struct NodeDrag {
  Index node;
  double coefficient;  ///< [kg/m] c

  static constexpr std::string_view key = "drag_constraints";  // in mesh.boundary_conditions
  static constexpr std::string_view name = "a drag constraint";
  static constexpr std::string_view summary = "nodes that a fluid at rest brakes";
  static constexpr std::string_view help =
      "A fluid at rest brakes a set of nodes. The force on each is -coefficient |v| v.";
  static constexpr bool native = true;  // CB-Geo MPM does not have it
  static constexpr Combine combine = Combine::all;
  static constexpr auto parameters = std::to_array<Parameter<NodeDrag>>({
      {"coefficient", "kg/m", "half the fluid's density, times drag coefficient and area of a node",
       &NodeDrag::coefficient, Bound::not_negative},
  });

  template <int Dim>
  NodeAction<Dim> act(const NodeView<Dim>& at) const {
    NodeAction<Dim> action;
    for (int d = 0; d < Dim; ++d) action.dashpot[d] = coefficient * at.velocity.norm();
    return action;
  }
};

}  // namespace lahar
