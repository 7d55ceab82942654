/// \file What a patch knows of contact during a step: bodies that meet, and what they did.
#pragma once

#include <array>
#include <vector>

#include "physics/base/node_vector.h"
#include "physics/base/types.h"
#include "physics/boundary/node_impulse.h"

namespace lahar {

/// The directions at a node along which bodies may meet (contact_surface.h), at most as many as a
/// vector of sums has places: normals of the bodies, then what they make two at a time, where there
/// is room.
template <int Dim>
struct SurfaceDirections {
  template <class Value>
  using Each = std::array<Value, node_width>;
  alignas(32) std::array<Each<double>, Dim> normal{};  ///< by component; points out of body `from`
  Each<int> from{};
  Each<int> to{};  ///< into this body; -1 = any other
  int count = 0;

  void add(const Vec<Dim>& n, int out_of, int into) {
    if (count == node_width) return;
    const auto k = static_cast<std::size_t>(count++);
    for (int d = 0; d < Dim; ++d) normal[static_cast<std::size_t>(d)][k] = n[d];
    from[k] = out_of;
    to[k] = into;
  }
  Vec<Dim> at(int k) const {
    Vec<Dim> n;
    for (int d = 0; d < Dim; ++d)
      n[d] = normal[static_cast<std::size_t>(d)][static_cast<std::size_t>(k)];
    return n;
  }
  /// 1 where a direction points out of the body, -1 where it points into it, 0 where the body meets
  /// no other along it.
  double sign(int k, int body) const {
    const auto i = static_cast<std::size_t>(k);
    if (from[i] == body) return 1.0;
    return to[i] < 0 || to[i] == body ? -1.0 : 0.0;
  }
};

/// A node, of the first body, where several have mass.
template <int Dim>
struct NodeBetween {
  Local node;
  SurfaceDirections<Dim> directions;
};

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
  std::vector<NodeBetween<Dim>> nodes_between;  ///< ascending
  std::vector<int> between;            ///< by node of the first body, its number there; -1 = none
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
