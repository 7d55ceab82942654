// Every copy of a node runs this very code, so that all are equal to the last bit.
#include "physics/contact.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace lahar {

template <int Dim>
void repeat_for_bodies(PatchTopology<Dim>& topology, int bodies, Index mesh_nodes) {
  const std::size_t cells = topology.cells.size(), nodes = topology.nodes.size(),
                    support = topology.support_nodes.size(),
                    border = topology.support_border.size(),
                    follows = topology.support_follows.size();
  for (int b = 1; b < bodies; ++b) {
    const auto shift = static_cast<Local>(static_cast<std::size_t>(b) * nodes);
    for (std::size_t c = 0; c < cells; ++c) {
      topology.cells.push_back(topology.cells[c]);
      if (topology.corner_nodes.empty()) continue;  // not of multilinear elements
      auto& corner = topology.corner_nodes.emplace_back(topology.corner_nodes[c]);
      for (Local& node : corner) node += shift;
    }
    for (std::size_t i = 0; i < nodes; ++i)
      topology.nodes.push_back(topology.nodes[i] + b * mesh_nodes);
    for (std::size_t k = 0; k < support; ++k)
      topology.support_nodes.push_back(topology.support_nodes[k] + shift);
    for (std::size_t c = 0; c < border; ++c)
      topology.support_border.push_back(topology.support_border[c]);
    for (std::size_t c = 0; c < follows; ++c)
      topology.support_follows.push_back(topology.support_follows[c]);
  }
}

template <int Dim>
Vec<Dim> contact_impulse(const BodyAtNode<Dim>& a, const BodyAtNode<Dim>& b, double friction) {
  const double size_a = a.gradient.squaredNorm(), size_b = b.gradient.squaredNorm();
  const double size = std::sqrt(std::max(size_a, size_b));
  if (!(size > 0.0)) return Vec<Dim>::Zero();
  const Vec<Dim> normal =
      size_a >= size_b ? Vec<Dim>(a.gradient / size) : Vec<Dim>(-b.gradient / size);
  const Vec<Dim> relative = a.velocity - b.velocity;
  const double approach = relative.dot(normal);
  if (!(approach > 0.0)) return Vec<Dim>::Zero();
  const double reduced = a.mass * b.mass / (a.mass + b.mass);
  const Vec<Dim> slip = relative - approach * normal;
  const double speed = slip.norm();
  const double held = std::min(speed, friction * approach);
  Vec<Dim> change = approach * normal;
  if (held > 0.0) change += held / speed * slip;
  return reduced * change;
}

namespace {

/// The bodies at one node.
template <int Dim>
class NodeContact {
 public:
  NodeContact(Patch<Dim>& patch, double dt, double friction)
      : patch_(patch), dt_(dt), friction_(friction) {}

  /// Returns whether anything changed; then before() is the velocity of a field without contact.
  bool apply(Local node) {
    fields_.clear();
    for (Local f = node; f < patch_.n_nodes(); f += patch_.body_nodes)
      if (mass(f) > patch_.least_mass) fields_.push_back({f, velocity(f)});
    if (fields_.size() < 2) return false;
    bool any = false;
    for (int sweep = 0; sweep < (fields_.size() == 2 ? 1 : contact_sweeps); ++sweep)
      for (std::size_t a = 0; a < fields_.size(); ++a)
        for (std::size_t b = a + 1; b < fields_.size(); ++b)
          any = meet(fields_[a].node, fields_[b].node) || any;
    return any;
  }

  struct Field {
    Local node;
    Vec<Dim> before;  ///< [m/s]
  };
  const std::vector<Field>& fields() const { return fields_; }

  double mass(Local f) const { return at(patch_.velocity, f)[mass_lane]; }
  Eigen::Map<Vec<Dim>> velocity(Local f) { return Eigen::Map<Vec<Dim>>(at(patch_.velocity, f)); }
  Eigen::Map<Vec<Dim>> acceleration(Local f) {
    return Eigen::Map<Vec<Dim>>(at(patch_.acceleration, f));
  }

 private:
  static double* at(NodeArray& values, Local f) {
    return values.data() + static_cast<std::ptrdiff_t>(f) * node_width;
  }
  BodyAtNode<Dim> body(Local f) {
    return {mass(f), Eigen::Map<const Vec<Dim>>(at(patch_.velocity, f)),
            Eigen::Map<const Vec<Dim>>(at(patch_.gradient, f))};
  }
  bool meet(Local a, Local b) {
    const Vec<Dim> impulse = contact_impulse<Dim>(body(a), body(b), friction_);
    if (impulse.isZero(0.0)) return false;
    push(a, -impulse);
    push(b, impulse);
    return true;
  }
  void push(Local f, const Vec<Dim>& impulse) {
    const Vec<Dim> change = impulse / mass(f);
    velocity(f) += change;
    acceleration(f) += change / dt_;
  }

  Patch<Dim>& patch_;
  double dt_, friction_;
  std::vector<Field> fields_;
};

/// Hold the prescribed velocities of a wall that contact has changed; others are held with all
/// nodes. Returns the work of what holds them per mass [J/kg].
template <int Dim>
double hold_at_wall(const Patch<Dim>& patch, double dt, Local node,
                    Eigen::Map<Vec<Dim>> velocity, Eigen::Map<Vec<Dim>> acceleration) {
  const auto wall = std::lower_bound(patch.walls.begin(), patch.walls.end(), node,
                                     [](const WallNode<Dim>& w, Local n) { return w.node < n; });
  if (wall == patch.walls.end() || wall->node != node) return 0.0;
  return hold_velocity(*wall, dt, velocity.data(), acceleration.data());
}

}  // namespace

template <int Dim>
void apply_contact(Patch<Dim>& patch, const StepContext<Dim>& step, const Vec<Dim>& gravity) {
  const double dt = step.dt;
  NodeContact<Dim> contact(patch, dt, step.model->analysis.contact.friction);
  const double* own = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  for (const NodeRange& range : patch.active_nodes) {
    for (Local i = range.begin; i < std::min(range.end, patch.body_nodes); ++i) {
      if (!contact.apply(i)) continue;
      // All work is taken with the mean velocity of the step, which contact has changed.
      for (const auto& field : contact.fields()) {
        const double own_mass = own[static_cast<std::ptrdiff_t>(field.node) * sum_stride];
        auto v = contact.velocity(field.node), a = contact.acceleration(field.node);
        const Vec<Dim> change = v - field.before;
        patch.work.damping -= own_mass * change.dot(v - 0.5 * dt * a);
        patch.work.external += 0.5 * dt * own_mass * gravity.dot(change);
        if (step.model->analysis.damping > 0.0) {
          const Eigen::Map<const Vec<Dim>> drag(
              &patch.damping[static_cast<std::size_t>(field.node) * node_width]);
          patch.work.damping += 0.5 * dt * own_mass / contact.mass(field.node) * drag.dot(change);
        }
        patch.work.external += own_mass * hold_at_wall<Dim>(patch, dt, field.node, v, a);
      }
    }
  }
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template void repeat_for_bodies(PatchTopology<Dim>&, int, Index);                          \
  template Vec<Dim> contact_impulse(const BodyAtNode<Dim>&, const BodyAtNode<Dim>&, double); \
  template void apply_contact(Patch<Dim>&, const StepContext<Dim>&, const Vec<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
