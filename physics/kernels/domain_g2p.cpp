/// \file Grid to particle for particles whose domains have corners (CPDI). Nodal fields are found
/// at the corners of one particle after the other, lanes are components of velocity and
/// acceleration; values of particles, gradients and the motion of corners follow from those.
#include <algorithm>

#include "physics/basis/nodal_fields.h"
#include "physics/kernels/cpdi2_motion.h"
#include "physics/kernels/domain_corners.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/particle_rows.h"
#include "physics/kernels/particle_update.h"
#include "physics/materials/law.h"
#include "physics/particles/loads.h"

namespace lahar::general {

namespace {

/// Velocities and accelerations of the nodes around one cell after the other. Cells that follow one
/// another along the first axis share all but the last of their nodes along it, which stay.
template <int Dim>
class NodePairs {
 public:
  static constexpr int n_rows = Dim == 3 ? axis_nodes * axis_nodes : axis_nodes;
  static constexpr int row = 12;  ///< nodes along the first axis for which there is room
  static constexpr int stride(int d) { return d == 0 ? 1 : d == 1 ? row : row * axis_nodes; }

  LAHAR_INLINE NodePairs(const Patch<Dim>& patch, const double* v, const double* a)
      : topology_(patch.topology), v_(v), a_(a) {}

  /// The first node of the cell; others are stride() apart.
  LAHAR_INLINE const double* move_to(Local cell) {
    if (cell != cell_) {
      const auto c = static_cast<std::size_t>(cell);
      const bool next = cell == cell_ + 1 && first_ + axis_nodes < row &&
                        !topology_.support_follows.empty() && topology_.support_follows[c] != 0;
      first_ = next ? first_ + 1 : 0;
      cell_ = cell;
      const Local* nodes = topology_.support(c).data();
      for (int r = 0; r < n_rows; ++r)
        for (int k = next ? axis_nodes - 1 : 0; k < axis_nodes; ++k) {
          const auto from = static_cast<std::ptrdiff_t>(nodes[axis_nodes * r + k]) * node_width;
          const auto v = load<NodeVector>(v_ + from), a = load<NodeVector>(a_ + from);
          store(NodePair::of(__builtin_shufflevector(v.v, a.v, 0, 1, 2, 3, 4, 5, 6, 7)),
                at_[row * r + first_ + k]);
        }
    }
    return at_[first_];
  }

 private:
  static constexpr Local nowhere = -2;  ///< no cell follows it
  alignas(64) double at_[n_rows * row][lanes<NodePair>];
  const PatchTopology<Dim>& topology_;
  const double *v_, *a_;
  Local cell_ = nowhere;
  int first_ = 0;
};

/// Eight values of each particle of a pack.
template <class Real>
struct PairRows {
  alignas(64) double row[lanes<Real>][lanes<NodePair>];

  LAHAR_INLINE void set(Local j, const NodePair& value) { store(value, row[j]); }
  /// The lower half of a and that of b.
  LAHAR_INLINE void set(Local j, const NodePair& a, const NodePair& b) {
    set(j, NodePair::of(__builtin_shufflevector(a.v, b.v, 0, 1, 2, 3, 8, 9, 10, 11)));
  }
  /// What all particles have of each value.
  LAHAR_INLINE void get(Real (&value)[lanes<NodePair>]) const {
    if constexpr (lanes<Real> == 8) {
      using V = typename Real::Value;
      V two[8], four[8];
      LAHAR_UNROLL
      for (int j = 0; j < 8; j += 2) {
        const V a = load<Real>(row[j]).v, b = load<Real>(row[j + 1]).v;
        two[j] = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14);
        two[j + 1] = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
      }
      LAHAR_UNROLL
      for (int j = 0; j < 8; j += 4) LAHAR_UNROLL
      for (int k = 0; k < 2; ++k) {
        const V a = two[j + k], b = two[j + k + 2];
        four[j + k] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
        four[j + k + 2] = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
      }
      LAHAR_UNROLL
      for (int k = 0; k < 4; ++k) {
        const V a = four[k], b = four[k + 4];
        value[k] = Real::of(__builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11));
        value[k + 4] = Real::of(__builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15));
      }
    } else {
      for (int k = 0; k < lanes<NodePair>; ++k) {
        double of_lane[lanes<Real>];
        for (int j = 0; j < lanes<Real>; ++j) of_lane[j] = row[j][k];
        value[k] = load<Real>(of_lane);
      }
    }
  }
};

/// What a pack of particles takes from nodes.
template <int Dim, class Real>
struct DomainFields {
  Real v[Dim], a[Dim], L[Dim][Dim];
  Real of_mass_lane;                 ///< of the field of accelerations
  Real relative[corners<Dim>][Dim];  ///< velocities of corners less v, see corner_velocities()
};

/// What of it besides v and a.
struct Parts {
  bool L = false, corners = false;
};

/// Finds the fields at the n particles from p on. `first` is the first node of their cell.
template <Parts parts, int Dim, class Real, class Basis>
LAHAR_INLINE void find_fields(const Basis& basis, Local p, Local n, const double* first,
                              DomainFields<Dim, Real>& fields) {
  constexpr int n_corners = corners<Dim>, pairs = n_corners / 2;
  using Nodes = NodePairs<Dim>;
  using Domain = typename Basis::template DomainOf<Real>;
  constexpr bool edges = is_parallelepiped<Domain>;  // its slopes are sums over edges (EdgeSlopes)
  Real s[Dim];
  Domain domain;
  const Real scale = basis.find_domain(p, s, domain);
  DomainCorners<Dim, Real> at;
  int stride[Dim];
  for (int d = 0; d < Dim; ++d) stride[d] = Nodes::stride(d);
  at.set(
      basis, s, domain, stride, [](int) __attribute__((always_inline)) { return Real(1.0); });
  alignas(64) double weight[n_corners][lanes<Real>], slopes[n_corners][Dim][lanes<Real>];
  if constexpr (!edges) {
    Real w[n_corners], slope[n_corners][Dim];
    if constexpr (parts.L)
      domain.weights_and_slopes(w, slope);
    else
      domain.weights(w);
    for (int c = 0; c < n_corners; ++c) {
      store(w[c], weight[c]);
      for (int d = 0; d < Dim && parts.L; ++d)
        store(Real(slope[c][d] * basis.map.per_length[d]), slopes[c][d]);
    }
  }

  PairRows<Real> sums, first_slopes, last_slope, of_corners[pairs];
  for (Local j = 0; j < n; ++j) {
    NodePair sum(0.0), L[3] = {NodePair(0.0), NodePair(0.0), NodePair(0.0)}, before;
    LAHAR_UNROLL
    for (int c = 0; c < n_corners; ++c) {
      const double* const from = first + at.cell[c][j] * lanes<NodePair>;
      NodePair low(0.0), high(0.0);
      LAHAR_UNROLL
      for (int i = 0; i < face_corners<Dim>; ++i) {
        const double* const node =
            from + ((i & 1) * Nodes::stride(1) + (i >> 1) * Nodes::stride(2)) * lanes<NodePair>;
        const auto across = broadcast<NodePair>(&at.across[c][i][j]);
        low += across * load<NodePair>(node);
        high += across * load<NodePair>(node + lanes<NodePair>);
      }
      const NodePair value = multiply_add(low, high - low, &at.along[c][j]);
      if constexpr (edges) {
        sum += value;
        if constexpr (parts.L) {
          LAHAR_UNROLL
          for (int k = 0; k < Dim; ++k) L[k] = add_signed(L[k], value, c, k);
        }
      } else {
        sum = multiply_add(sum, value, &weight[c][j]);
        if constexpr (parts.L) {
          LAHAR_UNROLL
          for (int d = 0; d < Dim; ++d) L[d] = multiply_add(L[d], value, &slopes[c][d][j]);
        }
      }
      if constexpr (parts.corners)
        if (c & 1) of_corners[c / 2].set(j, before, value);
      before = value;
    }
    sums.set(j, sum);
    if constexpr (parts.L) {
      first_slopes.set(j, L[0], L[1]);
      if constexpr (Dim == 3) last_slope.set(j, L[2]);
    }
  }

  Real value[lanes<NodePair>];
  sums.get(value);
  const double factor = edges ? 1.0 / n_corners : 1.0;
  LAHAR_UNROLL
  for (int d = 0; d < Dim; ++d) {
    fields.v[d] = factor * value[d];
    fields.a[d] = factor * value[node_width + d];
  }
  fields.of_mass_lane = factor * value[node_width + mass_lane];
  if constexpr (parts.L) {
    first_slopes.get(value);
    LAHAR_UNROLL
    for (int a = 0; a < Dim; ++a) {
      fields.L[a][0] = value[a];
      fields.L[a][1] = value[node_width + a];
    }
    if constexpr (Dim == 3) {
      last_slope.get(value);
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) fields.L[a][2] = value[a];
    }
    if constexpr (edges) {
      const EdgeSlopes<Dim, Real> slope(basis, domain);
      LAHAR_UNROLL
      for (int a = 0; a < Dim; ++a) {
        Real L[Dim];
        LAHAR_UNROLL
        for (int b = 0; b < Dim; ++b) {
          L[b] = fields.L[a][0] * slope.of_edge[0][b];
          LAHAR_UNROLL
          for (int k = 1; k < Dim; ++k) L[b] += fields.L[a][k] * slope.of_edge[k][b];
        }
        LAHAR_UNROLL
        for (int b = 0; b < Dim; ++b) fields.L[a][b] = L[b];
      }
    }
  }
  if constexpr (parts.corners) {
    const Real larger = 1.0 / scale;
    for (int k = 0; k < pairs; ++k) {
      of_corners[k].get(value);
      LAHAR_UNROLL
      for (int d = 0; d < Dim; ++d) {
        fields.relative[2 * k][d] = larger * (value[d] - fields.v[d]);
        fields.relative[2 * k + 1][d] = larger * (value[node_width + d] - fields.v[d]);
      }
    }
  }
}

template <bool Gradients, int Dim, class Real>
void update_and_find(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                     VelocityGradients<Dim>* gradients) {
  if (Gradients) gradients->make_room(bins, lanes<Real>);
  VelocityUpdates<Dim> updates(patch, step);
  const bool shares = updates.shares_of_nodes(patch) != nullptr;
  const MovedRows<Dim> rows(patch.particles);
  CornerMotion<Dim> corners_of(patch, step.dt);
  PrescribedMotion<Dim> prescribed(patch, step);
  Advanced<Real> all;
  with_domains(
      patch, [&](const auto& cells) __attribute__((noinline)) {
        using Basis = typename std::decay_t<decltype(cells)>::Basis;
        constexpr Parts parts{Gradients, moves_corners<Dim, Basis>};
        NodePairs<Dim> nodes(patch, patch.velocity.data(), updates.field(patch));
        for (const ParticleBin& bin : bins) {
          if (bin.begin == bin.end) continue;
          prescribed.begin(bin);
          const VelocityUpdate update = updates.of(bin);
          const Basis basis = cells[bin.cell];
          const double* const first = nodes.move_to(bin.cell);
          auto to = Gradients ? gradients->begin(bin, bins) : 0;
          for (Local p = bin.begin; p < bin.end; p += lanes<Real>, to += lanes<Real>) {
            const Local n = std::min<Local>(bin.end - p, lanes<Real>);
            prefetch(rows.v, p);
            prefetch(rows.u, p);
            DomainFields<Dim, Real> at;
            find_fields<parts>(basis, p, n, first, at);
            if constexpr (Gradients) gradients->put(to, at.L, trace(at.L));
            if constexpr (parts.corners) corners_of.move(p, n, at.relative);
            const Real taken = shares ? at.of_mass_lane : Real(0.0);
            advance(rows, p, n, at.v, at.a, taken, update, step.dt, updates.mass(), all);
          }
          prescribed.end(bin);
        }
      });
  note(patch, all);
}

}  // namespace

template <int Dim, class Real>
void update_domain_particles(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                             VelocityGradients<Dim>* gradients) {
  if (gradients)
    update_and_find<true, Dim, Real>(patch, step, bins, gradients);
  else
    update_and_find<false, Dim, Real>(patch, step, bins, gradients);
}

template <int Dim, class Real>
void find_domain_gradients(const Patch<Dim>& patch, ParticleBins bins, const double* v,
                           VelocityGradients<Dim>& gradients) {
  gradients.make_room(bins, lanes<Real>);
  with_domains(
      patch, [&](const auto& cells) __attribute__((noinline)) {
        NodePairs<Dim> nodes(patch, v, v);
        for (const ParticleBin& bin : bins) {
          if (bin.begin == bin.end) continue;
          const auto basis = cells[bin.cell];
          const double* const first = nodes.move_to(bin.cell);
          auto to = gradients.begin(bin, bins);
          for (Local p = bin.begin; p < bin.end; p += lanes<Real>, to += lanes<Real>) {
            DomainFields<Dim, Real> at;
            find_fields<Parts{true, false}>(basis, p, std::min<Local>(bin.end - p, lanes<Real>),
                                            first, at);
            gradients.put(to, at.L, trace(at.L));
          }
        }
      });
}

#define LAHAR_INSTANTIATE(Dim, Real)                                                             \
  template void update_domain_particles<Dim, Real>(Patch<Dim>&, const StepContext<Dim>&,         \
                                                   ParticleBins, VelocityGradients<Dim>*);       \
  template void find_domain_gradients<Dim, Real>(const Patch<Dim>&, ParticleBins, const double*, \
                                                 VelocityGradients<Dim>&);
LAHAR_INSTANTIATE(2, KernelReal)
LAHAR_INSTANTIATE(3, KernelReal)

}  // namespace lahar::general
