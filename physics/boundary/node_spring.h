/// \file Nodes on an elastic foundation (Winkler 1867): springs and dashpots to the ground.
#pragma once

#include <algorithm>
#include <array>

#include "physics/boundary/condition.h"

namespace lahar {

/// The force on the node is -k u - c v along one direction: u is the mean displacement of the
/// particles around the node since the beginning, v its velocity.
struct NodeSpring {
  Index node;
  int dir;
  double stiffness;  ///< [N/m] (2D: per metre of thickness)
  double damping;    ///< [N s/m] (2D: per metre of thickness)

  static constexpr std::string_view key = "spring_constraints";
  static constexpr std::string_view name = "a spring constraint";
  static constexpr std::string_view summary = "elastic foundations: springs and dashpots at nodes";
  static constexpr std::string_view help =
      "An elastic foundation (Winkler springs with dashpots) at a set of nodes. The force on each "
      "node along `dir` is -stiffness u - damping v. u is the mean displacement of the particles "
      "around the node since the beginning, v is the velocity of the node. A subgrade of modulus k "
      "[Pa/m] gives a node the stiffness k times its area. In 2D both are per metre of thickness. "
      "Several entries on a node add up. A spring is weaker where the mass of a node is below "
      "stiffness dt^2, and dashpots at most stop a node within a step.";
  static constexpr bool native = true;
  static constexpr Combine combine = Combine::all;
  static constexpr bool takes_means = true;
  static constexpr Direction<NodeSpring> direction{&NodeSpring::dir,
                                                   "direction of the springs, along an axis"};
  static constexpr auto parameters = std::to_array<Parameter<NodeSpring>>(
      {{"stiffness", "N/m", "stiffness of the spring at each node", &NodeSpring::stiffness,
        Bound::not_negative},
       {"damping", "N s/m", "constant of the dashpot at each node", &NodeSpring::damping,
        Bound::not_negative, Default{0}}});

  /// A spring with k dt^2 > 4 m is unstable with explicit steps.
  template <int Dim>
  NodeAction<Dim> act(const NodeView<Dim>& at) const {
    NodeAction<Dim> action;
    const double k = std::min(stiffness, at.mass / (at.dt * at.dt));
    action.force[dir] = -k * at.means.displacement[dir];
    action.dashpot[dir] = damping;
    return action;
  }
};

}  // namespace lahar
