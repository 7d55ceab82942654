/// \file What a boundary condition of nodes says of itself, what it sees of its node in a step, and
/// what it does there. conditions.h lists the conditions.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

#include "physics/base/parameter.h"
#include "physics/base/types.h"

namespace lahar {

/// A vector of a node that structs may hold in any container.
template <int Dim>
using NodeComponents = Eigen::Matrix<double, Dim, 1, Eigen::DontAlign>;

/// Which of several entries for a node and direction act.
enum class Combine { all, first, last };

/// The member of a condition that is set by the key `dir`.
template <class Condition>
struct Direction {
  int Condition::*member;
  std::string_view help = "direction";
};

/// A condition of a liquid in pores, too: directions from the dimension on are the liquid's.
template <class T>
inline constexpr bool has_phases = false;
template <class T>
requires T::phases inline constexpr bool has_phases<T> = true;

/// Values that do not go together.
struct ConditionProblem {
  std::string_view key;  ///< to which the message belongs
  std::string message, hint = "";
};

/// Means by mass of the particles around a node. So nothing of a node outlives a step.
template <int Dim>
struct NodeMeans {
  double mass = 0;                    ///< [kg] of these particles; 0: none
  double density = 0;                 ///< [kg/m^3] of their materials at the beginning
  double compression = 0, shear = 0;  ///< [m/s] speeds of waves in them at the beginning
  NodeComponents<Dim> displacement = NodeComponents<Dim>::Zero();  ///< [m]
};

/// What a condition sees of its node, before the node's velocity is integrated.
template <int Dim>
struct NodeView {
  double mass;                  ///< [kg] above 0
  Vec<Dim> position;            ///< [m]
  Vec<Dim> velocity;            ///< [m/s] at the beginning of the step
  const NodeMeans<Dim>& means;  ///< of conditions with `takes_means`
  double time, dt;              ///< [s] beginning and length of the step
  double factor;                ///< function of time at `time`; 1 without one
};

/// What a condition does to its node in a step. Where several act on a node, forces and dashpots
/// add up. Together dashpots take at most what stops the node in the step: a dashpot that turned a
/// light node back would shake it more and more.
template <int Dim>
struct NodeAction {
  NodeComponents<Dim> force = NodeComponents<Dim>::Zero();    ///< [N]; does external work
  NodeComponents<Dim> dashpot = NodeComponents<Dim>::Zero();  ///< [N s/m]; its work is damping
};

}  // namespace lahar
