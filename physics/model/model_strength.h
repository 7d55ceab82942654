/// \file The strength of a whole model, reduced by a factor: of materials, and of what they touch.
#pragma once

#include "physics/model/model.h"

namespace lahar {

/// What has a strength that can be divided. Friction that is infinite does not count: it stays.
struct StrengthOfModel {
  bool materials = false;     ///< laws (reduce_strength())
  bool rigid_bodies = false;  ///< friction or cohesion of rigid bodies
  bool walls = false;         ///< friction of nodes of this process
  bool contact = false;       ///< friction between bodies in contact
  bool any() const { return materials || rigid_bodies || walls || contact; }
};

/// Divide the strength of materials, and friction (the tangent of an angle) and cohesion of rigid
/// bodies, walls, and bodies in contact. Returns what was divided.
template <int Dim>
StrengthOfModel reduce_strength(Model<Dim>& model, double factor);

/// Whether friction or cohesion of a rigid body can be divided.
template <int Dim>
bool can_be_divided(const RigidBody<Dim>& body);

/// What reduce_strength() would divide.
template <int Dim>
StrengthOfModel strength_of(const Model<Dim>& model);

}  // namespace lahar
