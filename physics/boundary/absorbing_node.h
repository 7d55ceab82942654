/// \file Nodes of a boundary that waves leave through: dashpots with the impedance of the material
/// behind them (Lysmer & Kuhlemeyer 1969), and springs that hold against a static load (Nguyen et
/// al., Kelvin-Voigt), as in CB-Geo MPM.
#pragma once

#include <Eigen/Core>

#include "physics/base/types.h"

namespace lahar {

/// The traction on the boundary is -rho c v - k u in each direction, with c = a c_p and
/// k = rho c_p^2 / delta along the normal of the boundary, c = b c_s and k = rho c_s^2 / delta
/// along the others. v is the node's velocity; density rho, wave speeds and displacement u are the
/// means of the particles around the node, by mass. So nothing of a node outlives a step.
template <int Dim>
struct AbsorbingNode {
  using Components = Eigen::Matrix<double, Dim, 1, Eigen::DontAlign>;
  Local node = -1;
  int normal = 0;    ///< direction in which compression waves go
  double area = 0;   ///< [m^2] of the boundary (2D: [m])
  double delta = 1;  ///< [m] thickness of the layer whose stiffness the springs have
  double a = 1;      ///< factors of the dashpots along the normal
  double b = 1;      ///< and along the others

  // Of the present step.
  Components spring = Components::Zero();   ///< [N] area k u, against the displacement
  Components dashpot = Components::Zero();  ///< [N s/m] area rho c
  Components drag = Components::Zero();     ///< [N] dashpot times velocity, against it; at most
                                            ///< what stops the node in the step

  /// Spring and dashpot from the sums over the particles {m u} and {m c_p, m c_s, m rho, m}.
  void set(const double* displacement, const double* waves);
  /// No forces in this step.
  void release();
};

extern template struct AbsorbingNode<2>;
extern template struct AbsorbingNode<3>;

}  // namespace lahar
