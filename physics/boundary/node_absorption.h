/// \file Nodes of a boundary that waves leave through: dashpots with the impedance of the material
/// behind them (Lysmer & Kuhlemeyer 1969), and springs that hold against a static load (Nguyen et
/// al., Kelvin-Voigt), as in CB-Geo MPM.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "physics/boundary/condition.h"

namespace lahar {

/// The traction on the boundary is -rho c v - k u in each direction, with c = a c_p and
/// k = rho c_p^2 / delta along the normal of the boundary, c = b c_s and k = rho c_s^2 / delta
/// along the others. v is the node's velocity; density rho, wave speeds and displacement u are the
/// means of the particles around the node.
struct NodeAbsorption {
  Index node;
  int normal;        ///< direction in which compression waves go
  double area;       ///< [m^2] of the boundary (2D: [m])
  double delta;      ///< [m] thickness of the layer whose stiffness the springs have
  double a, b;       ///< factors of the dashpots along the normal and the others
  double edge = 0;   ///< [m] of the cells; gives the area with the place of the node
  int position = 0;  ///< in `positions`

  static constexpr std::array<std::string_view, 3> positions{"corner", "edge", "face"};
  static constexpr std::string_view key = "absorbing_constraints";
  static constexpr std::string_view name = "an absorbing constraint";
  static constexpr std::string_view summary = "boundaries that waves leave through";
  static constexpr std::string_view help =
      "Dashpots and springs at a set of nodes: a boundary that waves leave through. The traction "
      "is -rho c v - rho c^2 u / delta. Along `dir` c is c_p, times `a` in the first term. In the "
      "other directions c is c_s, times `b` in the first term. v is the node's velocity. rho, c_p, "
      "c_s and the displacement u are means over the particles around the node. Densities and "
      "wave speeds are those of the materials at the beginning; of ModifiedCamClay and NorSand, "
      "whose stiffness follows the stress, speeds are those at the present stress. Fluids have no "
      "c_s. The area of a node follows from `h_min` and `position`. Several entries on a node add "
      "up. Within a step dashpots at most stop a node. They are weaker if its mass is too small "
      "for them.";
  static constexpr bool native = false;
  static constexpr Combine combine = Combine::all;
  static constexpr bool takes_means = true;
  static constexpr Direction<NodeAbsorption> direction{
      &NodeAbsorption::normal, "normal of the boundary, along which compression waves leave"};
  static constexpr auto parameters = std::to_array<Parameter<NodeAbsorption>>(
      {{"delta", "m",
        "the springs have the stiffness of a layer of this thickness; at least h_min / (2 a) and "
        "h_min / (2 b). A static stress s moves the boundary by s delta / (rho c^2)",
        &NodeAbsorption::delta, Bound::positive},
       {"h_min", "m", "edge length of the cells at the boundary", &NodeAbsorption::edge,
        Bound::positive},
       {"a", "-", "factor of the dashpots along dir", &NodeAbsorption::a, Bound::positive,
        Default{1}},
       {"b", "-", "factor of the dashpots in the other directions", &NodeAbsorption::b,
        Bound::positive, Default{1}},
       {"position",
        "position of the nodes on the boundary, which gives their area. 2D: h_min on an edge, half "
        "of it at the ends of an edge (corner). 3D: h_min^2 inside a face, half of it at the edges "
        "of a face, a quarter at its corners",
        &NodeAbsorption::position, positions}});

  std::vector<ConditionProblem> problems(int dim) const {
    std::vector<ConditionProblem> found;
    if (dim == 2 && positions[static_cast<std::size_t>(position)] == "face")
      found.push_back(
          {"position", "'position': \"face\" is for three dimensions",
           "in two dimensions nodes are at an edge, and the first and last at a corner"});
    const double least = edge / (2.0 * std::min(a, b));
    if (delta < least)
      found.push_back({"delta",
                       fmt::format("'delta' must be at least h_min / (2 a) and h_min / (2 b), {} m "
                                   "here, found {}",
                                   least, delta),
                       "springs are stiffer than the material in a thinner layer"});
    return found;
  }

  /// The area, by how many faces of cells, squares or cubes, meet at the node.
  void derive(int dim) {
    const std::string_view at = positions[static_cast<std::size_t>(position)];
    const double whole = at == "face" || (at == "edge" && dim == 2) ? 1.0 : 0.5;
    area = (at == "corner" && dim == 3 ? 0.25 : whole) * (dim == 2 ? edge : edge * edge);
  }

  template <int Dim>
  NodeAction<Dim> act(const NodeView<Dim>& at) const {
    NodeAction<Dim> action;
    const double rho = at.means.density;
    for (int d = 0; d < Dim; ++d) {
      const double c = d == normal ? at.means.compression : at.means.shear;
      action.dashpot[d] = area * rho * (d == normal ? a : b) * c;
      action.force[d] = -(area * rho * c * c / delta * at.means.displacement[d]);
    }
    return action;
  }
};

}  // namespace lahar
