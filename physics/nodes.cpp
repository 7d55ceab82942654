/// Nodal kernels. Every patch that holds a node does the same arithmetic in the same order on the
/// same sums, so that all copies of a node are identical.
#include <cmath>

#include "physics/kernels.h"
#include "physics/loads.h"

namespace lahar {

template <int Dim>
void sum_over_patches(Patch<Dim>& patch, NodeSum which) {
  const int k = static_cast<int>(which);
  const int width = node_sum_width<Dim>[k];
  const auto& topology = patch.topology;
  auto& total = patch.total[k];
  total = patch.partial[k];
  for (std::size_t s = 0; s < topology.shared_node.size(); ++s) {
    double sum[4] = {0, 0, 0, 0};
    for (Local e = topology.first[s]; e < topology.first[s + 1]; ++e) {
      const auto& share = topology.shares[static_cast<std::size_t>(e)];
      const double* from =
          share.neighbour < 0
              ? patch.partial[k].data()
              : patch.neighbour_partial[k][static_cast<std::size_t>(share.neighbour)];
      from += static_cast<std::ptrdiff_t>(share.node) * width;
      for (int c = 0; c < width; ++c) sum[c] += from[c];
    }
    double* to = total.data() + static_cast<std::ptrdiff_t>(topology.shared_node[s]) * width;
    for (int c = 0; c < width; ++c) to[c] = sum[c];
  }
}

namespace {

double flushed(double value) {
  return std::abs(value) < least_nodal_velocity ? 0.0 : value;
}

constexpr int mass_width = 4;
static_assert(node_sum_width<2>[0] == mass_width && node_sum_width<3>[0] == mass_width);

}  // namespace

template <int Dim>
void nodal_velocity(Patch<Dim>& patch, NodeSum which) {
  const double* mass = patch.total[static_cast<int>(NodeSum::mass_momentum)].data();
  // {m, m v} and {m v} differ in where the momentum begins.
  const bool first = which == NodeSum::mass_momentum;
  const double* momentum = patch.total[static_cast<int>(which)].data() + (first ? 1 : 0);
  const int width = node_sum_width<Dim>[static_cast<int>(which)];
  for (Local i = 0; i < patch.n_nodes(); ++i) {
    const double m = mass[i * mass_width];
    for (int d = 0; d < Dim; ++d)
      patch.velocity[i * Dim + d] =
          m > 0.1 * patch.least_mass ? flushed(momentum[i * width + d] / m) : 0.0;
  }
  for (const auto& fixed : patch.fixed)
    patch.velocity[fixed.node * Dim + fixed.dir] = fixed.velocity;
}

namespace {

constexpr int mass_index = static_cast<int>(NodeSum::mass_momentum);
constexpr int force_index = static_cast<int>(NodeSum::force);

/// Work at the nodes over the step, with the mean of the velocities before and after it, v - dt a /
/// 2: the kinetic energy of the nodes changes by exactly this work. A node's work is shared among
/// its patches as its mass is: those without particles, which may not get here, have none of it.
/// The force sums hold the damping forces by now.
template <int Dim>
void add_work(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const Model<Dim>& model = *step.model;
  const double* mass = patch.total[mass_index].data();
  const double* own_mass = patch.partial[mass_index].data();
  const double* damping = patch.total[force_index].data();
  constexpr int width = node_sum_width<Dim>[force_index];
  const auto mean_move = [&](Local i, int d) {
    return step.dt *
           (patch.velocity[i * Dim + d] - 0.5 * step.dt * patch.acceleration[i * Dim + d]);
  };
  for (Local i = 0; i < patch.n_nodes(); ++i) {
    const double m = mass[i * mass_width], own = own_mass[i * mass_width];
    if (!(m > patch.least_mass)) continue;
    for (int d = 0; d < Dim; ++d) {
      patch.work.external += own * model.gravity[d] * mean_move(i, d);
      patch.work.damping += own / m * damping[i * width + d] * mean_move(i, d);
    }
  }
  for (const auto& point : patch.forces)
    if (const double m = mass[point.node * mass_width]; m > patch.least_mass)
      patch.work.external += own_mass[point.node * mass_width] / m * point.force *
                             load_factor(model, point.function, step.time) *
                             mean_move(point.node, point.dir);
}

}  // namespace

template <int Dim>
void integrate(Patch<Dim>& patch, const StepContext<Dim>& step) {
  const Model<Dim>& model = *step.model;
  const double* mass = patch.total[mass_index].data();
  double* force = patch.total[force_index].data();
  constexpr int width = node_sum_width<Dim>[force_index];
  const double alpha = model.analysis.damping;

  for (const auto& point : patch.forces)
    force[point.node * width + point.dir] +=
        point.force * load_factor(model, point.function, step.time);

  for (Local i = 0; i < patch.n_nodes(); ++i) {
    const double m = mass[i * mass_width];
    double* v = &patch.velocity[i * Dim];
    double* a = &patch.acceleration[i * Dim];
    if (!(m > patch.least_mass)) {
      for (int d = 0; d < Dim; ++d) a[d] = 0.0;
      continue;
    }
    double f[Dim], norm = 0.0;
    for (int d = 0; d < Dim; ++d) {
      f[d] = force[i * width + d] + m * model.gravity[d];
      norm += f[d] * f[d];
    }
    const double damping = alpha > 0.0 ? alpha * std::sqrt(norm) : 0.0;
    for (int d = 0; d < Dim; ++d) {
      const double against = v[d] > 0.0 ? damping : v[d] < 0.0 ? -damping : 0.0;
      a[d] = (f[d] - against) / m;
      v[d] = flushed(v[d] + step.dt * a[d]);
      force[i * width + d] = against;
    }
  }

  const double* own_mass = patch.partial[mass_index].data();
  for (const auto& fixed : patch.fixed) {
    double& v = patch.velocity[fixed.node * Dim + fixed.dir];
    // Work of the reaction.
    patch.work.external +=
        own_mass[fixed.node * mass_width] * (fixed.velocity - v) * fixed.velocity;
    v = fixed.velocity;
    patch.acceleration[fixed.node * Dim + fixed.dir] = 0.0;
  }
  add_work(patch, step);
}

#define LAHAR_INSTANTIATE(Dim)                               \
  template void sum_over_patches<Dim>(Patch<Dim>&, NodeSum); \
  template void nodal_velocity<Dim>(Patch<Dim>&, NodeSum);   \
  template void integrate<Dim>(Patch<Dim>&, const StepContext<Dim>&);
LAHAR_INSTANTIATE(2)
LAHAR_INSTANTIATE(3)

}  // namespace lahar
