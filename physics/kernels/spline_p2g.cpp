/// \file Particle to grid for tensor bases in 3D of which a particle reaches three of the cell's
/// four nodes along each axis (basis.h): quadratic splines. Lanes are the components of two nodes
/// that are neighbours along the first axis. Particles follow one another, octants of the cell
/// along the second and third axis one after the other: the nodes that particles of one octant
/// reach have their sums in registers.
#include <algorithm>

#include "physics/base/pack_bits.h"
#include "physics/basis/tensor_basis.h"
#include "physics/kernels/general_kernels.h"
#include "physics/kernels/particle_forces.h"
#include "physics/kernels/particle_rows.h"
#include "physics/kernels/particle_sums.h"
#include "physics/materials/law.h"
#include "physics/particles/loads.h"

namespace lahar::general {

namespace {

using Splines = SplineCells<3, QuadraticSpline>;
using Basis = TensorProduct<3, Splines::Axis>;
static_assert(Basis::per_particle == 3);

/// The four nodes along the first axis. (Two names: GCC 12 keeps arrays of packs in memory here.)
struct NodeRow {
  NodePair low, high;
};
LAHAR_INLINE NodeRow operator*(const NodeRow& a, const NodePair& b) {
  return {a.low * b, a.high * b};
}
/// a b + c.
LAHAR_INLINE NodeRow fma(const NodeRow& a, const NodePair& b, const NodeRow& c) {
  return {fma(a.low, b, c.low), fma(a.high, b, c.high)};
}
/// sum += a b.
LAHAR_INLINE void multiply_add(const NodeRow& a, const NodePair& b, NodePair (&sum)[2]) {
  sum[0] = fma(a.low, b, sum[0]);
  sum[1] = fma(a.high, b, sum[1]);
}

/// The sums of the nodes of one cell after the other, taken from the patch and put back. Cells that
/// follow one another along the first axis share three of four nodes, which stay: the nodes' places
/// along that axis turn, node k of a cell being at slot(k). Every node adds one particle after the
/// other to what it had, so that it does not matter which cells are done together.
class SumsWindow {
 public:
  /// Doubles from a node to the next along the second and third axis.
  static constexpr int along_second = axis_nodes * node_width;
  static constexpr int along_third = axis_nodes * along_second;

  LAHAR_INLINE SumsWindow(const PatchTopology<3>& topology, double* sums)
      : topology_(topology), sums_(sums) {}
  LAHAR_INLINE double* begin() { return at_; }
  LAHAR_INLINE unsigned slot(int k) const {
    return (static_cast<unsigned>(k) + turned_) % axis_nodes;
  }

  LAHAR_INLINE void move_to(Local cell) {
    if (cell == cell_) return;
    const auto c = static_cast<std::size_t>(cell);
    const bool next = cell == cell_ + 1 && topology_.support_follows[c] != 0;
    if (next)
      put(0);
    else
      finish();
    turned_ = next ? turned_ + 1 : 0;
    cell_ = cell;
    nodes_ = topology_.support(c).data();
    border_ = topology_.support_border[c];
    for (int k = next ? axis_nodes - 1 : 0; k < axis_nodes; ++k) take(k);
  }
  /// Put all sums back.
  LAHAR_INLINE void finish() {
    for (int k = 0; k < axis_nodes && cell_ != nowhere; ++k) put(k);
    cell_ = nowhere;
  }

 private:
  static constexpr int n_rows = axis_nodes * axis_nodes;
  static constexpr Local nowhere = -2;  ///< no cell follows it

  /// The nodes of number k along the first axis.
  LAHAR_INLINE void take(int k) {
    for (int r = 0; r < n_rows; ++r) store(load<NodeVector>(of_node(k, r)), place(k, r));
  }
  /// Nodes beyond the mesh are not: in support_nodes others stand for them.
  LAHAR_INLINE void put(int k) {
    for (int r = 0; r < n_rows; ++r)
      if (border_ == 0 || exists(k, r)) store(load<NodeVector>(place(k, r)), of_node(k, r));
  }
  bool exists(int k, int r) const {
    const int number[3] = {k, r % axis_nodes, r / axis_nodes};
    for (int d = 0; d < 3; ++d)
      if ((number[d] == 0 && border_ >> (2 * d) & 1) ||
          (number[d] == axis_nodes - 1 && border_ >> (2 * d + 1) & 1))
        return false;
    return true;
  }
  LAHAR_INLINE double* place(int k, int r) { return at_ + r * along_second + slot(k) * node_width; }
  LAHAR_INLINE double* of_node(int k, int r) const {
    return sums_ + static_cast<std::ptrdiff_t>(nodes_[axis_nodes * r + k]) * sum_stride;
  }

  alignas(64) double at_[tensor_nodes<3> * node_width];
  const PatchTopology<3>& topology_;
  double* sums_;
  Local cell_ = nowhere;
  const Local* nodes_ = nullptr;  ///< of the cell: PatchTopology::support_nodes
  unsigned border_ = 0, turned_ = 0;
};

/// Values of functions at the particles of a pack, those of each function a row.
template <class Real, int Functions>
struct FunctionRows {
  alignas(64) double row[Functions][lanes<Real>];

  LAHAR_INLINE void set(const Real (&value)[Functions]) {
    LAHAR_UNROLL
    for (int k = 0; k < Functions; ++k) store(value[k], row[k]);
  }
  /// Along the first axis, values are where the window has their nodes.
  LAHAR_INLINE void set_turned(const SumsWindow& window, const Real (&value)[Functions]) {
    LAHAR_UNROLL
    for (int k = 0; k < Functions; ++k) store(value[k], row[window.slot(k)]);
  }
  LAHAR_INLINE NodePair at(int k, Local j) const { return broadcast<NodePair>(&row[k][j]); }
  /// At particle j those of the nodes of a row, each for all components.
  LAHAR_INLINE NodeRow of_row(Local j) const {
    constexpr unsigned second_node = 0xf0;
    return {select(second_node, at(1, j), at(0, j)), select(second_node, at(3, j), at(2, j))};
  }
};

/// The octants, by the second and third axis, in which the particles of a pack are.
template <class Real>
struct Octants {
  static constexpr int reached = 3;  ///< nodes along an axis
  using Sums = NodePair[reached][reached][2];

  unsigned upper[3] = {};  ///< by axis: lanes that reach the cell's nodes 1 to 3, not 0 to 2

  LAHAR_INLINE explicit Octants(const Real (&s)[3]) {
    for (int d = 1; d < 3; ++d) upper[d] = greater(s[d], Real(0.5));
  }
  /// The number of the first node that is reached along an axis.
  LAHAR_INLINE Real first(int d) const { return select(upper[d], Real(1.0), Real(0.0)); }
  /// Functions of the second or third axis at the nodes that are reached.
  LAHAR_INLINE void pick(int d, const Real (&w)[axis_nodes], Real (&at_reached)[reached]) const {
    LAHAR_UNROLL
    for (int k = 0; k < reached; ++k) at_reached[k] = select(upper[d], w[k + 1], w[k]);
  }

  /// Call add(j, sums) for each of the first n lanes.
  template <class Add>
  LAHAR_INLINE void for_each(Local n, SumsWindow& window, Add add) const {
    const unsigned all = (1u << n) - 1;
    for (unsigned octant = 0; octant < 4; ++octant) {
      unsigned bits = all & (octant & 1 ? upper[1] : ~upper[1]);
      bits &= octant & 2 ? upper[2] : ~upper[2];
      if (bits == 0) continue;
      double* to = window.begin();
      if (octant & 1) to += SumsWindow::along_second;
      if (octant & 2) to += SumsWindow::along_third;
      const auto at = [&](int k, int l, int i) {
        return to + k * SumsWindow::along_second + l * SumsWindow::along_third +
               i * lanes<NodePair>;
      };
      Sums sums;
      LAHAR_UNROLL
      for (int k = 0; k < reached; ++k) LAHAR_UNROLL
      for (int l = 0; l < reached; ++l) LAHAR_UNROLL
      for (int i = 0; i < 2; ++i) sums[k][l][i] = load<NodePair>(at(k, l, i));
      for_each_bit(bits, [&](int lane) { add(lane, sums); });
      LAHAR_UNROLL
      for (int k = 0; k < reached; ++k) LAHAR_UNROLL
      for (int l = 0; l < reached; ++l) LAHAR_UNROLL
      for (int i = 0; i < 2; ++i) store(sums[k][l][i], at(k, l, i));
    }
  }
};

/// Products of the functions of the second and third axis, the third faster.
template <class Real>
struct Products {
  static constexpr int reached = Octants<Real>::reached;
  FunctionRows<Real, reached * reached> rows;

  LAHAR_INLINE Products(const Octants<Real>& octants, const Real (&w)[3][axis_nodes]) {
    Real second[reached], third[reached], product[reached * reached];
    octants.pick(1, w[1], second);
    octants.pick(2, w[2], third);
    LAHAR_UNROLL
    for (int k = 0; k < reached; ++k) LAHAR_UNROLL
    for (int l = 0; l < reached; ++l) product[k * reached + l] = second[k] * third[l];
    rows.set(product);
  }
  LAHAR_INLINE NodePair at(int k, int l, Local j) const { return rows.at(k * reached + l, j); }
};

/// Add sum_p N_i q_p over a bin. `values(p, n, q)` fills q for the particles from p on.
template <class Real, class Values>
LAHAR_INLINE void scatter(const Basis& basis, const ParticleBin& bin, SumsWindow& window,
                          Values values) {
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    using In = Octants<Real>;
    Real w[3][axis_nodes], s[3], q[node_width];
    basis.weights(p, w);
    basis.place(p, s);
    values(p, n, q);
    const In octants(s);
    const Products<Real> products(octants, w);
    FunctionRows<Real, axis_nodes> first;
    ParticleRows<Real> value;
    first.set_turned(window, w[0]);
    value.set(q);
    octants.for_each(
        n, window, [&](Local j, typename In::Sums & sum) __attribute__((always_inline)) {
          const NodeRow part = first.of_row(j) * value[j];
          LAHAR_UNROLL
          for (int k = 0; k < In::reached; ++k) LAHAR_UNROLL
          for (int l = 0; l < In::reached; ++l) multiply_add(part, products.at(k, l, j), sum[k][l]);
        });
  }
}

/// {m v, m}_i += sum_p N_i m_p {v_p + C_p (x_i - x_p), 1}: from node to node the bracket changes by
/// a column of C times the cell's length.
template <class Real>
LAHAR_INLINE void affine_momentum(const Basis& basis, const ParticleMomentum<3>& particle,
                                  const ParticleBin& bin, SumsWindow& window) {
  double length[3];
  for (int d = 0; d < 3; ++d) length[d] = basis.cell_length(d);
  alignas(64) double turned[axis_nodes][node_width];  // the nodes' numbers along the first axis
  for (int k = 0; k < axis_nodes; ++k)
    store(NodeVector(static_cast<double>(k)), turned[window.slot(k)]);
  const NodeRow number = {load<NodePair>(turned[0]), load<NodePair>(turned[2])};
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    using In = Octants<Real>;
    Real w[3][axis_nodes], s[3], m, v[3], C[3][3];
    basis.weights(p, w);
    basis.place(p, s);
    particle.at(p, n, m, v, C);
    const In octants(s);
    const Products<Real> products(octants, w);
    FunctionRows<Real, axis_nodes> first;
    ParticleRows<Real> value, change[3];
    first.set_turned(window, w[0]);
    // Momentum at the first node that is reached.
    Real momentum[node_width] = {v[0], v[1], v[2], m};
    LAHAR_UNROLL
    for (int d = 0; d < 3; ++d) {
      const Real to_particle = 1.0 + s[d] - octants.first(d);
      Real column[node_width];
      LAHAR_UNROLL
      for (int a = 0; a < 3; ++a) {
        column[a] = C[a][d] * length[d];
        momentum[a] -= column[a] * to_particle;
      }
      column[mass_lane] = Real(0.0);
      change[d].set(column);
    }
    value.set(momentum);
    octants.for_each(
        n, window, [&](Local j, typename In::Sums & sum) __attribute__((always_inline)) {
          const NodeRow weight = first.of_row(j);
          const NodePair at_zero = value[j], by_first = change[0][j], by_second = change[1][j],
                         by_third = change[2][j];
          NodeRow part = {weight.low * fma(number.low, by_first, at_zero),
                          weight.high * fma(number.high, by_first, at_zero)};
          LAHAR_UNROLL
          for (int k = 0; k < In::reached; ++k) {
            NodeRow here = part;
            LAHAR_UNROLL
            for (int l = 0; l < In::reached; ++l) {
              multiply_add(here, products.at(k, l, j), sum[k][l]);
              here = fma(weight, by_third, here);
            }
            part = fma(weight, by_second, part);
          }
        });
  }
}

/// Internal force of a bin: -sum_p S_p grad N_i. Of each component, S_ax dN/dx + S_ay dN/dy goes
/// with the weight of the third axis and S_az N with its slope.
template <class Real, class Stress>
LAHAR_INLINE void internal_force(const Basis& basis, const Stress& stress, const ParticleBin& bin,
                                 SumsWindow& window) {
  for (Local p = bin.begin; p < bin.end; p += lanes<Real>) {
    const Local n = std::min<Local>(bin.end - p, lanes<Real>);
    using In = Octants<Real>;
    Real w[3][axis_nodes], dw[3][axis_nodes], s[3], S[3][3];
    basis.weights(p, w, dw);
    basis.place(p, s);
    stress.at(p, n, S);
    const In octants(s);
    FunctionRows<Real, axis_nodes> first, first_slope;
    FunctionRows<Real, In::reached> functions[3], slopes[3];  // of the second and third axis
    ParticleRows<Real> column[3];
    first.set_turned(window, w[0]);
    first_slope.set_turned(window, dw[0]);
    LAHAR_UNROLL
    for (int d = 0; d < 3; ++d) {
      column[d].set({-S[0][d], -S[1][d], -S[2][d], Real(0.0)});
      if (d == 0) continue;
      Real reached[In::reached];
      octants.pick(d, w[d], reached);
      functions[d].set(reached);
      octants.pick(d, dw[d], reached);
      slopes[d].set(reached);
    }
    octants.for_each(
        n, window, [&](Local j, typename In::Sums & sum) __attribute__((always_inline)) {
          const NodeRow weight = first.of_row(j);
          const NodeRow by_first = first_slope.of_row(j) * column[0][j],
                        by_second = weight * column[1][j], by_third = weight * column[2][j];
          LAHAR_UNROLL
          for (int k = 0; k < In::reached; ++k) {
            const NodePair w1 = functions[1].at(k, j);
            const NodeRow plane = fma(by_second, slopes[1].at(k, j), by_first * w1),
                          along = by_third * w1;
            LAHAR_UNROLL
            for (int l = 0; l < In::reached; ++l) {
              multiply_add(plane, functions[2].at(l, j), sum[k][l]);
              multiply_add(along, slopes[2].at(l, j), sum[k][l]);
            }
          }
        });
  }
}

/// Call body(basis, bin, window) for every bin that is not empty.
template <class Body>
LAHAR_INLINE void for_each_spline_bin(const Patch<3>& patch, ParticleBins bins, double* sums,
                                      Body body) {
  const Splines cells(patch);
  SumsWindow window(patch.topology, sums);
  for (ParticleBin& bin : bins) {
    if (bin.begin == bin.end) continue;
    const Basis basis = cells[bin.cell];
    window.move_to(bin.cell);
    body(basis, bin, window);
  }
  window.finish();
}

}  // namespace

template <class Real>
void map_spline_momentum(Patch<3>& patch, ParticleBins bins, const ParticleMomentum<3>& particle,
                         double* sums) {
  if (particle.is_affine())
    return for_each_spline_bin(
        patch, bins, sums,
        [&](const Basis& basis, const ParticleBin& bin, SumsWindow& window) __attribute__((
            always_inline)) { affine_momentum<Real>(basis, particle, bin, window); });
  const auto values = [&](Local p, Local n, Real(&q)[4]) __attribute__((always_inline)) {
    q[mass_lane] = load_first<Real>(particle.m + p, n);
    LAHAR_UNROLL
    for (std::size_t d = 0; d < 3; ++d) q[d] = q[mass_lane] * load<Real>(particle.v[d] + p);
  };
  for_each_spline_bin(
      patch, bins, sums,
      [&](const Basis& basis, const ParticleBin& bin, SumsWindow& window)
          __attribute__((always_inline)) { scatter<Real>(basis, bin, window, values); });
}

template <class Real>
void map_spline_pressure(Patch<3>& patch, const StepContext<3>& step, ParticleBins bins,
                         double* sums) {
  const double* m = patch.particles.row(Column::mass);
  const double* pressure = patch.particles.row(Column::state);
  const auto values = [=](Local p, Local n, Real(&q)[4]) __attribute__((always_inline)) {
    q[0] = load_first<Real>(m + p, n) * load<Real>(pressure + p);
    q[1] = q[2] = q[3] = Real(0.0);
  };
  for_each_spline_bin(
      patch, bins, sums,
      [&](const Basis& basis, const ParticleBin& bin, SumsWindow& window)
          __attribute__((always_inline)) {
            if (has_pressure(step.model->materials[bin.material].law))
              scatter<Real>(basis, bin, window, values);
          });
}

template <class Real>
void map_spline_force(Patch<3>& patch, const StepContext<3>& step, ParticleBins bins,
                      ParticleStress<3> stress, double* sums) {
  const Local* nodes = patch.topology.support_nodes.data();
  for_each_spline_bin(
      patch, bins, sums,
      [&](const Basis& basis, const ParticleBin& bin, SumsWindow& window)
          __attribute__((always_inline)) {
            internal_force<Real>(basis, stress, bin, window);
            if (!has_particle_forces(patch, bin, *step.model)) return;
            window.finish();
            add_own_forces(basis, patch, step, bin,
                           nodes + static_cast<std::ptrdiff_t>(tensor_nodes<3>) * bin.cell, sums);
          });
}

template <class Real>
void map_spline_gradient(Patch<3>& patch, ParticleBins bins, const double* V, double* sums) {
  const UnitPressure<3> pressure{V};
  for_each_spline_bin(
      patch, bins, sums,
      [&](const Basis& basis, const ParticleBin& bin, SumsWindow& window)
          __attribute__((always_inline)) { internal_force<Real>(basis, pressure, bin, window); });
}

template void map_spline_momentum<KernelReal>(Patch<3>&, ParticleBins, const ParticleMomentum<3>&,
                                              double*);
template void map_spline_gradient<KernelReal>(Patch<3>&, ParticleBins, const double*, double*);
template void map_spline_pressure<KernelReal>(Patch<3>&, const StepContext<3>&, ParticleBins,
                                              double*);
template void map_spline_force<KernelReal>(Patch<3>&, const StepContext<3>&, ParticleBins,
                                           ParticleStress<3>, double*);

}  // namespace lahar::general
