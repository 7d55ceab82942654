/// Velocity gradients at particles, for bases of any support.
#include "physics/support_fields.h"
#include "physics/support_kernels.h"

namespace lahar::supported {

namespace {

/// Of linear functions of the cell's corners: those of a domain without size, as in the reference
/// code.
template <int Dim, TensorBasis Basis>
double centre_trace(const Basis& basis, const double* v, const Local* nodes) {
  double trace = 0.0;
  for (int d = 0; d < Dim; ++d) {
    double difference = 0.0;
    for (int c = 0; c < corners<Dim>; ++c) {
      int i = 0;  // the corner's number in the grid of nodes
      for (int e = 0; e < Dim; ++e) i += (1 + (c >> e & 1)) << (2 * e);
      const double value = v[static_cast<std::ptrdiff_t>(nodes[i]) * node_width + d];
      difference += c >> d & 1 ? value : -value;
    }
    trace += difference / (face_corners<Dim> * basis.cell_length(d));
  }
  return trace;
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
