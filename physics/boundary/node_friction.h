/// \file Nodes on rigid walls with friction. ConstrainedNode joins those of a node.
#pragma once

#include <array>

#include "physics/boundary/condition.h"

namespace lahar {

/// Coulomb friction of a node on a rigid wall. One two-sided wall per node, or one-sided ones along
/// different axes: of each the last.
struct NodeFriction {
  Index node;
  int normal;             ///< direction of the wall's normal, in the node's frame
  int outward;            ///< sign of the normal that points out of the body: 1 or -1
  double friction;        ///< coefficient [-]; infinite: no sliding while pressed
  bool two_sided = true;  ///< else it pushes and does not pull, at the node's prescribed velocity

  static constexpr std::string_view key = "friction_constraints";
  static constexpr std::string_view name = "a friction constraint";
  static constexpr std::string_view summary = "friction at nodes; a file name in older cases";
  static constexpr std::string_view help =
      "Coulomb friction of a set of nodes on a rigid wall, or a `file` of lines `node dir sign_n "
      "friction`. The wall pushes and does not pull. It stops material that moves into it, at the "
      "velocity that is prescribed along its normal (default 0). Friction is at most `friction` "
      "times that impulse. With `two_sided` the wall is as in CB-Geo MPM: a velocity constraint "
      "along the normal holds the node in both directions, and friction acts where the "
      "acceleration presses the node against the wall. The last entry for a node and direction "
      "wins.";
  static constexpr bool native = false;
  static constexpr Combine combine = Combine::all;  // warnings ask for every entry
  static constexpr bool from_file = true, older_file_form = true;
  static constexpr Direction<NodeFriction> direction{&NodeFriction::normal,
                                                     "normal direction in the node's frame"};
  static constexpr auto parameters = std::to_array<Parameter<NodeFriction>>(
      {{"sign_n", "sign of the direction that points out of the body: -1 for a floor below it",
        &NodeFriction::outward},
       {"friction", "-", "friction coefficient", &NodeFriction::friction, Bound::not_negative},
       {"two_sided",
        "the wall also pulls, as in CB-Geo MPM; default false, with the preset cbgeo true",
        &NodeFriction::two_sided, of_preset}});
};

}  // namespace lahar
