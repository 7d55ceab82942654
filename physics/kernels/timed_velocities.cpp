// Every copy of a node runs this very code, so that all are equal to the last bit.
#include "physics/kernels/timed_velocities.h"

#include "physics/particles/loads.h"
#include "physics/particles/node_sums.h"

namespace lahar {

namespace {

template <int Dim>
using Timed = typename Patch<Dim>::TimedVelocity;

template <int Dim>
double velocity_at(const Timed<Dim>& timed, const StepContext<Dim>& step, double time) {
  return timed.velocity * load_factor(*step.model, timed.function, time);
}

/// Whether the velocity is held, and not only that of a wall that pushes.
template <int Dim>
bool is_held(const Patch<Dim>& patch, const Timed<Dim>& timed) {
  return timed.list != Timed<Dim>::List::walls ||
         patch.walls[timed.entry].fixed[static_cast<std::size_t>(timed.dir)];
}

template <int Dim>
Local node_of(const Patch<Dim>& patch, const Timed<Dim>& timed) {
  using List = typename Timed<Dim>::List;
  if (timed.list == List::walls) return patch.walls[timed.entry].node;
  return (timed.list == List::fixed ? patch.fixed : patch.fixed_liquid)[timed.entry].node;
}

template <int Dim>
Vec<Dim> direction_of(const Patch<Dim>& patch, const Timed<Dim>& timed) {
  if (timed.list != Timed<Dim>::List::walls) return Vec<Dim>::Unit(timed.dir);
  return patch.walls[timed.entry].axes.col(timed.dir);
}

/// Call add(node, a) for each acceleration a (Vec) of nodes that have this patch's part `own(node)`
/// of their mass [kg], and `mass(node)` of all patches; `liquid` says of which phase.
template <int Dim>
void for_each_acceleration(Patch<Dim>& patch, const StepContext<Dim>& step, bool liquid, auto own,
                           auto mass, auto add) {
  for (const Timed<Dim>& timed : patch.timed) {
    if ((timed.list == Timed<Dim>::List::fixed_liquid) != liquid || !is_held(patch, timed))
      continue;
    const Local node = node_of(patch, timed);
    const double part = own(node);
    // A node that is not active has anything as its state, but no part of its mass is here.
    const bool is_active = patch.node_is_active[static_cast<std::size_t>(node)];
    if (!is_active || !more_than(mass(node), patch.least_mass)) continue;
    const double before = velocity_at<Dim>(timed, step, step.time);
    const double after = velocity_at<Dim>(timed, step, step.time + step.dt);
    patch.work.external += 0.5 * part * (after - before) * (after + before);
    add(node, Vec<Dim>((after - before) / step.dt * direction_of(patch, timed)));
  }
}

/// The same of what is reached at once: in the first step, velocities that are not zero where the
/// particles have others.
template <int Dim>
void for_each_sudden(Patch<Dim>& patch, const StepContext<Dim>& step, auto own, auto mass,
                     auto add) {
  const Analysis& analysis = step.model->analysis;
  if (!analysis.sudden_velocities || !step.begins) return;
  const SumOverPatches<Dim> mapped(patch, NodeSum::mass_momentum, step.step);
  const auto reach = [&](Local node, const Vec<Dim>& axis, double velocity) {
    const double part = own(node);
    const bool is_active = patch.node_is_active[static_cast<std::size_t>(node)];
    if (velocity == 0.0 || !is_active || !more_than(mass(node), patch.least_mass)) return;
    double sum[node_width];
    store(mapped.at(node), sum);
    const double before = axis.dot(Eigen::Map<const Vec<Dim>>(sum)) / sum[mass_lane];
    patch.work.external += 0.5 * part * (velocity - before) * (velocity + before);
    add(node, Vec<Dim>((velocity - before) / step.dt * axis));
  };
  std::vector<bool> is_timed(patch.fixed.size());
  for (const Timed<Dim>& timed : patch.timed) {
    if (timed.list == Timed<Dim>::List::fixed_liquid || !is_held(patch, timed)) continue;
    if (timed.list == Timed<Dim>::List::fixed) is_timed[timed.entry] = true;
    reach(node_of(patch, timed), direction_of(patch, timed),
          velocity_at<Dim>(timed, step, step.time));
  }
  for (std::size_t i = 0; i < patch.fixed.size(); ++i)
    if (const auto& fixed = patch.fixed[i]; !is_timed[i])
      reach(fixed.node, Vec<Dim>::Unit(fixed.dir), fixed.velocity);
  for (const ConstrainedNode<Dim>& wall : patch.walls)
    for (int k = 0; k < Dim; ++k)
      if (const auto axis = static_cast<std::size_t>(k);
          wall.fixed[axis] && wall.function[axis] < 0)
        reach(wall.node, wall.axes.col(k), wall.velocity[axis]);
}

template <int Dim>
void add_to(NodeArray& array, Local node, const Vec<Dim>& a) {
  for (int d = 0; d < Dim; ++d) at(array, node)[d] += a[d];
}

template <int Dim>
auto own_mass_of(Patch<Dim>& patch, NodeSum which, const StepContext<Dim>& step) {
  const double* own = patch.own_sums(which, step.step) + mass_lane;
  return [own](Local node) { return own[static_cast<std::ptrdiff_t>(node) * sum_stride]; };
}

}  // namespace

template <int Dim>
void set_timed_velocities(Patch<Dim>& patch, const StepContext<Dim>& step) {
  using List = typename Timed<Dim>::List;
  for (const Timed<Dim>& timed : patch.timed) {
    const double w = timed.velocity * mean_factor(step, timed.function);
    if (timed.list == List::walls)
      patch.walls[timed.entry].velocity[static_cast<std::size_t>(timed.dir)] = w;
    else
      (timed.list == List::fixed ? patch.fixed : patch.fixed_liquid)[timed.entry].velocity = w;
  }
}

template <int Dim>
void hold_timed_walls(Patch<Dim>& patch) {
  for (const Timed<Dim>& timed : patch.timed) {
    if (timed.list != Timed<Dim>::List::walls || !is_held(patch, timed)) continue;
    const ConstrainedNode<Dim>& wall = patch.walls[timed.entry];
    const Vec<Dim> axis = wall.axes.col(timed.dir);
    Eigen::Map<Vec<Dim>> v(at(patch.velocity, wall.node)), a(at(patch.acceleration, wall.node));
    v += (wall.velocity[static_cast<std::size_t>(timed.dir)] - axis.dot(v)) * axis;
    a -= axis.dot(a) * axis;
  }
}

template <int Dim>
void add_timed_acceleration(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.active_nodes.empty()) return;
  const auto own = own_mass_of(patch, NodeSum::mass_momentum, step);
  const auto mass = [&](Local node) { return at(patch.velocity, node)[mass_lane]; };
  const auto add = [&](Local node, const Vec<Dim>& a) { add_to<Dim>(patch.acceleration, node, a); };
  for_each_acceleration(patch, step, false, own, mass, add);
  for_each_sudden(patch, step, own, mass, add);
}

template <int Dim>
void add_timed_acceleration_of_liquid(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (patch.timed.empty() || patch.active_nodes.empty()) return;
  for_each_acceleration(
      patch, step, true, own_mass_of(patch, NodeSum::liquid_mass_momentum, step),
      [&](Local node) { return at(patch.liquid.velocity, node)[mass_lane]; },
      [&](Local node, const Vec<Dim>& a) { add_to<Dim>(patch.liquid.acceleration, node, a); });
}

template <int Dim>
void add_timed_acceleration_of_implicit(Patch<Dim>& patch, const StepContext<Dim>& step) {
  if (step.model->analysis.implicit.quasi_static) return;
  const auto own = [&](Local node) {
    return patch.implicit.own_mass[static_cast<std::size_t>(node)];
  };
  const auto mass = [&](Local node) { return at(patch.velocity, node)[mass_lane]; };
  const auto add = [&](Local node, const Vec<Dim>& a) {
    add_to<Dim>(patch.acceleration, node, a);
    add_to<Dim>(patch.system.solution, node, a);
  };
  for_each_acceleration(patch, step, false, own, mass, add);
  for_each_sudden(patch, step, own, mass, add);
}

#define LAHAR_INSTANTIATE(Dim)                                                               \
  template void set_timed_velocities<Dim>(Patch<Dim>&, const StepContext<Dim>&);             \
  template void hold_timed_walls<Dim>(Patch<Dim>&);                                          \
  template void add_timed_acceleration<Dim>(Patch<Dim>&, const StepContext<Dim>&);           \
  template void add_timed_acceleration_of_liquid<Dim>(Patch<Dim>&, const StepContext<Dim>&); \
  template void add_timed_acceleration_of_implicit<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)
#undef LAHAR_INSTANTIATE

}  // namespace lahar
