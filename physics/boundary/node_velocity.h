/// \file Nodes whose velocity is prescribed. ConstrainedNode holds them, or Patch::fixed.
#pragma once

#include <array>

#include "physics/boundary/condition.h"

namespace lahar {

/// Prescribed velocity component of a node, in its frame; or of the liquid in pores there.
struct NodeVelocity {
  Index node;
  int dir;
  double velocity;    ///< [m/s]
  int function = -1;  ///< index into Model::functions, a factor over time; -1 = constant

  static constexpr std::string_view key = "velocity_constraints";
  static constexpr std::string_view name = "a velocity constraint";
  static constexpr std::string_view summary =
      "prescribed nodal velocities; a file name in older cases";
  static constexpr std::string_view help =
      "A prescribed velocity component of a set of nodes, or a `file` of lines `node dir "
      "velocity`. Entries on the same node combine. The first entry for a node and direction wins. "
      "With a function of time nodes move by its value in the middle of each step, with one that "
      "has \"derivative\" exactly as its values say.";
  static constexpr bool native = false;
  static constexpr Combine combine = Combine::first;
  static constexpr bool from_file = true, older_file_form = true;
  static constexpr bool phases = true;
  static constexpr Direction<NodeVelocity> direction{
      &NodeVelocity::dir, "direction; from the dimension on, that of the liquid in pores"};
  static constexpr auto parameters = std::to_array<Parameter<NodeVelocity>>(
      {{"velocity", "m/s", "velocity", &NodeVelocity::velocity, Bound::none}});
};

}  // namespace lahar
