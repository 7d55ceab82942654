/// Velocity gradients at particles, for bases of any support.
#include "physics/basis.h"
#include "physics/support_kernels.h"

namespace lahar::supported {

namespace {

/// L[a][b] = sum_i v_a dN_i/dx_b at every lane. One axis after the other: first along x, then y.
template <int Dim, class Real, TensorBasis Basis>
LAHAR_INLINE void gradient(const Basis& basis, Local p, const double* v, const Local* nodes,
                           Real (&L)[Dim][Dim]) {
  Real w[Dim][axis_nodes], dw[Dim][axis_nodes];
  basis.weights(p, w, dw);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) L[a][b] = Real(0.0);
  for (int z = 0; z < (Dim == 3 ? axis_nodes : 1); ++z) {
    Real by_x[Dim], by_y[Dim], sum[Dim];
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) by_x[a] = by_y[a] = sum[a] = Real(0.0);
    for (int y = 0; y < axis_nodes; ++y) {
      const Local* node = nodes + 16 * z + 4 * y;
      Real along[Dim], slope[Dim];
      LAHAR_UNROLL
      for (int x = 0; x < axis_nodes; ++x) {
        const double* value = v + static_cast<std::ptrdiff_t>(node[x]) * node_width;
        LAHAR_UNROLL
        for (int a = 0; a < Dim; ++a) {
          along[a] =
              x == 0 ? multiply(w[0][x], value + a) : multiply_add(along[a], w[0][x], value + a);
          slope[a] =
              x == 0 ? multiply(dw[0][x], value + a) : multiply_add(slope[a], dw[0][x], value + a);
        }
      }
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) {
        by_x[a] += w[1][y] * slope[a];
        by_y[a] += dw[1][y] * along[a];
        if constexpr (Dim == 3) sum[a] += w[1][y] * along[a];
      }
    }
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) {
      if constexpr (Dim == 2) {
        L[a][0] = by_x[a];
        L[a][1] = by_y[a];
      } else {
        L[a][0] += w[2][z] * by_x[a];
        L[a][1] += w[2][z] * by_y[a];
        L[a][2] += dw[2][z] * sum[a];
      }
    }
  }
}

template <int Dim, class Real, class Basis>
LAHAR_INLINE void gradient(const Basis& basis, Local p, const double* v, const Local* nodes,
                           Real (&L)[Dim][Dim]) {
  Real dN[Dim][Basis::nodes];
  basis.gradients(p, dN);
  LAHAR_UNROLL
  for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
  for (int b = 0; b < Dim; ++b) L[a][b] = Real(0.0);
  LAHAR_UNROLL
  for (int i = 0; i < Basis::nodes; ++i) {
    const double* value = v + static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
    for (int b = 0; b < Dim; ++b) L[a][b] = multiply_add(L[a][b], dN[b][i], value + a);
  }
}

template <int Dim, class Basis>
double centre_trace(const Basis& basis, const double* v, const Local* nodes) {
  double dN[Dim][Basis::nodes], trace = 0.0;
  basis.centre_gradients(dN);
  for (int i = 0; i < Basis::nodes; ++i)
    for (int d = 0; d < Dim; ++d)
      trace += dN[d][i] * v[static_cast<std::ptrdiff_t>(nodes[i]) * node_width + d];
  return trace;
}

template <int Dim, class Real>
void make_room(Runs runs, VelocityGradients<Dim>& gradients) {
  gradients.first.clear();
  Local size = 0;
  for (const Run& run : runs) {
    gradients.first.push_back(size);
    size += (run.end - run.begin + lanes<Real> - 1) / lanes<Real> * lanes<Real>;
  }
  const auto room = static_cast<std::size_t>(size);
  if (gradients.trace.size() >= room) return;
  for (NodeArray& row : gradients.L) row.resize(room);
  gradients.trace.resize(room);
}

}  // namespace

template <int Dim, class Real>
void find_gradients(const Patch<Dim>& patch, Runs runs, VelocityGradients<Dim>& gradients) {
  make_room<Dim, Real>(runs, gradients);
  const double* v = patch.velocity.data();
  for_each_supported_run(
      patch, runs,
      [&](const auto& basis, const Run& run, const Local* nodes) __attribute__((always_inline)) {
        constexpr bool at_centre = std::decay_t<decltype(basis)>::volume_at_centre;
        Real trace(0.0);
        if constexpr (at_centre) trace = Real(centre_trace<Dim>(basis, v, nodes));
        auto to =
            static_cast<std::size_t>(gradients.first[static_cast<std::size_t>(&run - runs.data())]);
        for (Local p = run.begin; p < run.end; p += lanes<Real>, to += lanes<Real>) {
          Real L[Dim][Dim];
          gradient<Dim, Real>(basis, p, v, nodes, L);
          LAHAR_UNROLL
          for (int k = 0; k < Dim * Dim; ++k)
            store(L[k / Dim][k % Dim], &gradients.L[static_cast<std::size_t>(k)][to]);
          if constexpr (!at_centre) {
            trace = L[0][0] + L[1][1];
            if constexpr (Dim == 3) trace += L[2][2];
          }
          store(trace, &gradients.trace[to]);
        }
      });
}

#define LAHAR_INSTANTIATE(Dim, Real) \
  template void find_gradients<Dim, Real>(const Patch<Dim>&, Runs, VelocityGradients<Dim>&);
LAHAR_INSTANTIATE(2, Pack)
LAHAR_INSTANTIATE(3, Pack)
LAHAR_INSTANTIATE(2, Scalar)
LAHAR_INSTANTIATE(3, Scalar)

}  // namespace lahar::supported
