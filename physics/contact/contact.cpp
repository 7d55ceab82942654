// Every copy of a node runs this very code, so that all are equal to the last bit.
#include "physics/contact/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "physics/model/transfer_options.h"
#include "physics/particles/damping_force.h"
#include "physics/particles/node_sums.h"

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

namespace {

/// What is left of an inverse mass, or of a length, where constraints hold all of it: rounding.
constexpr double nothing_left = 1e-12;

/// Part of a slip that friction can act on: along what is free, across the normal.
template <int Dim>
Vec<Dim> across(const Vec<Dim>& slip, const Vec<Dim>& normal,
                const Eigen::Matrix<double, Dim, Dim>& free) {
  const Vec<Dim> along = free * normal;
  const double length = along.squaredNorm();
  return length > nothing_left ? Vec<Dim>(slip - along.dot(slip) / length * along) : slip;
}

}  // namespace

template <int Dim>
ContactImpulse<Dim> contact_impulse(const BodyAtNode<Dim>& a, const BodyAtNode<Dim>& b,
                                    const Vec<Dim>& normal, double most, double friction,
                                    bool together) {
  ContactImpulse<Dim> done;
  const Vec<Dim> relative = a.velocity - b.velocity;
  const double approach = relative.dot(normal);
  const double excess = together && approach < 0.0 ? approach : std::max(approach - most, 0.0);
  if (excess == 0.0 && !together) return done;
  // An impulse j from a to b takes A j from their relative velocity.
  const Eigen::Matrix<double, Dim, Dim> A = a.free / a.mass + b.free / b.mass;
  const double given = normal.dot(A * normal);
  if (!(given * std::min(a.mass, b.mass) > nothing_left)) return done;  // both are held
  const double pressed = excess / given;
  done.pressed = true;
  done.impulse = pressed * normal;
  if (!(friction > 0.0)) return done;
  const auto& free = a.free.trace() >= b.free.trace() ? a.free : b.free;
  const Vec<Dim> slip = across<Dim>(relative - pressed * (A * normal), normal, free);
  const double speed = slip.norm();
  done.stuck = true;
  if (!(speed > 0.0)) return done;
  const Vec<Dim> direction = slip / speed;
  const double yields = direction.dot(A * direction);
  if (!(yields * std::min(a.mass, b.mass) > nothing_left)) return done;
  const double sticks = speed / yields;
  const double most_held =  // an infinite coefficient holds without any pressure
      std::isinf(friction) ? friction : friction * std::abs(pressed);
  done.stuck = sticks <= most_held;
  done.friction = std::min(sticks, most_held) * direction;
  done.impulse += done.friction;
  return done;
}
namespace {

/// The bodies that meet at one node.
template <int Dim>
class NodeContact {
 public:
  using Meetings = std::span<Meeting<Dim>>;

  struct Field {
    Local node;
    double mass;      ///< [kg]
    Vec<Dim> before;  ///< [m/s] without contact
    Vec<Dim> velocity;
    Vec<Dim> rubbed;  ///< [m/s] what friction did to it
    /// [N s] of what prescribes velocities, against contact and against its friction
    Vec<Dim> reaction, against_friction;
    Eigen::Matrix<double, Dim, Dim> free;
    const ConstrainedNode<Dim>* wall;
    Vec<Dim> prescribed = Vec<Dim>::Zero();  ///< [m/s] along what is not free
    Vec<Dim> change() const { return velocity - before; }
  };

  explicit NodeContact(const Patch<Dim>& patch) : patch_(patch) {}

  /// Take the meetings of one node, with nodal velocities as they are. What damping took from them
  /// over `damped` [s] is given back.
  void begin(Meetings meetings, double damped = 0.0) {
    fields_.clear();
    meetings_ = meetings;
    for (const Meeting<Dim>& meeting : meetings)
      for (const Local node : {meeting.a, meeting.b}) {
        if (!add(node) || damped == 0.0) continue;
        Field& field = fields_.back();
        field.velocity += damped / field.mass *
                          (field.free * Eigen::Map<const Vec<Dim>>(at(patch_.damping, node)));
        field.before = field.velocity;
      }
  }

  /// Let them meet, where they approach faster than their gap / dt. Returns whether any velocity
  /// changed; notes what acted in the meetings.
  bool meet(double dt, double friction) {
    bool any = false;
    for (int sweep = 0; sweep < sweeps(); ++sweep)
      for (Meeting<Dim>& meeting : meetings_) {
        const auto done = meet(meeting, dt, friction, false);
        if (!done.pressed) continue;
        meeting.pressed = any = true;
        meeting.stuck = done.stuck;
      }
    return any;
  }

  /// Those that were pressed together, or stuck.
  void hold_together(double dt) {
    constexpr double all = std::numeric_limits<double>::infinity();
    for (int sweep = 0; sweep < sweeps(); ++sweep)
      for (const Meeting<Dim>& meeting : meetings_)
        if (meeting.pressed) meet(meeting, dt, meeting.stuck ? all : 0.0, true);
  }

  const std::vector<Field>& fields() const { return fields_; }

 private:
  Field* find(Local node) {
    for (Field& field : fields_)
      if (field.node == node) return &field;
    return nullptr;
  }

  bool add(Local node) {
    const double* v = at(patch_.velocity, node);
    if (!(v[mass_lane] > patch_.least_mass) || find(node)) return false;
    const Vec<Dim> velocity = Eigen::Map<const Vec<Dim>>(v);
    Field field{node,
                v[mass_lane],
                velocity,
                velocity,
                Vec<Dim>::Zero(),
                Vec<Dim>::Zero(),
                Vec<Dim>::Zero(),
                {},
                find_node(patch_.walls, node)};
    field.free.setIdentity();
    auto fixed = std::lower_bound(
        patch_.fixed.begin(), patch_.fixed.end(), node,
        [](const typename Patch<Dim>::FixedVelocity& f, Local n) { return f.node < n; });
    for (; fixed != patch_.fixed.end() && fixed->node == node; ++fixed)
      field.free(fixed->dir, fixed->dir) = 0.0;
    if (const DrivenNode<Dim>* driven = find_node(patch_.driven, node))
      for (int d = 0; d < Dim; ++d)
        if (driven->driven[static_cast<std::size_t>(d)]) field.free(d, d) = 0.0;
    if (field.wall)
      for (int k = 0; k < Dim; ++k)
        if (field.wall->fixed[static_cast<std::size_t>(k)]) hold(field, k);
    field.prescribed = velocity - field.free * velocity;
    fields_.push_back(field);
    return true;
  }

  static void hold(Field& field, int axis) {
    const Vec<Dim> e = field.wall->axes.col(axis);
    field.free -= e * e.transpose();
  }

  /// Hold a body along a one-sided wall that an impulse presses it into. Returns whether it does.
  static bool hold_at_wall(Field& field, const Vec<Dim>& impulse) {
    if (!field.wall) return false;
    const Vec<Dim> v = field.velocity + field.free * impulse / field.mass;
    bool any = false;
    for (int k = 0; k < Dim; ++k) {
      const int sign = field.wall->pushes[static_cast<std::size_t>(k)];
      const Vec<Dim> e = field.wall->axes.col(k);
      if (sign == 0 || !(e.dot(field.free * e) > 0.5)) continue;  // or held already
      if (!(sign * (e.dot(v) - field.wall->velocity[static_cast<std::size_t>(k)]) > 0.0)) continue;
      hold(field, k);
      field.prescribed += field.wall->velocity[static_cast<std::size_t>(k)] * e;
      any = true;
    }
    return any;
  }

  int sweeps() const { return meetings_.size() == 1 ? 1 : contact_sweeps; }

  ContactImpulse<Dim> meet(const Meeting<Dim>& meeting, double dt, double friction, bool together) {
    ContactImpulse<Dim> done;
    Field *a = find(meeting.a), *b = find(meeting.b);
    if (!a || !b) return done;
    do {
      done =
          contact_impulse<Dim>({a->mass, a->velocity, a->free}, {b->mass, b->velocity, b->free},
                               meeting.normal, std::max(meeting.gap, 0.0) / dt, friction, together);
    } while (done.pressed && (hold_at_wall(*a, -done.impulse) || hold_at_wall(*b, done.impulse)));
    if (done.pressed) {
      take(*a, -done.impulse, -done.friction);
      take(*b, done.impulse, done.friction);
    }
    return done;
  }

  static void take(Field& field, const Vec<Dim>& impulse, const Vec<Dim>& friction) {
    const Vec<Dim> moves = field.free * impulse, rubs = field.free * friction;
    field.velocity += moves / field.mass;
    field.rubbed += rubs / field.mass;
    field.reaction -= impulse - moves;
    field.against_friction -= friction - rubs;
  }

  const Patch<Dim>& patch_;
  std::vector<Field> fields_;
  Meetings meetings_;
};

/// The damping force on a body that met others, of what contact left out of balance. It stops the
/// body at most, which contact has stopped, too. `start` is the velocity before the step.
template <int Dim>
Vec<Dim> damping_with_contact(const Analysis& analysis, double dt,
                              const typename NodeContact<Dim>::Field& field,
                              const Vec<Dim>& start) {
  double velocity[node_width] = {}, net[node_width] = {}, against[node_width];
  velocity[mass_lane] = field.mass;
  for (int d = 0; d < Dim; ++d) {
    velocity[d] = start[d];
    net[d] = field.mass / dt * (field.velocity[d] - start[d]);
  }
  store(damping_force(analysis, dt, load<NodeVector>(velocity), load<NodeVector>(net)), against);
  for (int d = 0; d < Dim; ++d) {
    const double most = field.mass / dt * std::abs(field.velocity[d]);
    const bool onwards = field.velocity[d] * against[d] > 0.0;
    against[d] = onwards ? std::copysign(std::min(std::abs(against[d]), most), against[d]) : 0.0;
  }
  return field.free * Eigen::Map<const Vec<Dim>>(against);
}

/// Call body(meetings) with those of each node.
template <int Dim, class Body>
void for_each_meeting_place(Patch<Dim>& patch, Body body) {
  const std::span<Meeting<Dim>> all(patch.contact.meetings);
  const auto node_of = [&](std::size_t k) { return all[k].a % patch.body_nodes; };
  for (std::size_t from = 0, to = 0; from < all.size(); from = to) {
    while (to < all.size() && node_of(to) == node_of(from)) ++to;
    body(all.subspan(from, to - from));
  }
}

template <int Dim>
Eigen::Map<Vec<Dim>> vector_at(NodeArray& values, Local node) {
  return Eigen::Map<Vec<Dim>>(at(values, node));
}

}  // namespace

template <int Dim>
void apply_contact(Patch<Dim>& patch, const StepContext<Dim>& step, const Vec<Dim>& gravity) {
  patch.contact.touched.clear();
  if (patch.contact.meetings.empty()) return;
  const Analysis& analysis = step.model->analysis;
  const double dt = step.dt;
  const bool damps_net = damps_net_force(analysis);
  const double* own = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  NodeContact<Dim> contact(patch);
  for_each_meeting_place(patch, [&](std::span<Meeting<Dim>> meetings) {
    contact.begin(meetings, damps_net ? dt : 0.0);
    if (!contact.meet(dt, analysis.contact.friction)) return;
    // All work is taken with the mean velocity of the step, which contact has changed.
    for (const auto& field : contact.fields()) {
      const double own_mass = own[static_cast<std::ptrdiff_t>(field.node) * sum_stride];
      auto v = vector_at<Dim>(patch.velocity, field.node),
           a = vector_at<Dim>(patch.acceleration, field.node);
      const Vec<Dim> start = v - dt * a;
      const Vec<Dim> share = own_mass / field.mass * field.prescribed;
      const double paid = share.dot(field.reaction);
      patch.work.external += paid;
      patch.work.damping += paid;
      patch.work.friction += share.dot(field.against_friction);
      Vec<Dim> now = field.velocity;
      if (damps_net) {
        auto damping = vector_at<Dim>(patch.damping, field.node);
        const Vec<Dim> anew = damping_with_contact(analysis, dt, field, start);
        now -= dt / field.mass * anew;
        patch.work.damping +=
            0.5 * dt * own_mass / field.mass * (anew.dot(start + now) - damping.dot(start + v));
        damping = anew;
      } else if (analysis.damping > 0.0) {
        patch.work.damping += 0.5 * dt * own_mass / field.mass *
                              vector_at<Dim>(patch.damping, field.node).dot(field.change());
      }
      const Vec<Dim> change = field.change(), all = now - v;
      v = now;
      a += all / dt;
      patch.contact.touched.push_back({field.node, {start, change, v}, field.rubbed});
      patch.work.damping -= own_mass * change.dot(0.5 * (start + v));
      patch.work.friction -= own_mass * field.rubbed.dot(0.5 * (start + v));
      patch.work.external += 0.5 * dt * own_mass * gravity.dot(all);
      if (field.wall)
        patch.work.damping -=
            0.5 * own_mass *
            patch.contact.wall_change[static_cast<std::size_t>(field.wall - patch.walls.data())]
                .dot(all);
    }
  });
}

template <int Dim>
void hold_together(Patch<Dim>& patch, const StepContext<Dim>& step) {
  auto touched = patch.contact.touched.cbegin();
  const auto end = patch.contact.touched.cend();
  if (touched == end) return;
  const double* own = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  NodeContact<Dim> contact(patch);
  for_each_meeting_place(patch, [&](std::span<Meeting<Dim>> meetings) {
    const Local node = meetings.front().a % patch.body_nodes;
    if (touched == end || touched->node % patch.body_nodes != node) return;
    contact.begin(meetings);
    contact.hold_together(step.dt);
    for (const auto& field : contact.fields()) {
      const auto& [_, by, rubbed] = *touched++;  // the same fields in the same order
      vector_at<Dim>(patch.velocity, field.node) = field.velocity;
      const double m = own[static_cast<std::ptrdiff_t>(field.node) * sum_stride];
      patch.work.damping += m * by.taken_again(field.before, field.velocity);
      patch.work.friction -= 0.5 * m * rubbed.dot(field.before - by.after);
    }
  });
}

#define LAHAR_INSTANTIATE(Dim)                                                                 \
  template void repeat_for_bodies(PatchTopology<Dim>&, int, Index);                            \
  template ContactImpulse<Dim> contact_impulse(const BodyAtNode<Dim>&, const BodyAtNode<Dim>&, \
                                               const Vec<Dim>&, double, double, bool);         \
  template void apply_contact(Patch<Dim>&, const StepContext<Dim>&, const Vec<Dim>&);          \
  template void hold_together(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
