/// \file Forces of their own that few particles have, such as tractions: what nodes get of them,
/// and their work.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "physics/base/pack_bits.h"
#include "physics/basis/any_basis.h"
#include "physics/basis/nodal_fields.h"
#include "physics/kernels/kernels.h"
#include "physics/kernels/particle_sums.h"
#include "physics/particles/contact_couple.h"
#include "physics/particles/loads.h"

namespace lahar {

/// Call take(i, k) for the nodes i, of numbers k along the axes, that a particle of a tensor basis
/// reaches.
template <class Basis, int Dim, class Take>
LAHAR_INLINE void for_each_reached(const Pack (&w)[Dim][axis_nodes], int lane, Take take) {
  constexpr int n = Basis::per_particle;
  int first[3] = {}, k[3];
  for (int d = 0; d < Dim; ++d)
    first[d] = n < axis_nodes && w[d][axis_nodes - 1][lane] != 0 ? axis_nodes - n : 0;
  for (k[2] = first[2]; k[2] < first[2] + (Dim == 3 ? n : 1); ++k[2])
    for (k[1] = first[1]; k[1] < first[1] + n; ++k[1])
      for (k[0] = first[0]; k[0] < first[0] + n; ++k[0]) take(16 * k[2] + 4 * k[1] + k[0], k);
}

/// With add = to(lane) for these lanes of the pack from `first` on, in ascending order, call
/// add(i, N) for the functions of node i that may not be zero.
template <int Dim, class Basis, class To>
LAHAR_INLINE void give_functions(const Basis& basis, Local first, unsigned bits, To to) {
  if constexpr (TensorBasis<Basis>) {
    Pack w[Dim][axis_nodes];
    basis.weights(first, w);
    for_each_bit(bits, [&](int lane) {
      const auto add = to(lane);
      for_each_reached<Basis>(w, lane, [&](int i, const int(&k)[3]) {
        double N = w[0][k[0]][lane] * w[1][k[1]][lane];
        if constexpr (Dim == 3) N *= w[2][k[2]][lane];
        add(i, N);
      });
    });
  } else {
    Pack N[Basis::nodes];
    basis.functions(first, N);
    for_each_bit(bits, [&](int lane) {
      const auto add = to(lane);
      for (int i = 0; i < Basis::nodes; ++i) add(i, N[i][lane]);
    });
  }
}

/// The same with add(i, dN), the gradient.
template <int Dim, class Basis, class To>
LAHAR_INLINE void give_gradients(const Basis& basis, Local first, unsigned bits, To to) {
  if constexpr (TensorBasis<Basis>) {
    Pack w[Dim][axis_nodes], dw[Dim][axis_nodes];
    basis.weights(first, w, dw);
    for_each_bit(bits, [&](int lane) {
      const auto add = to(lane);
      for_each_reached<Basis>(w, lane, [&](int i, const int(&k)[3]) {
        double dN[Dim];
        LAHAR_UNROLL
        for (int b = 0; b < Dim; ++b) {
          dN[b] = (b == 0 ? dw : w)[0][k[0]][lane] * (b == 1 ? dw : w)[1][k[1]][lane];
          if constexpr (Dim == 3) dN[b] *= (b == 2 ? dw : w)[2][k[2]][lane];
        }
        add(i, dN);
      });
    });
  } else {
    Pack gradient[Dim][Basis::nodes];
    basis.gradients(first, gradient);
    for_each_bit(bits, [&](int lane) {
      const auto add = to(lane);
      for (int i = 0; i < Basis::nodes; ++i) {
        double dN[Dim];
        for (int b = 0; b < Dim; ++b) dN[b] = gradient[b][i][lane];
        add(i, dN);
      }
    });
  }
}

/// Weights along axis d of a load at the side of particle p that lies `offset` [m] from its centre.
/// A load and the stress that bears it are in balance at all nodes if nodes get of the load what
/// they get of a uniform stress in the particle and in all that lie behind it, as long as it is:
/// W = +- l sum_m dw(s -+ m l). That is the function at the side but for the error of sums over
/// particles, which at nodes beyond the surface is as large as it. `weights` are those of the
/// centre, and stay where particles are much longer than cells.
template <class Basis>
void side_weights(const Basis& basis, int d, Local p, double s, double offset,
                  double (&weights)[axis_nodes]) {
  constexpr int most = 64;       // particles: thinner ones count as if there were no more
  constexpr double reach = 3.5;  // from the cell's middle to where no function of its nodes is left
  const double side = offset > 0.0 ? 1.0 : -1.0,
               length = 2.0 * side * offset / basis.cell_length(d);
  if (!(length < reach)) return;
  double total = 0, W[axis_nodes] = {};
  for (int m = 0; m < most; ++m) {
    const double at = s - side * m * length, cell = std::floor(at);
    if (std::abs(at - 0.5) > reach) break;
    Scalar dw[axis_nodes];
    basis.axis.slopes(d, p, Scalar(at - cell), dw);
    for (int k = 0; k < axis_nodes; ++k)
      if (const int j = k - static_cast<int>(cell); j >= 0 && j < axis_nodes)
        W[k] += side * length * dw[j][0];
  }
  if (basis.border >> (2 * d) & 1) fold_first(W);
  if (basis.border >> (2 * d + 1) & 1) fold_last(W);
  for (int k = 0; k < axis_nodes; ++k) total += weights[k] != 0.0 ? W[k] : 0.0;
  if (!(total > 0.5)) return;
  // The total is 1 where particles divide cells evenly.
  for (int k = 0; k < axis_nodes; ++k)
    if (weights[k] != 0.0) weights[k] = W[k] / total;
}

/// As give_functions(), for loads at sides: of component d of the load node i gets N[d]. to(lane)
/// is a pair of the offsets [m], along the component's axis each, and of add.
template <int Dim, TensorBasis Basis, class To>
void give_side_functions(const Basis& basis, Local first, unsigned bits, To to) {
  Pack w[Dim][axis_nodes], s[Dim];
  basis.weights(first, w);
  basis.place(first, s);
  for_each_bit(bits, [&](int lane) {
    const auto [offset, add] = to(lane);
    double W[Dim][axis_nodes];
    for (int d = 0; d < Dim; ++d) {
      for (int k = 0; k < axis_nodes; ++k) W[d][k] = w[d][k][lane];
      if (offset[d] != 0.0) side_weights(basis, d, first + lane, s[d][lane], offset[d], W[d]);
    }
    for_each_reached<Basis>(w, lane, [&](int i, const int(&k)[3]) {
      Vec<Dim> N;
      for (int d = 0; d < Dim; ++d) {
        N[d] = 1.0;
        for (int b = 0; b < Dim; ++b) N[d] *= b == d ? W[b][k[b]] : w[b][k[b]][lane];
      }
      add(i, N);
    });
  });
}

/// f_i += N_i f for the particles of one bin, with the forces force(p) and the functions at their
/// places: side_weights(), or for functions that are no products N(x + o) = N(x) + o dN/dx(x),
/// with the offset o of each component along its axis, which is exact for linear ones.
template <int Dim, class Basis, class Force>
void add_particle_forces(const Basis& basis, const ParticleBin& bin, const Local* nodes,
                         double* sums, Force force) {
  for (Local first = bin.begin; first < bin.end; first += lanes<Pack>) {
    SurfaceForce<Dim> of_lane[lanes<Pack>];
    unsigned acting = 0, aside = 0;  // bit per lane
    for (Local p = first; p < std::min(bin.end, first + lanes<Pack>); ++p) {
      const SurfaceForce<Dim> all = force(p);
      if (all.is_zero()) continue;
      acting |= 1u << (p - first);
      of_lane[p - first] = all;
      if (!all.offset.isZero(0.0)) aside |= 1u << (p - first);
    }
    if (acting == 0) continue;
    if constexpr (TensorBasis<Basis>)
      if (aside != 0) {  // all lanes in order: bits do not depend on how many a pack has
        give_side_functions<Dim>(basis, first, acting, [&](int lane) {
          const Vec<Dim> f = of_lane[lane].force;
          return std::pair(of_lane[lane].offset, [=](int i, const Vec<Dim>& N) {
            general::add_to_node(sums, nodes[i], node_vector<Dim>(f.cwiseProduct(N)));
          });
        });
        continue;
      }
    give_functions<Dim>(basis, first, acting, [&](int lane) {
      return [=, f = node_vector<Dim>(of_lane[lane].force)](int i, double N) {
        general::add_to_node(sums, nodes[i], N * f);
      };
    });
    if (aside == 0) continue;
    give_gradients<Dim>(basis, first, aside, [&](int lane) {
      return [=, c = of_lane[lane].couple()](int i, const double(&dN)[Dim]) {
        const Vec<Dim> of_node = c.cwiseProduct(Eigen::Map<const Vec<Dim>>(dN));
        general::add_to_node(sums, nodes[i], node_vector<Dim>(of_node));
      };
    });
  }
}

template <int Dim>
Vec<Dim> contact_force(const Particles<Dim>& particles, Local p) {
  Vec<Dim> force;
  for (int d = 0; d < Dim; ++d) force[d] = particles.row(Column::contact_force, d)[p];
  return force;
}

/// How much of the push of a rigid body acts by side_weights(): all of one along an axis, none
/// beyond some 18 degrees from it, where the couple C takes it to the surface. It is the component
/// along the axis alone, so that it has no moment about the particle, as C has none.
template <int Dim>
struct SidePush {
  double share = 0;                    ///< [-]
  Vec<Dim> push = Vec<Dim>::Zero();    ///< [N] of that share
  Vec<Dim> offset = Vec<Dim>::Zero();  ///< [m] of the surface; both along the axis
  int axis = 0;

  /// From the force of contact and its couple (rigid_contact.h). The push acts at the end of the
  /// material, `extent` [m] away, and has the moment of the couple.
  SidePush(const Vec<Dim>& force, const ContactCouple<Dim>& couple, double extent) {
    constexpr double least = 0.9;  // n_axis^2
    const double all = couple.diagonal().maxCoeff(&axis), of_all = couple.trace();
    if (!(all > least * of_all && all <= (1.0 + 1e-9) * of_all)) return;
    const double along = force.dot(couple.col(axis));
    if (along == 0.0) return;
    const double t = (all / of_all - least) / (1.0 - least), out = along > 0.0 ? extent : -extent;
    share = t * t * (3.0 - 2.0 * t);
    push[axis] = share * all / out;
    offset[axis] = -out;
  }
  /// What it leaves of the couple.
  void take_from(ContactCouple<Dim>& couple) const { couple(axis, axis) *= 1.0 - share; }
};

/// Call add(i, W_i - N_i) for the nodes of a particle with a SidePush.
template <int Dim, TensorBasis Basis, class Add>
void give_shift_to_side(const Basis& basis, Local p, const SidePush<Dim>& side, Add add) {
  const int beside = side.axis == 0 ? 1 : 0;
  give_side_functions<Dim>(basis, p, 1u, [&](int) {
    return std::pair(side.offset,
                     [&](int i, const Vec<Dim>& N) { add(i, N[side.axis] - N[beside]); });
  });
}

/// Forces of rigid bodies act at their surfaces: f_i -= C grad N_i, with the couple C [N m] of a
/// particle (rigid_contact.h), or SidePush.
template <int Dim, class Basis>
void add_contact_couples(const Basis& basis, const ParticleBin& bin, const Local* nodes,
                         double* sums, const Particles<Dim>& particles) {
  const auto rows = particles.template rows<contact_components<Dim>>(Column::contact_couple);
  for (Local first = bin.begin; first < bin.end; first += lanes<Pack>) {
    const unsigned acting = not_zero(rows, first, bin.end);
    if (acting == 0) continue;
    give_gradients<Dim>(basis, first, acting, [&](int lane) {
      const Local p = first + lane;
      ContactCouple<Dim> C = contact_couple<Dim>(rows, p);
      if constexpr (TensorBasis<Basis>)
        if (const SidePush<Dim> side(contact_force<Dim>(particles, p), C,
                                     particles.row(Column::contact_extent)[p]);
            side.share > 0.0) {
          side.take_from(C);
          give_shift_to_side<Dim>(basis, p, side, [&](int i, double shift) {
            general::add_to_node(sums, nodes[i], node_vector<Dim>(shift * side.push));
          });
        }
      std::array<NodeVector, Dim> column;
      for (int b = 0; b < Dim; ++b)
        column[static_cast<std::size_t>(b)] = node_vector<Dim>(C.col(b));
      return [=](int i, const double(&dN)[Dim]) {
        double* at = sums + static_cast<std::ptrdiff_t>(nodes[i]) * sum_stride;
        NodeVector sum = load<NodeVector>(at);
        for (std::size_t b = 0; b < Dim; ++b) sum -= NodeVector(dN[b] * column[b]);
        store(sum, at);
      };
    });
  }
}

/// What particles of a bin have of forces of their own, with those of rigid bodies.
template <int Dim, class Basis>
void add_own_forces(const Basis& basis, const Patch<Dim>& patch, const StepContext<Dim>& step,
                    const ParticleBin& bin, const Local* nodes, double* sums) {
  if (!has_particle_forces(patch, bin, *step.model)) return;
  add_particle_forces<Dim>(basis, bin, nodes, sums,
                           [&](Local p) { return force_on(patch.particles, p, step); });
  if (step.model->analysis.rigid_bodies)
    add_contact_couples(basis, bin, nodes, sums, patch.particles);
}

/// Work of these forces over the step, in bins for which takes(bin) is true. It is taken as at
/// nodes, with the mean of their velocities before and after the step, from those after it and the
/// accelerations. What sides do beyond centres goes with strains: it is taken with velocities as
/// they are where strains are found from others than those after the step, by WorkPart::sides. At
/// nodes of little mass beyond a surface these differ by more than the work is.
template <int Dim, class Takes, class Force>
void add_work_of_forces(Patch<Dim>& patch, const StepContext<Dim>& step, ParticleBins bins,
                        const NodeArray& velocity, const NodeArray& acceleration, Takes takes,
                        Force force, WorkPart part = WorkPart::all) {
  const double* const fields[2] = {velocity.data(), acceleration.data()};
  const double half = part == WorkPart::sides ? 0.0 : 0.5 * step.dt;
  for_each_bin_with_basis(
      patch, bins, takes, [&](const auto& basis, const ParticleBin& bin, const Local* nodes) {
        for (Local p = bin.begin; p < bin.end; ++p) {
          const SurfaceForce<Dim> all = force(p);
          const bool aside = part != WorkPart::centres && !all.offset.isZero(0.0);
          if (all.is_zero() || (part == WorkPart::sides && !aside)) continue;
          Scalar sum[2][Dim];
          general::interpolate<Dim, 2, Scalar>(basis, p, fields, nodes, sum);
          Vec<Dim> at_centre, at_side;
          for (int d = 0; d < Dim; ++d) at_centre[d] = sum[0][d][0] - half * sum[1][d][0];
          at_side = at_centre;
          if (aside) {
            if constexpr (TensorBasis<std::decay_t<decltype(basis)>>) {
              at_side.setZero();
              give_side_functions<Dim>(basis, p, 1u, [&](int) {
                return std::pair(all.offset, [&](int i, const Vec<Dim>& N) {
                  const auto at = static_cast<std::ptrdiff_t>(nodes[i]) * node_width;
                  for (int d = 0; d < Dim; ++d)
                    at_side[d] += N[d] * (fields[0][at + d] - half * fields[1][at + d]);
                });
              });
            } else {
              Scalar L[2][Dim][Dim];
              for (int k = 0; k < 2; ++k)
                general::gradient<Dim, Scalar>(basis, p, fields[k], nodes, L[k]);
              for (int d = 0; d < Dim; ++d)
                at_side[d] += all.offset[d] * (L[0][d][d][0] - half * L[1][d][d][0]);
            }
          }
          const Vec<Dim> moves = part == WorkPart::sides ? at_side - at_centre : at_side;
          patch.work.external += step.dt * all.force.dot(moves);
        }
      });
}

}  // namespace lahar
