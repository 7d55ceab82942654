#include "physics/kernels/separation.h"

#include <algorithm>

#include "physics/kernels/affine_velocity.h"
#include "physics/kernels/particle_update.h"

namespace lahar {

namespace {

/// A particle does not reach a node where the node's function is at most this [-]: rounding.
constexpr double least_function = 1e-12;

}  // namespace

template <int Dim>
void find_held_nodes(Patch<Dim>& patch, const StepContext<Dim>&) {
  if (patch.active_nodes.empty()) return;
  const auto size = static_cast<std::size_t>(patch.n_nodes()) * node_width;
  if (patch.held.size() < size) patch.held.resize(size);
  const auto entry = [&](Local i) {
    return patch.held.data() + static_cast<std::ptrdiff_t>(i) * node_width;
  };
  for (const NodeRange& range : patch.active_nodes)
    std::fill(entry(range.begin), entry(range.end), 0.0);
  const auto hold = [&](Local i, int d) { entry(i)[d] = entry(i)[mass_lane] = 1.0; };
  const auto hold_all = [&](Local i) {
    for (int d = 0; d < Dim; ++d) hold(i, d);
  };
  for (const auto& fixed : patch.fixed) hold(fixed.node, fixed.dir);
  for (const auto& wall : patch.walls) hold_all(wall.node);
  for_each_acting_list(patch.acting, [&](const auto& list) {
    for (const auto& at : list) hold_all(at.node);
  });
  for (const auto& driven : patch.driven)
    for (int d = 0; d < Dim; ++d)
      if (driven.driven[static_cast<std::size_t>(d)]) hold(driven.node, d);
  for (const auto& meeting : patch.contact.meetings) {
    hold_all(meeting.a);
    hold_all(meeting.b);
  }
}

namespace general {

namespace {

/// det(I + dt L) - 1.
template <class Real>
LAHAR_INLINE Real expansion(const Real (&L)[2][2], double dt) {
  return dt * (trace(L) + dt * (L[0][0] * L[1][1] - L[0][1] * L[1][0]));
}
template <class Real>
LAHAR_INLINE Real expansion(const Real (&L)[3][3], double dt) {
  const auto minor = [&](int a, int b, int c, int d) __attribute__((always_inline)) {
    return L[a][c] * L[b][d] - L[a][d] * L[b][c];
  };
  const Real second = minor(0, 1, 0, 1) + minor(0, 2, 0, 2) + minor(1, 2, 1, 2);
  const Real third =
      L[0][0] * minor(1, 2, 1, 2) - L[0][1] * minor(1, 2, 0, 2) + L[0][2] * minor(1, 2, 0, 1);
  return dt * (trace(L) + dt * (second + dt * third));
}

/// Places move with a share of the particle's own velocity.
template <int Dim, class Real>
struct MovesApart {
  Real beta[Dim];

  LAHAR_INLINE Real operator()(std::size_t d, const Real& v, const Real& own) const {
    return v + beta[d] * (own - v);
  }
};

template <int Dim, class Real, class Basis>
[[gnu::noinline]] void let_go(const Basis& basis, Local p, const double* held, const Local* nodes,
                              Real (&beta)[Dim]) {
  const double* const fields[1] = {held};
  Real reached[1][Dim];
  interpolate<Dim, 1>(basis, p, fields, nodes, reached);
  for (int d = 0; d < Dim; ++d)
    beta[d] = select(greater(reached[0][d], Real(least_function)), Real(0.0), beta[d]);
}

/// Fields of the nodes at the particles from p on.
template <int Dim, class Real, class Basis>
LAHAR_INLINE void fields_at(const Basis& basis, Affine affine, Local p, const double* v,
                            const double* spread, const double* a, const Local* nodes,
                            Fields<Dim, Real>& at) {
  if constexpr (TensorBasis<Basis>) {
    AxisWeights<Dim, Real> by;
    basis.weights(p, by.w, by.dw);
    basis.moments(p, by.w, by.dw, by.m);
    with_weights<Wanted{true, true}>(by, v, a, nodes, at);
    if (affine == Affine::tpic)
      for (int d = 0; d < Dim; ++d)
        for (int b = 0; b < Dim; ++b) at.C[d][b] = at.L[d][b];
  } else {
    const double* const fields[2] = {v, a};
    Real sum[2][Dim];
    interpolate<Dim, 2>(basis, p, fields, nodes, sum);
    for (int d = 0; d < Dim; ++d) at.v[d] = sum[0][d], at.a[d] = sum[1][d];
    gradient<Dim, Real>(basis, p, v, nodes, at.L);
    affine_part<Dim>(basis, affine, p, spread, nodes, at.C);
  }
}

}  // namespace

template <int Dim, class Real>
void update_separable(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      VelocityGradients<Dim>* gradients) {
  if (gradients) gradients->make_room(bins, lanes<Real>);
  VelocityUpdates<Dim> updates(patch, step);
  const Analysis& analysis = step.model->analysis;
  const MovedRows<Dim> rows(patch.particles);
  const auto affine = patch.particles.template rows<Dim * Dim>(Column::affine);
  const double *v = patch.velocity.data(), *a = updates.field(patch), *held = patch.held.data();
  const double* spread = spreads_before_forces(analysis) ? patch.transfer.data() : v;
  PrescribedMotion<Dim> prescribed(patch, step);
  Advanced<Real> all;
  const auto update_bin = [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
      __attribute__((always_inline)) {
    constexpr int n_nodes = std::decay_t<decltype(basis)>::nodes;
    const bool near = std::any_of(nodes, nodes + n_nodes, [&](Local i) {
      return held[static_cast<std::ptrdiff_t>(i) * node_width + mass_lane] != 0.0;
    });
    const auto of_cell = rate_of_cell<Dim>(basis, analysis, v, nodes);
    const VelocityUpdate update = updates.of(bin);
    auto to = gradients ? gradients->begin(bin, bins) : 0;
    prescribed.begin(bin);
    for (Local p = bin.begin; p < bin.end; p += lanes<Real>, to += lanes<Real>) {
      const Local n = bin.end - p;
      Fields<Dim, Real> at;
      fields_at<Dim>(basis, analysis.affine, p, v, spread, a, nodes, at);
      LAHAR_UNROLL
      for (std::size_t k = 0; k < Dim * Dim; ++k)
        store_first(at.C[k / Dim][k % Dim], affine[k] + p, n);
      if (gradients) gradients->put(to, at.L, of_cell ? Real(*of_cell) : trace(at.L));
      const Real beta = select(greater(Real(0.0), expansion(at.L, step.dt)), Real(0.0),
                               Real(analysis.transfer.separation));
      MovesApart<Dim, Real> apart;
      LAHAR_UNROLL
      for (Real& along : apart.beta) along = beta;
      if (near) let_go(basis, p, held, nodes, apart.beta);
      advance(rows, p, n, at.v, at.a, Real(0.0), update, step.dt, updates.mass(), all, apart);
    }
    prescribed.end(bin);
  };
  for_each_general_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes)
          __attribute__((always_inline)) {
            // Corners that move with the nodes do not go together with particles that part from
            // them.
            if constexpr (!moves_corners<Dim, std::decay_t<decltype(basis)>>)
              update_bin(basis, bin, nodes);
          });
  note(patch, all);
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                            \
  template void update_separable<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins, \
                                            VelocityGradients<Dim>*);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)
#undef LAHAR_INSTANTIATE

}  // namespace general

template void find_held_nodes<2>(Patch<2>&, const StepContext<2>&);
template void find_held_nodes<3>(Patch<3>&, const StepContext<3>&);

}  // namespace lahar
