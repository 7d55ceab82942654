/// \file Nodes in implicit steps. All copies of a node do the same arithmetic on the same sums.
#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/kernels/implicit.h"
#include "physics/kernels/implicit_walls.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/matrix_pattern.h"
#include "physics/kernels/nodal_motion.h"
#include "physics/kernels/timed_velocities.h"
#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

template <int Dim>
std::size_t nodal_size(const Patch<Dim>& patch) {
  return static_cast<std::size_t>(patch.n_nodes()) * node_width;
}

/// Newmark's acceleration at the end: d / (beta dt^2) - v / (beta dt) - (1 / (2 beta) - 1) a.
struct Newmark {
  double of_increment, of_velocity, of_acceleration;
  Newmark(const ImplicitSteps& steps, double dt)
      : of_increment(1.0 / (steps.beta * dt * dt)),
        of_velocity(1.0 / (steps.beta * dt)),
        of_acceleration(0.5 / steps.beta - 1.0) {}
  LAHAR_INLINE NodeVector operator()(const NodeVector& d, const NodeVector& v,
                                     const NodeVector& a) const {
    return of_increment * d - of_velocity * v - of_acceleration * a;
  }
};

template <class Node, int Dim>
void for_each_active_node(const Patch<Dim>& patch, Node node) {
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i) node(i);
}

template <int Dim>
double mass_at(const Patch<Dim>& patch, Local i) {
  return at(patch.velocity, i)[mass_lane];
}

template <int Dim>
void hold(Patch<Dim>& patch, Local node, int dir, double displacement) {
  patch.system.held[static_cast<std::size_t>(node)] |= static_cast<std::uint8_t>(1 << dir);
  at(patch.implicit.prescribed, node)[dir] = displacement;
}

template <int Dim>
void prescribe(Patch<Dim>& patch, const StepContext<Dim>& step) {
  NodalSystem<Dim>& system = patch.system;
  constexpr std::uint8_t all = (1 << Dim) - 1;
  system.held.assign(static_cast<std::size_t>(patch.n_nodes()), all);
  patch.implicit.prescribed.assign(nodal_size(patch), 0.0);
  for_each_active_node(patch, [&](Local i) {
    if (has_velocity(patch, mass_at(patch, i))) system.held[static_cast<std::size_t>(i)] = 0;
  });
  for (const auto& fixed : patch.fixed)
    hold(patch, fixed.node, fixed.dir, step.dt * fixed.velocity);
  for (const auto& fixed : patch.fixed_displacement)
    hold(patch, fixed.node, fixed.dir,
         fixed.displacement * load_factor(*step.model, fixed.function, step.time));
}

/// A node that is fixed moves with what holds it, in Newmark's formulas too.
template <int Dim>
void follow_fixed(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const auto follow = [&](const auto& list) {
    for (const auto& fixed : list) {
      at(patch.velocity, fixed.node)[fixed.dir] =
          at(patch.implicit.prescribed, fixed.node)[fixed.dir] / step.dt;
      at(patch.acceleration, fixed.node)[fixed.dir] = 0.0;
    }
  };
  follow(patch.fixed);
  follow(patch.fixed_displacement);
}

/// Particles' part of A times the displacement of given unknowns moves to the right side. Fixed
/// nodes keep r: it is their reaction.
template <int Dim>
void predict(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const NodalSystem<Dim>& system = patch.system;
  double* sums = patch.own_sums(NodeSum::residual, step.step);
  for_each_active_node(patch, [&](Local i) {
    const auto row = static_cast<std::size_t>(i);
    const unsigned fixed = is_at_wall(patch, i) ? 0u : system.held[row];
    for (std::size_t k = system.first[row]; k < system.first[row + 1]; ++k) {
      if (system.held[static_cast<std::size_t>(system.column[k])] == 0) continue;
      const double* d = at(patch.implicit.given, system.column[k]);
      const double* block = &system.blocks[static_cast<std::size_t>(system.block_size) * k];
      for (int a = 0; a < Dim; ++a)
        if (!(fixed >> a & 1))
          for (int c = 0; c < Dim; ++c) sums[i * sum_stride + a] -= block[Dim * a + c] * d[c];
    }
  });
}

}  // namespace

template <int Dim>
void begin_implicit_step(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) {
    patch.system = {};
    patch.implicit = {};
    return;
  }
  patch.velocity.resize(nodal_size(patch), 0.0);
  patch.acceleration.assign(nodal_size(patch), 0.0);
  take_velocity(patch, step, NodeSum::mass_momentum, patch.velocity);
  if (!step.model->analysis.implicit.quasi_static)
    for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::inertia, step.step),
                  [&](Local i, const NodeVector&, const NodeVector& sum) {
                    const auto v = load<NodeVector>(at(patch.velocity, i));
                    const NodeVector a = velocity_of(patch, sum, v);
                    store(with_mass(a, NodeVector(0.0)), at(patch.acceleration, i));
                  });
  const double* own = patch.own_sums(NodeSum::mass_momentum, step.step) + mass_lane;
  patch.implicit.own_mass.assign(static_cast<std::size_t>(patch.n_nodes()), 0.0);
  for_each_active_node(patch, [&](Local i) {
    patch.implicit.own_mass[static_cast<std::size_t>(i)] = own[i * sum_stride];
  });
  StepContext<Dim> whole = step;  // loads are those of its end, but in CB-Geo MPM
  if (!step.model->analysis.as_cbgeo) whole.time -= step.dt;
  set_timed_velocities(patch, whole);
  prescribe(patch, step);
  follow_fixed(patch, step);
  hold_timed_walls(patch);
  find_pattern(patch);
  begin_walls(patch, step);
  for (NodeArray* array : {&patch.system.right_side, &patch.system.solution,
                           &patch.implicit.increment, &patch.implicit.given})
    array->assign(nodal_size(patch), 0.0);
  load_in_part(patch, 0.0, 1.0);
}

template <int Dim>
void complete_matrix(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  constexpr auto size = static_cast<std::size_t>(NodalSystem<Dim>::block_size);
  const ImplicitSteps& steps = step.model->analysis.implicit;
  const double inertia = steps.quasi_static ? 0.0 : Newmark(steps, step.dt).of_increment;
  // Where inertia holds nothing. The matrix alone: a solution that is found does not know of it.
  const double least_stiffness = steps.quasi_static ? 1e-9 : 0.0;
  const std::vector<double>& own_mass = patch.implicit.own_mass;
  NodalSystem<Dim>& system = patch.system;
  for_each_active_node(patch, [&](Local i) {
    const auto row = static_cast<std::size_t>(i);
    if (system.first[row] == system.first[row + 1]) return;
    double* block = &system.blocks[size * find_block(system, i, i)];
    double largest = 0;
    for (std::size_t d = 0; d < Dim; ++d) largest = std::max(largest, block[(Dim + 1) * d]);
    for (std::size_t d = 0; d < Dim; ++d)
      block[(Dim + 1) * d] +=
          least_stiffness * largest + inertia * own_mass[static_cast<std::size_t>(i)];
  });
  if (patch.implicit.has_given) predict(patch, step);
  turn_matrix(patch);
}

template <int Dim>
void accelerate_from_rest(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const Newmark newmark(step.model->analysis.implicit, step.dt);
  for_each_active_node(patch, [&](Local i) {
    const auto held = patch.system.held[static_cast<std::size_t>(i)];
    const auto v = load<NodeVector>(at(patch.velocity, i));
    const NodeVector none(0.0);
    const NodeVector without = newmark(none, v, none);  // what the balance has of inertia
    Vec<Dim> global, a = Vec<Dim>::Zero();
    for (int d = 0; d < Dim; ++d) global[d] = without[d];
    const Vec<Dim> along = in_axes_of_node(patch, i, global);  // as the balance and what is held
    for (int d = 0; d < Dim; ++d)
      if (!(held >> d & 1)) a[d] = at(patch.system.right_side, i)[d] / v[mass_lane] + along[d];
    a = in_axes_of_mesh(patch, i, a);
    std::copy_n(a.data(), Dim, at(patch.acceleration, i));
  });
}

template <int Dim>
void load_in_part(Patch<Dim>& patch, double left_out, double part) {
  ImplicitNodes<Dim>& nodes = patch.implicit;
  nodes.left_out = left_out;
  nodes.keeps_support = false;
  nodes.has_given = part != 0.0;
  for (std::size_t k = 0; k < nodes.given.size(); ++k) nodes.given[k] = part * nodes.prescribed[k];
  if (nodes.has_given) give_at_walls(patch);
}

template <int Dim>
void keep_unloaded(Patch<Dim>& patch) {
  patch.implicit.unloaded = patch.implicit.balance;
}

template <int Dim>
void keep_increment(Patch<Dim>& patch) {
  patch.implicit.kept = patch.implicit.increment;
  patch.implicit.kept_walls = patch.implicit.walls;
}

template <int Dim>
void restore_increment(Patch<Dim>& patch) {
  patch.implicit.increment = patch.implicit.kept;
  patch.implicit.walls = patch.implicit.kept_walls;
}

template <int Dim>
void close_system(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  const ImplicitSteps& steps = step.model->analysis.implicit;
  const NodeVector gravity = gravity_in(step);
  const Newmark newmark(steps, step.dt);
  NodeArray& r = patch.system.right_side;
  for_each_node(patch, SumOverPatches<Dim>(patch, NodeSum::residual, step.step),
                [&](Local i, const NodeVector&, const NodeVector& sum) {
                  const auto v = load<NodeVector>(at(patch.velocity, i));
                  NodeVector force = sum + gravity * v[mass_lane];
                  if (!steps.quasi_static)
                    force -=
                        v[mass_lane] * newmark(load<NodeVector>(at(patch.implicit.increment, i)), v,
                                               load<NodeVector>(at(patch.acceleration, i)));
                  store(with_mass(force, NodeVector(0.0)), at(r, i));
                });
  for (const auto& point : patch.forces)
    if (patch.node_is_active[static_cast<std::size_t>(point.node)])
      at(r, point.node)[point.dir] +=
          point.force * load_factor(*step.model, point.function, step.time);
  if (patch.implicit.left_out != 0.0)
    for (std::size_t k = 0; k < r.size(); ++k)
      r[k] -= patch.implicit.left_out * patch.implicit.unloaded[k];
  patch.implicit.balance = r;
  settle_walls(patch, step);
}

template <int Dim>
void take_solution(Patch<Dim>& patch) {
  turn_solution(patch);
  ImplicitNodes<Dim>& nodes = patch.implicit;
  for (std::size_t k = 0; k < nodes.increment.size(); ++k)
    nodes.increment[k] += patch.system.solution[k] + nodes.given[k];
  std::fill(nodes.given.begin(), nodes.given.end(), 0.0);
  nodes.has_given = false;
}

template <int Dim>
void take_back(Patch<Dim>& patch, double share) {
  ImplicitNodes<Dim>& nodes = patch.implicit;
  for (std::size_t k = 0; k < nodes.increment.size(); ++k)
    nodes.increment[k] -= share * patch.system.solution[k];
}

template <int Dim>
EquilibriumNorms equilibrium_norms(const Patch<Dim>& patch, const StepContext<Dim>& step) {
  EquilibriumNorms norms;
  if (patch.system.right_side.empty()) return norms;
  const NodeVector gravity = gravity_in(step);
  for_each_active_node(patch, [&](Local i) {
    if (!patch.topology.owned[static_cast<std::size_t>(i)]) return;
    const double* r = at(patch.system.right_side, i);
    const double* x = at(patch.system.solution, i);
    for (int d = 0; d < Dim; ++d) {
      const double weight = mass_at(patch, i) * gravity[d];
      norms.forces += weight * weight;
      if (patch.system.held[static_cast<std::size_t>(i)] >> d & 1) {
        norms.forces += r[d] * r[d];  // a reaction
        continue;
      }
      norms.residual += r[d] * r[d];
      norms.change += x[d] * x[d];
      norms.unknowns += 1;
    }
  });
  return norms;
}

template <int Dim>
double heaviest_node(const Patch<Dim>& patch) {
  double mass = 0;
  for_each_active_node(patch, [&](Local i) { mass = std::max(mass, mass_at(patch, i)); });
  return mass;
}

template <int Dim>
LongestMove longest_move(const Patch<Dim>& patch, double least_mass) {
  double square = 0;
  for_each_active_node(patch, [&](Local i) {
    if (mass_at(patch, i) < least_mass) return;
    const double* d = at(patch.implicit.increment, i);
    double sum = 0;
    for (int k = 0; k < Dim; ++k) sum += d[k] * d[k];
    square = std::max(square, sum);
  });
  const double metres = std::sqrt(square);
  return {metres, metres > 0 ? metres / patch.smallest_cell : 0.0};
}

template <int Dim>
void end_implicit_step(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  const ImplicitSteps& steps = step.model->analysis.implicit;
  const Newmark newmark(steps, step.dt);
  StepContext<Dim> at_end = step;
  at_end.time += step.dt;
  const NodeVector gravity = 0.5 * (gravity_in(step) + gravity_in(at_end));  // the mean does work
  const std::vector<double>& own_mass = patch.implicit.own_mass;
  NodeVector weight_work(0.0);
  count_work_at_walls(patch);
  double* const loads = &patch.work.external;
  for_each_active_node(patch, [&](Local i) {
    const auto d = load<NodeVector>(at(patch.implicit.increment, i));
    const auto v = load<NodeVector>(at(patch.velocity, i));
    const auto a = load<NodeVector>(at(patch.acceleration, i));
    const double m = v[mass_lane], own = own_mass[static_cast<std::size_t>(i)];
    weight_work += own * d;
    if (own != 0.0 && !is_at_wall(patch, i)) {
      // What is not in balance, reactions hold: the mean of those of the beginning and the end.
      NodeVector before = load<NodeVector>(at(patch.implicit.unloaded, i));
      if (!steps.quasi_static) before += m * newmark(NodeVector(0.0), v, a);
      const double* r = at(patch.system.right_side, i);
      for (int k = 0; k < Dim; ++k)
        if (patch.system.held[static_cast<std::size_t>(i)] >> k & 1)
          *loads -= own / m * 0.5 * (before[k] + r[k]) * d[k];
    }
    NodeVector end(0.0), change(0.0);
    if (!steps.quasi_static) {
      end = with_mass(newmark(d, v, a), NodeVector(0.0));
      change = (1.0 - steps.gamma) * a + steps.gamma * end;
    }
    store(end, at(patch.system.solution, i));
    store(with_mass(change, NodeVector(0.0)), at(patch.acceleration, i));
  });
  if (!steps.quasi_static) stop_at_walls(patch, step);
  add_timed_acceleration_of_implicit(patch, step);
  for_each_active_node(patch, [&](Local i) {
    const auto d = load<NodeVector>(at(patch.implicit.increment, i));
    store(with_mass((1.0 / step.dt) * d, load<NodeVector>(at(patch.velocity, i))),
          at(patch.velocity, i));
  });
  for (int d = 0; d < Dim; ++d) *loads += gravity[d] * weight_work[d];
  for (const auto& point : patch.forces)
    if (const double m = mass_at(patch, point.node); more_than(m, least_moving_mass))
      *loads += own_mass[static_cast<std::size_t>(point.node)] / m * point.force * 0.5 *
                (load_factor(*step.model, point.function, step.time) +
                 load_factor(*step.model, point.function, at_end.time)) *
                at(patch.implicit.increment, point.node)[point.dir];
}

#define LAHAR_INSTANTIATE(Dim)                                                                  \
  template void begin_implicit_step<Dim>(Patch<Dim>&, const StepContext<Dim>&);                 \
  template void complete_matrix<Dim>(Patch<Dim>&, const StepContext<Dim>&);                     \
  template void close_system<Dim>(Patch<Dim>&, const StepContext<Dim>&);                        \
  template void accelerate_from_rest<Dim>(Patch<Dim>&, const StepContext<Dim>&);                \
  template void load_in_part<Dim>(Patch<Dim>&, double, double);                                 \
  template void keep_unloaded<Dim>(Patch<Dim>&);                                                \
  template void keep_increment<Dim>(Patch<Dim>&);                                               \
  template void restore_increment<Dim>(Patch<Dim>&);                                            \
  template void take_solution<Dim>(Patch<Dim>&);                                                \
  template void take_back<Dim>(Patch<Dim>&, double);                                            \
  template EquilibriumNorms equilibrium_norms<Dim>(const Patch<Dim>&, const StepContext<Dim>&); \
  template double heaviest_node<Dim>(const Patch<Dim>&);                                        \
  template LongestMove longest_move<Dim>(const Patch<Dim>&, double);                            \
  template void end_implicit_step<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
