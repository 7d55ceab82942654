/// \file Particle to grid for particles whose domains have corners (CPDI). Lanes are the components
/// of two nodes that are neighbours along the first axis. Every corner adds to the nodes of the
/// cell that it is in, one particle after the other.
#include <algorithm>

#include "physics/kernels/domain_corners.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/particle_rows.h"
#include "physics/kernels/particle_sums.h"
#include "physics/particles/loads.h"

namespace lahar::general {

namespace {

/// Sums of the nodes around a cell, by pairs along the first axis: those of a cell that corners may
/// be in. A node between two cells has a part in the pairs of both, so that what is added to a pair
/// never waits for what was added to a part of it.
template <int Dim>
class PairSums {
 public:
  static constexpr int cells = axis_nodes - 1;  ///< along an axis
  static constexpr int n_rows = Dim == 3 ? axis_nodes * axis_nodes : axis_nodes;
  /// Numbers of pairs from one to the next along each axis, and of those of a cell's nodes.
  static constexpr auto stride = [] {
    if constexpr (Dim == 3)
      return std::array<int, 3>{1, cells, cells * axis_nodes};
    else
      return std::array<int, 2>{1, cells};
  }();

  PairSums() {
    for (auto& row : at_) clear(row);
  }
  LAHAR_INLINE double* pair(int cell) { return at_[0][0] + cell * lanes<NodePair>; }

  /// Add all to nodes, and begin again.
  LAHAR_INLINE void add_to(double* sums, const Local* nodes) {
    for (int r = 0; r < n_rows; ++r) {
      auto& row = at_[r];
      if (is_zero(row)) continue;  // domains are smaller than what they may reach
      const auto low = [&](int k) { return load<NodeVector>(row[k]); };
      const auto high = [&](int k) { return load<NodeVector>(row[k] + node_width); };
      const Local* node = nodes + axis_nodes * r;
      add_to_node(sums, node[0], low(0));
      add_to_node(sums, node[1], high(0) + low(1));
      add_to_node(sums, node[2], high(1) + low(2));
      add_to_node(sums, node[3], high(2));
      clear(row);
    }
  }

 private:
  using Row = double[cells][lanes<NodePair>];
  LAHAR_INLINE static bool is_zero(const Row& row) {
    unsigned bits = 0;
    for (const auto& pair : row) bits |= outside(load<NodePair>(pair), 0.0, lanes<NodePair>);
    return bits == 0;
  }
  LAHAR_INLINE static void clear(Row& row) {
    for (auto& pair : row) store(NodePair(0.0), pair);
  }
  alignas(64) Row at_[n_rows];
};

/// Functions of the two nodes of a pair are first + sign * along.
alignas(64) constexpr double of_first[8] = {1, 1, 1, 1, 0, 0, 0, 0};
alignas(64) constexpr double by_along[8] = {-1, -1, -1, -1, 1, 1, 1, 1};

/// Add at the corners of particle j, `value(c)` for both nodes of a pair.
template <int Dim, class Real, class Value>
LAHAR_INLINE void add_at_corners(const DomainCorners<Dim, Real>& at, Local j, PairSums<Dim>& sums,
                                 Value value) {
  constexpr auto stride = PairSums<Dim>::stride;
  LAHAR_UNROLL
  for (int c = 0; c < corners<Dim>; ++c) {
    const NodePair part =
        multiply_add(load<NodePair>(of_first), load<NodePair>(by_along), &at.along[c][j]) *
        value(c);
    double* const first = sums.pair(at.cell[c][j]);
    LAHAR_UNROLL
    for (int k = 0; k < face_corners<Dim>; ++k) {
      double* const to =
          first + ((k & 1) * stride[1] + (k >> 1) * stride[Dim - 1]) * lanes<NodePair>;
      store(multiply_add(load<NodePair>(to), part, &at.across[c][k][j]), to);
    }
  }
}

/// Strides of PairSums as DomainCorners takes them.
template <int Dim>
struct Strides {
  int of[Dim];
  constexpr Strides() : of{} {
    for (std::size_t d = 0; d < Dim; ++d) of[d] = PairSums<Dim>::stride[d];
  }
};

/// Add sum_p N_i q_p over a bin. `values(p, n, q)` fills q for the particles from p on.
template <int Dim, class Real, class Basis, class Values>
LAHAR_INLINE void scatter_domains(const Basis& basis, const ParticleBin& bin, const Local* nodes,
                                  double* sums, PairSums<Dim>& pairs, Values values) {
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    Real s[Dim], w[corners<Dim>], q[node_width];
    typename Basis::template DomainOf<Real> domain;
    basis.find_domain(p, s, domain);
    domain.weights(w);
    DomainCorners<Dim, Real> at;
    at.set(
        basis, s, domain,
        Strides<Dim>().of, [&](int c) __attribute__((always_inline)) { return w[c]; });
    values(p, n, q);
    ParticleRows<Real> rows;
    rows.set(q);
    for (Local j = 0; j < n; ++j) {
      const NodePair value = rows[j];
      add_at_corners(
          at, j, pairs, [&](int) __attribute__((always_inline)) { return value; });
    }
  }
  pairs.add_to(sums, nodes);
}

/// Internal force of a bin: -sum_p S_p grad N_i, which is a force at each corner.
template <int Dim, class Real, class Basis, class Stress>
LAHAR_INLINE void domain_force(const Basis& basis, const Stress& stress, const ParticleBin& bin,
                               const Local* nodes, double* sums, PairSums<Dim>& pairs) {
  using Domain = typename Basis::template DomainOf<Real>;
  // A parallelepiped has forces by edge, and those at its corners are sums of them (EdgeSlopes).
  constexpr int n_parts = is_parallelepiped<Domain> ? Dim : corners<Dim>;
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    Real s[Dim], S[Dim][Dim], slope[n_parts][Dim];
    Domain domain;
    basis.find_domain(p, s, domain);
    if constexpr (is_parallelepiped<Domain>) {
      const EdgeSlopes<Dim, Real> edges(basis, domain);
      LAHAR_UNROLL
      for (int k = 0; k < Dim; ++k) LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) slope[k][d] = edges.of_edge[k][d];
    } else {
      domain.slopes(slope);
      for (auto& of_corner : slope) LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) of_corner[d] *= basis.map.per_length[d];
    }
    stress.at(p, n, S);
    ParticleRows<Real> parts[n_parts];
    for (int k = 0; k < n_parts; ++k) {
      Real f[node_width];
      LAHAR_UNROLL
      for (int a = 0; a < node_width; ++a) f[a] = Real(0.0);
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) LAHAR_UNROLL
      for (int b = 0; b < Dim; ++b) f[a] -= S[a][b] * slope[k][b];
      parts[k].set(f);
    }
    DomainCorners<Dim, Real> at;
    at.set(
        basis, s, domain, Strides<Dim>().of,
        [](int) __attribute__((always_inline)) { return Real(1.0); });
    for (Local j = 0; j < n; ++j)
      add_at_corners(
          at, j, pairs, [&](int c) __attribute__((always_inline)) {
            if constexpr (!is_parallelepiped<Domain>) return parts[c][j];
            NodePair force(0.0);
            LAHAR_UNROLL
            for (int k = 0; k < Dim; ++k) force = add_signed(force, parts[k][j], c, k);
            return force;
          });
  }
  pairs.add_to(sums, nodes);
}

/// Call body(basis, bin, nodes, pairs) for every bin that is not empty.
template <int Dim, class Body>
LAHAR_INLINE void for_each_domain_bin(const Patch<Dim>& patch, ParticleBins bins, Body body) {
  const Local* nodes = patch.topology.support_nodes.data();
  with_domains(
      patch, [&](const auto& cells) __attribute__((noinline)) {
        PairSums<Dim> pairs;
        for (const ParticleBin& bin : bins)
          if (bin.begin < bin.end)
            body(cells[bin.cell], bin,
                 nodes + static_cast<std::ptrdiff_t>(tensor_nodes<Dim>) * bin.cell, pairs);
      });
}

}  // namespace

template <int Dim, class Real>
void map_domain_momentum(Patch<Dim>& patch, ParticleBins bins,
                         const ParticleMomentum<Dim>& particle, double* sums) {
  const auto values = [&](Local p, Local n, Real(&q)[node_width]) __attribute__((always_inline)) {
    const Real m = load_first<Real>(particle.m + p, n);
    LAHAR_UNROLL
    for (std::size_t k = 0; k < node_width; ++k)
      q[k] = k == mass_lane ? m
             : k < Dim      ? Real(m * load<Real>(particle.v[k % Dim] + p))
                            : Real(0.0);
  };
  for_each_domain_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes, PairSums<Dim>& pairs)
          __attribute__((always_inline)) {
            scatter_domains<Dim, Real>(basis, bin, nodes, sums, pairs, values);
          });
}

template <int Dim, class Real>
void map_domain_force(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                      ParticleStress<Dim> stress, double* sums) {
  for_each_domain_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes, PairSums<Dim>& pairs)
          __attribute__((always_inline)) {
            domain_force<Dim, Real>(basis, stress, bin, nodes, sums, pairs);
            add_own_forces(basis, patch, step, bin, nodes, sums);
          });
}

template <int Dim, class Real>
void map_domain_gradient(Patch<Dim>& patch, ParticleBins bins, const double* V, double* sums) {
  const UnitPressure<Dim> pressure{V};
  for_each_domain_bin(
      patch, bins,
      [&](const auto& basis, const ParticleBin& bin, const Local* nodes, PairSums<Dim>& pairs)
          __attribute__((always_inline)) {
            domain_force<Dim, Real>(basis, pressure, bin, nodes, sums, pairs);
          });
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                               \
  template void map_domain_momentum<Dim, Real>(Patch<Dim>&, ParticleBins,                          \
                                               const ParticleMomentum<Dim>&, double*);             \
  template void map_domain_gradient<Dim, Real>(Patch<Dim>&, ParticleBins, const double*, double*); \
  template void map_domain_force<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&, ParticleBins,    \
                                            ParticleStress<Dim>, double*);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)

}  // namespace lahar::general
