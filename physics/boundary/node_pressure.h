/// \file Nodes at which the pressure of a liquid in pores is prescribed (two_phase.h).
#pragma once

#include <array>

#include "physics/boundary/condition.h"

namespace lahar {

struct NodePressure {
  Index node;
  double pressure;    ///< [Pa], positive in compression
  int function = -1;  ///< index into Model::functions; -1 = constant
  /// Not where water may leave the soil, at the beginning of a run. Only inside particles take
  /// what the pressure differs by from their mean: at a surface that is half a cell below it, and
  /// water outside presses on it.
  bool inside = true;

  static constexpr std::string_view key = "pressure_constraints";
  static constexpr std::string_view name = "a pressure constraint";
  static constexpr std::string_view summary = "prescribed pressures of the liquid in pores";
  static constexpr std::string_view help =
      "Prescribed pressure of the liquid in pores at a set of nodes, or a `file` of lines `node "
      "pressure`. Free surfaces have none without it. At the surface of soil it is that of water "
      "outside, which presses on the ground, too. The first entry for a node wins.";
  static constexpr bool native = false;
  static constexpr bool liquid = true;  // there must be one
  static constexpr Combine combine = Combine::first;
  static constexpr bool from_file = true;
  static constexpr auto parameters = std::to_array<Parameter<NodePressure>>(
      {{"pressure", "Pa", "pressure", &NodePressure::pressure, Bound::none}});
};

}  // namespace lahar
