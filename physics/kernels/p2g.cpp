/// \file Particle to grid: a bin of particles of one cell is accumulated in registers, then added
/// once to the cell's nodes in the patch's private arrays. No other patch writes them.
///
/// Q4 has few nodes and many particles per cell: lanes are particles, and the sums of all nodes are
/// reduced together. H8 has many nodes and few particles: lanes are the eight nodes, so that a
/// particle costs the same whatever else is in its cell, and nothing is reduced at all.
#include <algorithm>

#include "physics/basis/cell_map.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/mean_volume.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/particle_sums.h"
#include "physics/kernels/pressure_viscosity.h"
#include "physics/kernels/ring.h"
#include "physics/kernels/velocity_transfer.h"
#include "physics/materials/law.h"
#include "physics/particles/loads.h"

namespace lahar {

namespace {

LAHAR_INLINE void add_to_node(double* nodes, Local node, const NodeVector& value) {
  double* at = nodes + static_cast<std::ptrdiff_t>(node) * sum_stride;
  store(load<NodeVector>(at) + value, at);
}

using EightNodes = PackOf<8>;

LAHAR_INLINE void add_to_nodes(double* nodes, const std::array<Local, 8>& corner,
                               const EightNodes (&sum)[node_width]) {
  NodeVector rows[8];
  transpose(sum, rows);
  LAHAR_UNROLL
  for (std::size_t i = 0; i < 8; ++i) add_to_node(nodes, corner[i], rows[i]);
}

/// d w_d / d xi_d of the one-dimensional weight of axis d, at the eight corners.
alignas(64) constexpr double half[3][8] = {{-0.5, 0.5, -0.5, 0.5, -0.5, 0.5, -0.5, 0.5},
                                           {-0.5, -0.5, 0.5, 0.5, -0.5, -0.5, 0.5, 0.5},
                                           {-0.5, -0.5, -0.5, -0.5, 0.5, 0.5, 0.5, 0.5}};

/// Weight of axis d at the eight corners, for the particle whose natural coordinate is at xi.
LAHAR_INLINE EightNodes axis_weight(int d, const double* xi) {
  return multiply_add(EightNodes(0.5), load<EightNodes>(half[d]), xi);
}

/// Store packs of particles, to be read one by one.
template <std::size_t N, class Real>
LAHAR_INLINE void store_all(const Real (&value)[N], double (&to)[N][lanes<Real>]) {
  LAHAR_UNROLL
  for (std::size_t k = 0; k < N; ++k) store(value[k], to[k]);
}

/// Components of a node vector in use, as bits.
template <int Dim>
constexpr unsigned vector_and_mass = ((1u << Dim) - 1) | 1u << mass_lane;

/// Add sum_p N_i q_p over the particles of a bin to the components `Used` of its cell's nodes.
/// `values(p, n, q)` fills q for the particles from p on, with zero beyond the first n.
template <unsigned Used, class Real, class Map, class Values>
LAHAR_INLINE void scatter(const Map& map, const ParticleBin& bin,
                          const std::array<Local, 4>& corner, double* nodes, Values values) {
  Real sum[4 * node_width];
  LAHAR_UNROLL
  for (Real& s : sum) s = Real(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Weights<2, Real> w = weights_at<2, Real>(map, p);
    Real q[node_width];
    values(p, bin.end - p, q);
    LAHAR_UNROLL
    for (int i = 0; i < 4; ++i) {
      const Real N = w.N(i);
      LAHAR_UNROLL
      for (int k = 0; k < node_width; ++k)
        if (Used >> k & 1) sum[i * node_width + k] += N * q[k];
    }
  }
  alignas(64) double total[4 * node_width];
  reduce_all(sum, total);
  LAHAR_UNROLL
  for (std::size_t i = 0; i < 4; ++i)
    add_to_node(nodes, corner[i], load<NodeVector>(total + i * node_width));
}

template <unsigned Used, class Real, class Map, class Values>
LAHAR_INLINE void scatter(const Map& map, const ParticleBin& bin,
                          const std::array<Local, 8>& corner, double* nodes, Values values) {
  EightNodes sum[node_width];
  LAHAR_UNROLL
  for (EightNodes& s : sum) s = EightNodes(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    Real at[3], q[node_width];
    map.natural(p, at);
    values(p, n, q);
    alignas(64) double xi[3][lanes<Real>], value[node_width][lanes<Real>];
    store_all(at, xi);
    LAHAR_UNROLL
    for (int k = 0; k < node_width; ++k)
      if (Used >> k & 1) store(q[k], value[k]);
    for (Local j = 0; j < n; ++j) {
      const EightNodes N =
          axis_weight(0, &xi[0][j]) * axis_weight(1, &xi[1][j]) * axis_weight(2, &xi[2][j]);
      LAHAR_UNROLL
      for (int k = 0; k < node_width; ++k)
        if (Used >> k & 1) sum[k] = multiply_add(sum[k], N, &value[k][j]);
    }
  }
  add_to_nodes(nodes, corner, sum);
}

template <unsigned Used, int Dim, class Real, class Values>
LAHAR_INLINE void scatter_bins(const Patch<Dim>& patch, ParticleBins bins, double* nodes,
                               Values values) {
  for_each_bin(
      patch, bins, [&](const auto& map, const ParticleBin& bin) __attribute__((always_inline)) {
        scatter<Used, Real>(
            map, bin, patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)],
            nodes, [&](Local p, Local n, Real(&q)[node_width]) __attribute__((always_inline)) {
              values(bin, p, n, q);
            });
      });
}

}  // namespace

template <int Dim>
void clear_sums(Patch<Dim>& patch, const StepContext<Dim>& step, NodeSum which) {
  double* nodes = patch.own_sums(which, step.step);
  for (const NodeRange& range : patch.active_nodes)
    for (Local i = range.begin; i < range.end; ++i)
      store(NodeVector(0.0), nodes + static_cast<std::ptrdiff_t>(i) * sum_stride);
}

template <int Dim>
void clear_sums_with(Patch<Dim>& patch, const StepContext<Dim>& step, NodeSum which) {
  double* lines = patch.own_lines(which, step.step);
  for (const NodeRange& range : patch.active_nodes)
    std::fill(lines + static_cast<std::ptrdiff_t>(range.begin) * sum_stride,
              lines + static_cast<std::ptrdiff_t>(range.end) * sum_stride, 0.0);
}

template <int Dim, class Real>
void map_momentum_of(Patch<Dim>& patch, ParticleBins bins,
                     const general::ParticleMomentum<Dim>& particle, double* sums) {
  if (general::is(patch)) return general::map_momentum<Dim, Real>(patch, bins, particle, sums);
  scatter_bins<vector_and_mass<Dim>, Dim, Real>(
      patch, bins, sums,
      [ m = particle.m, v = particle.v ](const ParticleBin&, Local p, Local n, Real(&q)[node_width])
          __attribute__((always_inline)) {
            q[mass_lane] = load_first<Real>(m + p, n);
            LAHAR_UNROLL
            for (std::size_t d = 0; d < Dim; ++d) q[d] = q[mass_lane] * load<Real>(v[d] + p);
          });
}

template <int Dim, class Real>
void map_mass_momentum(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  map_momentum_of<Dim, Real>(patch, bins, general::ParticleMomentum<Dim>(patch.particles),
                             patch.own_sums(NodeSum::mass_momentum, step.step));
}

template <int Dim, class Real>
void map_momentum(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  map_momentum_of<Dim, Real>(patch, bins, general::ParticleMomentum<Dim>(patch.particles),
                             patch.own_sums(NodeSum::momentum, step.step));
}

template <int Dim, class Real>
void map_smoothed(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins, int order) {
  double* nodes = patch.own_sums(sum_of_order(order), step.step);
  const PressureViscosity<Dim> viscosity(patch, step, order);
  if (general::is(patch)) return general::map_smoothed<Dim, Real>(patch, viscosity, bins, nodes);
  const double *m = patch.particles.row(Column::mass), *v = patch.transfer.data();
  for_each_bin(
      patch, bins, [&](const auto& map, const ParticleBin& bin) __attribute__((always_inline)) {
        const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)];
        const bool viscous = viscosity.acts_on(bin);
        scatter<((1u << Dim) - 1) | 1u << mass_lane, Real>(
            map, bin, corner,
            nodes, [&](Local p, Local n, Real(&q)[node_width]) __attribute__((always_inline)) {
              const auto w = weights_at<Dim, Real>(map, p);
              LAHAR_UNROLL
              for (std::size_t i = 0; i < corners<Dim>; ++i) {
                const Real N = w.N(static_cast<int>(i));
                const double* at = v + static_cast<std::ptrdiff_t>(corner[i]) * node_width;
                LAHAR_UNROLL
                for (int d = 0; d < Dim; ++d)
                  q[d] = i == 0 ? multiply(N, at + d) : multiply_add(q[d], N, at + d);
              }
              const Real mass = load_first<Real>(m + p, n);
              LAHAR_UNROLL
              for (int d = 0; d < Dim; ++d) q[d] *= mass;
              q[mass_lane] = viscous ? viscosity.template of<Real>(p, n) : Real(0.0);
            });
      });
}

template <int Dim, class Real>
void map_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  if (!patch.particles.layout().has(Column::state)) return;
  if (general::is(patch))
    return general::map_pressure<Dim, Real>(patch, step, bins,
                                            patch.own_sums(NodeSum::pressure, step.step));
  const double* m = patch.particles.row(Column::mass);
  const double* pressure = patch.particles.row(Column::state);
  const auto& materials = step.model->materials;
  scatter_bins<1u, Dim, Real>(
      patch, bins, patch.own_sums(NodeSum::pressure, step.step),
      [&](const ParticleBin& bin, Local p, Local n, Real(&q)[node_width])
          __attribute__((always_inline)) {
            q[0] = has_pressure(materials[bin.material].law)
                       ? load_first<Real>(m + p, n) * load<Real>(pressure + p)
                       : Real(0.0);
          });
}

namespace {

/// T[a][k] = sum_d S_ad dxi_k/dx_d of the first n particles from p on (but for factors
/// Map::finish), S as a `Stress` of particle_sums.h gives it: the internal force of node i is
/// -sum_p sum_k T[a][k] dN_i/dxi_k.
template <class Stress>
struct Pulled {
  Stress stress;

  template <class Real, int Dim, class Map>
  LAHAR_INLINE void at(const Map& map, Local p, Local n, Real (&T)[Dim][Dim]) const {
    Real S[Dim][Dim];
    stress.at(p, n, S);
    map.pull_back(p, S, T);
  }
};

/// V sigma of a fluid without its pressure.
template <int Dim>
struct StressWithoutPressure {
  general::ParticleStress<Dim> whole;
  const double* pressure;

  template <class Real>
  LAHAR_INLINE void at(Local p, Local n, Real (&S)[Dim][Dim]) const {
    whole.at(p, n, S);
    const Real pushed = load_first<Real>(whole.V + p, n) * load<Real>(pressure + p);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) S[d][d] += pushed;
  }
};

/// Internal force of one bin in 2D. With corners paired across each axis the gradient is +- face
/// weight, so that one sum serves both corners of a pair.
template <class Real, class Map, class Stress>
LAHAR_INLINE void internal_force(const Map& map, const Stress& stress, const ParticleBin& bin,
                                 const std::array<Local, 4>& corner, double* nodes) {
  Real sum[8];  // 4 k + 2 c + a: axis, corner of the face normal to it, component
  LAHAR_UNROLL
  for (Real& s : sum) s = Real(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    Real T[2][2];
    stress.at(map, p, bin.end - p, T);
    const Weights<2, Real> w = weights_at<2, Real>(map, p);
    LAHAR_UNROLL
    for (int k = 0; k < 2; ++k) LAHAR_UNROLL
    for (int c = 0; c < 2; ++c) LAHAR_UNROLL
    for (int a = 0; a < 2; ++a) sum[4 * k + 2 * c + a] += T[a][k] * w.face(k, c);
  }
  alignas(64) double total[8];
  reduce_all(sum, total);
  LAHAR_UNROLL
  for (int i = 0; i < 4; ++i) {
    double* f =
        nodes + static_cast<std::ptrdiff_t>(corner[static_cast<std::size_t>(i)]) * sum_stride;
    const double along_x = (i & 1 ? -0.5 : 0.5) * map.finish(0);
    const double along_y = (i & 2 ? -0.5 : 0.5) * map.finish(1);
    LAHAR_UNROLL
    for (int a = 0; a < 2; ++a)
      f[a] += along_x * total[2 * (i >> 1) + a] + along_y * total[4 + 2 * (i & 1) + a];
  }
}

/// The same in 3D, lanes are the cell's nodes.
template <class Real, class Map, class Stress>
LAHAR_INLINE void internal_force(const Map& map, const Stress& stress, const ParticleBin& bin,
                                 const std::array<Local, 8>& corner, double* nodes) {
  EightNodes sum[9];  // 3 a + k: component, axis
  LAHAR_UNROLL
  for (EightNodes& s : sum) s = EightNodes(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    Real at[3], T[3][3];
    map.natural(p, at);
    stress.at(map, p, n, T);
    alignas(64) double xi[3][lanes<Real>], pulled[9][lanes<Real>];
    store_all(at, xi);
    LAHAR_UNROLL
    for (int ak = 0; ak < 9; ++ak) store(T[ak / 3][ak % 3], pulled[ak]);
    for (Local j = 0; j < n; ++j) {
      EightNodes w[3];
      LAHAR_UNROLL
      for (int d = 0; d < 3; ++d) w[d] = axis_weight(d, &xi[d][j]);
      LAHAR_UNROLL
      for (int k = 0; k < 3; ++k) {
        const EightNodes face = w[(k + 1) % 3] * w[(k + 2) % 3];
        LAHAR_UNROLL
        for (int a = 0; a < 3; ++a)
          sum[3 * a + k] = multiply_add(sum[3 * a + k], face, &pulled[3 * a + k][j]);
      }
    }
  }
  EightNodes force[node_width];
  force[mass_lane] = EightNodes(0.0);
  LAHAR_UNROLL
  for (int a = 0; a < 3; ++a) {
    force[a] = EightNodes(0.0);
    LAHAR_UNROLL
    for (int k = 0; k < 3; ++k)
      force[a] -= sum[3 * a + k] * (load<EightNodes>(half[k]) * map.finish(k));
  }
  add_to_nodes(nodes, corner, force);
}

/// Force of the pressure of a bin's fluid: sum_p V_p p_p grad N_i at the cell's centre, whose
/// volumetric strain the fluid has (B-bar, Hughes 1980). So forces do the work of the stresses.
template <int Dim, class Real, class Map>
LAHAR_INLINE void pressure_force(const Map& map, const StressWithoutPressure<Dim>& fluid,
                                 const ParticleBin& bin,
                                 const std::array<Local, corners<Dim>>& corner, double* nodes) {
  Real pushed(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>)
    pushed += load_first<Real>(fluid.whole.V + p, bin.end - p) * load<Real>(fluid.pressure + p);
  const double total = reduce(pushed);  // [J]
  double dN[Dim][corners<Dim>];
  centre_gradients(map, dN);
  for (std::size_t i = 0; i < corner.size(); ++i) {
    double* f = nodes + static_cast<std::ptrdiff_t>(corner[i]) * sum_stride;
    for (int a = 0; a < Dim; ++a) f[a] += total * dN[a][i];
  }
}

/// Forces of stresses in the plane of a model, or in space, and of particles' own forces.
template <int Dim, class Real>
void map_plane_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                     const general::ParticleStress<Dim>& given) {
  double* nodes = patch.own_sums(NodeSum::force, step.step);
  if (general::is(patch)) return general::map_force<Dim, Real>(patch, step, bins, given, nodes);
  const Pulled<general::ParticleStress<Dim>> stress{given};
  for_each_bin(
      patch, bins, [&](const auto& map, const ParticleBin& bin) __attribute__((always_inline)) {
        const auto& corner = patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)];
        if (acts_at_centre(patch, step, bin)) {
          const Pulled<StressWithoutPressure<Dim>> rest{
              {stress.stress, patch.particles.row(Column::state)}};
          internal_force<Real>(map, rest, bin, corner, nodes);
          pressure_force<Dim, Real>(map, rest.stress, bin, corner, nodes);
        } else {
          internal_force<Real>(map, stress, bin, corner, nodes);
        }
        add_own_forces(LinearBasis<Dim, std::decay_t<decltype(map)>>{map}, patch, step, bin,
                       corner.data(), nodes);
      });
}

}  // namespace

template <int Dim, class Real>
void map_force_of(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                  general::ParticleStress<Dim> stress) {
  if constexpr (Dim == 2)
    if (step.model->analysis.plane == Plane::axisymmetric) {
      for (ParticleBin& bin : bins) {  // sums do not depend on which bins come together
        if (bin.begin == bin.end) continue;
        map_plane_force<Dim, Real>(patch, step, ParticleBins(&bin, 1), stress);
        map_hoop_force<Real>(patch, step, bin, stress);
      }
      return;
    }
  map_plane_force<Dim, Real>(patch, step, bins, stress);
}

template <int Dim, class Real>
void map_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  map_force_of<Dim, Real>(patch, step, bins, general::ParticleStress<Dim>(patch.particles));
}

template <int Dim, class Real>
void map_gradient_of(Patch<Dim>& patch, ParticleBins bins, const double* V, double* sums) {
  if (general::is(patch)) return general::map_gradient<Dim, Real>(patch, bins, V, sums);
  const Pulled<general::UnitPressure<Dim>> pressure{{V}};
  for_each_bin(
      patch, bins, [&](const auto& map, const ParticleBin& bin) __attribute__((always_inline)) {
        internal_force<Real>(map, pressure, bin,
                             patch.topology.corner_nodes[static_cast<std::size_t>(bin.cell)], sums);
      });
}

template <int Dim, class Real>
void map_gradient(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins) {
  map_gradient_of<Dim, Real>(patch, bins, patch.particles.row(Column::volume),
                             patch.own_sums(NodeSum::gradient, step.step));
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                              \
  template void map_gradient<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);      \
  template void map_mass_momentum<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins); \
  template void map_momentum_of<Dim, Real>(Patch<Dim>&, ParticleBins,                             \
                                           const general::ParticleMomentum<Dim>&, double*);       \
  template void map_gradient_of<Dim, Real>(Patch<Dim>&, ParticleBins, const double*, double*);    \
  template void map_force_of<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins,       \
                                        general::ParticleStress<Dim>);                            \
  template void map_momentum<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);      \
  template void map_pressure<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);      \
  template void map_smoothed<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins, int); \
  template void map_force<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)
template void clear_sums<2>(Patch<2>&, const StepContext<2>&, NodeSum);
template void clear_sums<3>(Patch<3>&, const StepContext<3>&, NodeSum);
template void clear_sums_with<2>(Patch<2>&, const StepContext<2>&, NodeSum);
template void clear_sums_with<3>(Patch<3>&, const StepContext<3>&, NodeSum);

}  // namespace lahar
