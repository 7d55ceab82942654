#include "physics/model/model_strength.h"

#include <algorithm>
#include <cmath>

#include "physics/materials/strength.h"

namespace lahar {

namespace {

bool is_finite_strength(double value) {
  return value > 0 && std::isfinite(value);
}

}  // namespace

template <int Dim>
bool can_be_divided(const RigidBody<Dim>& body) {
  return is_finite_strength(body.friction) || is_finite_strength(body.cohesion);
}

template <int Dim>
StrengthOfModel strength_of(const Model<Dim>& model) {
  StrengthOfModel has;
  has.materials = std::ranges::any_of(
      model.materials, [](Material material) { return reduce_strength(material.law, 2.0); });
  has.rigid_bodies = std::ranges::any_of(
      model.rigid_bodies, [](const RigidBody<Dim>& body) { return can_be_divided(body); });
  has.walls = std::ranges::any_of(entries_of<NodeFriction>(model), [](const NodeFriction& wall) {
    return is_finite_strength(wall.friction);
  });
  const Contact& contact = model.analysis.contact;
  has.contact = contact.bodies > 1 && is_finite_strength(contact.friction);
  return has;
}

template <int Dim>
StrengthOfModel reduce_strength(Model<Dim>& model, double factor) {
  const StrengthOfModel divided = strength_of(model);
  for (Material& material : model.materials) reduce_strength(material.law, factor);
  for (RigidBody<Dim>& body : model.rigid_bodies) {
    body.friction /= factor;
    body.cohesion /= factor;
  }
  for (RigidBody<Dim>& side : model.sides) side.friction /= factor;
  for (NodeFriction& wall : entries_of<NodeFriction>(model)) wall.friction /= factor;
  model.analysis.contact.friction /= factor;
  return divided;
}

#define LAHAR_INSTANTIATE(Dim)                                  \
  template bool can_be_divided<Dim>(const RigidBody<Dim>&);     \
  template StrengthOfModel strength_of<Dim>(const Model<Dim>&); \
  template StrengthOfModel reduce_strength<Dim>(Model<Dim>&, double);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
