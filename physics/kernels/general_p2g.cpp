/// \file Particle to grid for bases of any support. Where functions are given one by one lanes are
/// particles; where they are products of functions of one axis, tensor_p2g.h sums, and
/// for quadratic splines in 3D spline_p2g.cpp.
#include <algorithm>

#include "physics/basis/basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/particle_sums.h"
#include "physics/kernels/tensor_p2g.h"
#include "physics/materials/law.h"
#include "physics/particles/loads.h"

namespace lahar::general {

namespace {

/// Add totals, `Width` for each node of a cell, to the nodes' components `lane(k)`. (Where they are
/// not all components, one by one: a vector of values that were stored singly can be loaded only
/// when they have left for the cache.)
template <int Nodes, int Width, class Lane>
LAHAR_INLINE void add_to_nodes(const double* total, const Local* nodes, double* sums, Lane lane) {
  for (int i = 0; i < Nodes; ++i) {
    if constexpr (Width == node_width) {
      add_to_node(sums, nodes[i], load<NodeVector>(total + i * Width));
    } else {
      double* at = sums + static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride;
      LAHAR_UNROLL
      for (int k = 0; k < Width; ++k) at[lane(k)] += total[i * Width + k];
    }
  }
}

/// Add sum_p N_i q_p over a bin to components `lane(k)`, k < Width, of its cell's nodes.
/// `values(p, n, q)` fills q for the particles from p on.
template <int Dim, int Width, class Real, class Basis, class Values, class Lane>
LAHAR_INLINE void scatter(const Basis& basis, const ParticleBin& bin, const Local* nodes,
                          double* sums, Values values, Lane lane) {
  constexpr int n_sums = (Basis::nodes * Width + 7) / 8 * 8;  // reduced eight at a time
  Real sum[n_sums];
  for (Real& s : sum) s = Real(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    Real N[Basis::nodes], q[Width];
    basis.functions(p, N);
    values(p, bin.end - p, q);
    LAHAR_UNROLL
    for (int i = 0; i < Basis::nodes; ++i) LAHAR_UNROLL
    for (int k = 0; k < Width; ++k) sum[i * Width + k] += N[i] * q[k];
  }
  alignas(64) double total[n_sums];
  reduce_all(sum, total);
  add_to_nodes<Basis::nodes, Width>(total, nodes, sums, lane);
}

/// {m v, m}_i += sum_p N_i m_p {v_p + C_p (x_i - x_p), 1}, from the nodes' positions.
template <int Dim, class Real, class Basis>
LAHAR_INLINE void affine_momentum(const Basis& basis, const ParticleMomentum<Dim>& particle,
                                  const Patch<Dim>& patch, const ParticleBin& bin,
                                  const Local* nodes, double* sums) {
  constexpr int n_sums = (Basis::nodes * (Dim + 1) + 7) / 8 * 8;
  Real sum[n_sums];
  for (Real& s : sum) s = Real(0.0);
  const auto position = [&](int i) {
    return &patch.node_position[static_cast<std::size_t>(nodes[i]) * node_width];
  };
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    Real N[Basis::nodes], m, v[Dim], C[Dim][Dim], x[Dim];
    basis.functions(p, N);
    particle.at(p, bin.end - p, m, v, C);
    LAHAR_UNROLL
    for (int d = 0; d < Dim; ++d) {  // where its natural coordinates are: functions are linear
      x[d] = Real(0.0);
      LAHAR_UNROLL
      for (int i = 0; i < Basis::nodes; ++i) x[d] = multiply_add(x[d], N[i], position(i) + d);
    }
    for (int i = 0; i < Basis::nodes; ++i) {
      Real to_node[Dim];
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) to_node[d] = broadcast<Real>(position(i) + d) - x[d];
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) {
        Real momentum = v[a];
        LAHAR_UNROLL
        for (int d = 0; d < Dim; ++d) momentum += C[a][d] * to_node[d];
        sum[i * (Dim + 1) + a] += momentum * N[i];
      }
      sum[i * (Dim + 1) + Dim] += N[i] * m;
    }
  }
  alignas(64) double total[n_sums];
  reduce_all(sum, total);
  add_to_nodes<Basis::nodes, Dim + 1>(total, nodes, sums,
                                      [](int k) { return k == Dim ? mass_lane : k; });
}

/// Internal force of a bin: -sum_p S_p grad N_i.
template <int Dim, class Real, class Basis, class Stress>
LAHAR_INLINE void internal_force(const Basis& basis, const Stress& stress, const ParticleBin& bin,
                                 const Local* nodes, double* sums) {
  constexpr int n_sums = (Basis::nodes * Dim + 7) / 8 * 8;
  Real sum[n_sums];
  for (Real& s : sum) s = Real(0.0);
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    Real S[Dim][Dim];
    stress.at(p, bin.end - p, S);
    if constexpr (NaturalBasis<Basis>) {
      Real dN[Basis::nodes][Dim], to_natural[Dim][Dim], T[Dim][Dim];
      basis.natural_gradients(p, dN, to_natural);
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
      for (int k = 0; k < Dim; ++k) {  // the stress as natural gradients see it
        T[a][k] = -S[a][0] * to_natural[k][0];
        LAHAR_UNROLL
        for (int b = 1; b < Dim; ++b) T[a][k] -= S[a][b] * to_natural[k][b];
      }
      LAHAR_UNROLL
      for (int i = 0; i < Basis::nodes; ++i) LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
      for (int k = 0; k < Dim; ++k) sum[i * Dim + a] = fma(T[a][k], dN[i][k], sum[i * Dim + a]);
    } else {
      Real dN[Dim][Basis::nodes];
      basis.gradients(p, dN);
      LAHAR_UNROLL
      for (int i = 0; i < Basis::nodes; ++i) LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
      for (int b = 0; b < Dim; ++b) sum[i * Dim + a] -= S[a][b] * dN[b][i];
    }
  }
  alignas(64) double total[n_sums];
  reduce_all(sum, total);
  add_to_nodes<Basis::nodes, Dim>(total, nodes, sums, [](int a) { return a; });
}

}  // namespace

template <int Dim, class Real>
void map_momentum(Patch<Dim>& patch, ParticleBins bins, const ParticleMomentum<Dim>& particle,
                  double* sums) {
  if constexpr (Dim == 3)
    if (patch.basis == BasisKind::quadratic_spline)
      return map_spline_momentum<Real>(patch, bins, particle, sums);
  const bool affine = particle.is_affine();
  if (has_corners(patch) && !affine)
    return map_domain_momentum<Dim, Real>(patch, bins, particle, sums);
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            if (affine) return affine_momentum<Dim, Real>(basis, particle, patch, bin, nodes, sums);
            scatter<Dim, Dim + 1, Real>(
                basis, bin, nodes, sums,
                [&](Local p, Local n, Real(&q)[Dim + 1]) __attribute__((always_inline)) {
                  q[Dim] = load_first<Real>(particle.m + p, n);
                  LAHAR_UNROLL
                  for (std::size_t d = 0; d < Dim; ++d)
                    q[d] = q[Dim] * load<Real>(particle.v[d] + p);
                },
                [](int k) { return k == Dim ? mass_lane : k; });
          });
}

template <int Dim, class Real>
void map_smoothed(Patch<Dim>& patch, const PressureViscosity<Dim>& viscosity, ParticleBins bins,
                  double* sums) {
  const double* m = patch.particles.row(Column::mass);
  const double* const field[1] = {patch.transfer.data()};
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            const auto values = [&]<int Width>(Local p, Local n, Real(&q)[Width])
                __attribute__((always_inline)) {
              Real v[1][Dim];
              interpolate<Dim, 1>(basis, p, field, nodes, v);
              const Real mass = load_first<Real>(m + p, n);
              LAHAR_UNROLL
              for (int d = 0; d < Dim; ++d) q[d] = mass * v[0][d];
              if constexpr (Width > Dim) q[Dim] = viscosity.template of<Real>(p, n);
            };
            if (viscosity.acts_on(bin))
              scatter<Dim, Dim + 1, Real>(basis, bin, nodes, sums, values,
                                          [](int k) { return k == Dim ? mass_lane : k; });
            else
              scatter<Dim, Dim, Real>(basis, bin, nodes, sums, values, [](int k) { return k; });
          });
}

template <int Dim, class Real>
void map_pressure(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                  double* sums) {
  if constexpr (Dim == 3)
    if (patch.basis == BasisKind::quadratic_spline)
      return map_spline_pressure<Real>(patch, step, bins, sums);
  const double* m = patch.particles.row(Column::mass);
  const double* pressure = patch.particles.row(Column::state);
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            if (!has_pressure(step.model->materials[bin.material].law)) return;
            scatter<Dim, 1, Real>(
                basis, bin, nodes, sums,
                [=](Local p, Local n, Real(&q)[1]) __attribute__((always_inline)) {
                  q[0] = load_first<Real>(m + p, n) * load<Real>(pressure + p);
                },
                [](int k) { return k; });
          });
}

template <int Dim, class Real>
void map_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
               ParticleStress<Dim> stress, double* sums) {
  if constexpr (Dim == 3)
    if (patch.basis == BasisKind::quadratic_spline)
      return map_spline_force<Real>(patch, step, bins, stress, sums);
  if (has_corners(patch)) return map_domain_force<Dim, Real>(patch, step, bins, stress, sums);
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            internal_force<Dim, Real>(basis, stress, bin, nodes, sums);
            add_own_forces(basis, patch, step, bin, nodes, sums);
          });
}

template <int Dim, class Real>
void map_gradient(Patch<Dim>& patch, ParticleBins bins, const double* V, double* sums) {
  if constexpr (Dim == 3)
    if (patch.basis == BasisKind::quadratic_spline)
      return map_spline_gradient<Real>(patch, bins, V, sums);
  if (has_corners(patch)) return map_domain_gradient<Dim, Real>(patch, bins, V, sums);
  const UnitPressure<Dim> pressure{V};
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes) __attribute__((
          always_inline)) { internal_force<Dim, Real>(basis, pressure, bin, nodes, sums); });
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                              \
  template void map_momentum<Dim, Real>(Patch<Dim>&, ParticleBins, const ParticleMomentum<Dim>&,  \
                                        double*);                                                 \
  template void map_gradient<Dim, Real>(Patch<Dim>&, ParticleBins, const double*, double*);       \
  template void map_smoothed<Dim, Real>(Patch<Dim>&, const PressureViscosity<Dim>&, ParticleBins, \
                                        double*);                                                 \
  template void map_pressure<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins,       \
                                        double*);                                                 \
  template void map_force<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins,          \
                                     ParticleStress<Dim>, double*);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)

}  // namespace lahar::general
