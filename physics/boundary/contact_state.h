/// \file What a patch knows of contact during a step: bodies that meet, and what they did.
#pragma once

#include <vector>

#include "physics/base/types.h"
#include "physics/boundary/node_impulse.h"

namespace lahar {

/// Two bodies at a node that both have (contact.h).
template <int Dim>
struct Meeting {
  Local a = -1, b = -1;                ///< local nodes, one of each body
  Vec<Dim> normal = Vec<Dim>::Zero();  ///< points from a to b
  double gap = 0;        ///< [m] between them along the normal; negative: they overlap
  bool pressed = false;  ///< an impulse acted between them in this step
  bool stuck = false;    ///< and friction was enough to hold them
};

/// State of one step: nothing here outlives it.
template <int Dim>
struct ContactState {
  std::vector<char> between_bodies;    ///< by node of the first body: several have a surface there
  std::vector<Meeting<Dim>> meetings;  ///< ascending nodes of the first body
  /// Velocity of a body that others pressed at a node; in the order of meetings.
  struct Touched {
    Local node;
    NodeImpulse<Dim> by;  ///< by contact
    Vec<Dim> rubbed;      ///< [m/s] part of its change that is by friction
  };
  std::vector<Touched> touched;
  std::vector<Vec<Dim>> wall_change;  ///< [m/s] by Patch::walls: what their impulses did
};

}  // namespace lahar
